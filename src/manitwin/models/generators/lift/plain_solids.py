"""Plain solids fitted to a photo of an unnamed object: blocks, slabs with round corners, cylinders, discs.

Inflating a silhouette in the image plane makes a book that lies on a table stand before the camera, as high as it looks. A
plain solid seen from above explains such a silhouette almost to the pixel, and its edges are visible in the photo; then its
view is accepted too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache

import cv2
import numpy as np

from manitwin.geometry.solids.shapes import box, cylinder, prism, rectangle
from manitwin.models.generators.lift.block_views import BlockView, block_views
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.templates.fitting.evidence import Evidence, extract_evidence
from manitwin.models.generators.templates.fitting.fit import TemplateFit, first_solid_fit
from manitwin.models.generators.templates.fitting.least_squares import PlacedView, Problem
from manitwin.models.generators.templates.fitting.residual import Residual, residual
from manitwin.models.generators.templates.fitting.search import Candidate, search
from manitwin.models.generators.templates.fitting.shape import ShapeFamily
from manitwin.models.generators.templates.fitting.view import View
from manitwin.models.generators.templates.template import Measure, Model, Template

LEAST_IOU, MOST_OUTLINE = 0.985, 0.0022
"""Minimum overlap, and maximum distance of the outlines over the longer side, of a plain solid that explains a photo."""
MOST_EDGES_MISSING = 0.67
"""Maximum share of the solid's inner edges that are missing in the photo; 0.7 is neutral.

This limit and those above were set on synthetic photos of 43 objects.
"""
EDGES_SEEN, NEAR_IOU, NEAR_OUTLINE = 0.4, 0.96, 0.0045
SILENT_EDGES, EXACT_IOU, EXACT_OUTLINE = 0.7, 0.995, 0.001
"""Limits for a solid that is preferred to a lifted silhouette (``is_preferred_to_lifted``).

Of 164 photos of 57 synthetic objects, those that no solid explains closely gain 0.08 to 0.31 volumetric IoU by visible edges
(five photos) and 0.2 by their silhouettes (two dice); none loses.
"""
LEAST_SOLIDITY = 0.96
"""Minimum solidity of a silhouette, since these solids are convex."""
MOST_DISC = 0.15
"""Maximum thickness of a disc over its width; a thicker one may be a bowl seen from above."""
PRIMITIVES = {"box": "box", "cutting board": "slab", "can": "cylinder", "coaster": "disc"}
"""Primitive of each solid, by a category of objects that rest in the same pose."""
_ROUNDS = 6  # least-squares iterations, starting from a block with sharp edges
_NEAR = 1.1  # factor around the initial proportions of a block
_THICKEST_SLAB = 0.3  # of its length: a thicker one is a block
_EDGE = 0.02  # edge radius of a block over its shortest side
_ROUNDED = 0.2  # edge radius of a slab over its thickness


@dataclass(frozen=True)
class PlainSolids:
    """The plain solid that explains a photo closely, and the one that explains it best; None if there is none."""

    close_fit: TemplateFit | None = None
    best_fit: TemplateFit | None = None


def plain_solids(rgba: np.ndarray, hint: ShapeHint, focal_mm: float | None = None) -> PlainSolids:
    """Return the plain solids that explain ``rgba (H, W, 4) uint8``, whose alpha is the mask.

    Solids that contradict ``hint`` are not tried. ``focal_mm`` is the 35 mm equivalent focal length, if known.
    """
    tried, mask = [solid for solid in plain_templates() if _is_compatible(solid, hint)], rgba[..., 3] > 127
    if not tried or _solidity(mask) < LEAST_SOLIDITY:
        return PlainSolids()
    evidence = extract_evidence(rgba, focal_mm)
    blocks = block_views(mask, evidence.perspective, evidence.focal_spread)
    found = [best for solid in tried for best in _fits(solid, evidence, blocks)]
    possible = sorted(filter(_is_possible, found), key=lambda each: each.residual.cost)
    close = [each for each in possible if explains_closely(each.residual)]
    return PlainSolids(first_solid_fit(close, evidence), first_solid_fit(possible, evidence))


def _fits(solid: Template, evidence: Evidence, blocks: Sequence[BlockView]) -> list[Candidate]:
    """Return fits of a solid: for a block from the blocks of the silhouette, for a slab from these and from a search."""
    kind = PRIMITIVES[solid.category]
    if kind == "box":
        return [_fit_block(solid, each, evidence) for each in blocks]
    found = [each for each in search([ShapeFamily(solid)], evidence, settled=True) if each.upright][:1]
    if kind == "slab":
        found += [
            _fit_slab(solid, each, evidence) for each in blocks if max(each.width, each.depth) * _THICKEST_SLAB >= 1
        ]
    return found


def _fit_block(template: Template, block: BlockView, evidence: Evidence) -> Candidate:
    """Return the block with rounded edges that is fitted from a sharp block."""
    near = {
        name: Measure(usual / _NEAR, usual, usual * _NEAR, "")
        for name, usual in (("width", block.width), ("depth", block.depth))
    }
    family = ShapeFamily(replace(template, measures={**template.measures, **near}))
    return _fit_from_view(family, block.view, evidence)


def _fit_slab(template: Template, block: BlockView, evidence: Evidence) -> Candidate:
    """Return the slab with rounded corners and edges that is fitted from a block."""
    length, across = max(block.width, block.depth), min(block.width, block.depth)
    family = ShapeFamily(template, {"width": across / length, "thick": 1 / length})
    turn = 0.0 if block.width >= block.depth else np.pi / 2  # the length of a slab is its width seen from the front
    return _fit_from_view(family, replace(block.view, yaw_rad=block.view.yaw_rad + turn), evidence)


def _fit_from_view(family: ShapeFamily, view: View, evidence: Evidence) -> Candidate:
    """Return a family's fit from its expected measures and a view, for a camera that is not rolled."""
    start, begin = np.zeros(len(family.free)), [PlacedView(view, upright=True)]
    problem = Problem(family, [evidence], turns=False)
    at, (placed,) = problem.solve(start, begin, measures=True, rounds=_ROUNDS)
    solid = family.solid(at)
    assert solid is not None  # the fit rejects steps to measures without a solid
    return Candidate(family, at, placed.view, True, residual(solid, placed.view, evidence))


@cache
def plain_templates() -> tuple[Template, ...]:
    """Return the solids as templates, each with a category of objects that rest in the same pose."""
    block = {"height_m": _fixed(0.1), "width": Measure(0.4, 1.0, 2.5, ""), "depth": Measure(0.3, 0.7, 1.5, "")}
    slab = {
        "length_m": _fixed(0.2),
        "width": Measure(0.3, 0.65, 1.0, ""),
        "thick": Measure(0.02, 0.08, 0.25, ""),
        "corner": Measure(0.02, 0.1, 0.4, ""),
    }
    upright = {"height_m": _fixed(0.1), "width": Measure(0.3, 0.8, 2.5, ""), "top": Measure(0.8, 1.0, 1.25, "")}
    disc = {"width_m": _fixed(0.1), "thick": Measure(0.02, 0.08, MOST_DISC, "")}
    return (
        Template("box", "household", block, {"body": ("cardboard",)}, _block),
        Template("cutting board", "kitchen", slab, {"body": ("wood",)}, _slab),
        Template("can", "kitchen", upright, {"body": ("steel",)}, _cylinder),
        Template("coaster", "kitchen", disc, {"body": ("cork",)}, _disc),
    )


def _fixed(length_m: float) -> Measure:
    return Measure(length_m, length_m, length_m, "m")


def _block(*, height_m: float, width: float, depth: float) -> Model:
    """Build a block."""
    sides = (width * height_m, depth * height_m, height_m)
    return Model().add("body", box(*sides, radius_m=_EDGE * min(sides)))


def _slab(*, length_m: float, width: float, thick: float, corner: float) -> Model:
    """Build a slab that lies; ``corner`` is the radius of its corners seen from above, over its width."""
    across_m, thick_m, corner = width * length_m, thick * length_m, max(corner, 0.0)
    outline = rectangle(length_m, across_m, radius_m=corner * across_m)
    return Model().add("body", prism(outline, thick_m, radius_m=_ROUNDED * min(thick_m, corner * across_m)))


def _cylinder(*, height_m: float, width: float, top: float) -> Model:
    """Build a cylinder that stands; ``top`` is the radius of its upper end over that of its lower end."""
    radius_m = 0.5 * width * height_m
    return Model().add("body", cylinder(radius_m, height_m, top_radius_m=top * radius_m))


def _disc(*, width_m: float, thick: float) -> Model:
    """Build a disc that lies."""
    return Model().add("body", cylinder(0.5 * width_m, thick * width_m))


def _is_compatible(solid: Template, hint: ShapeHint) -> bool:
    """Tell whether a solid is compatible with the hint; open containers are none of them."""
    kind = PRIMITIVES[solid.category]
    if hint.container:
        return False
    if hint.round:
        return kind == "disc" or (kind == "cylinder" and not hint.flat)
    return kind in ("box", "slab") or not (hint.boxy or hint.flat)


def explains_closely(left: Residual) -> bool:
    """Tell whether hardly anything is left unexplained, neither of the silhouette nor of the solid's inner edges."""
    return left.iou >= LEAST_IOU and left.outline <= MOST_OUTLINE and left.edges <= MOST_EDGES_MISSING


def is_preferred_to_lifted(plain: TemplateFit, lifted: str) -> bool:
    """Tell whether a plain solid is preferred to a primitive that was ``lifted``: a revolution, a box or an inflation.

    It is if its inner edges are visible in the photo. A block also is if it has the silhouette to the pixel, because a cube
    from above has nearly the silhouette of a body of revolution. (A glass from the side has that of a slab seen from nearby.)
    """
    left = plain.residual
    edges_seen = left.edges <= EDGES_SEEN and left.iou >= NEAR_IOU and left.outline <= NEAR_OUTLINE
    exact = left.edges <= SILENT_EDGES and left.iou >= EXACT_IOU and left.outline <= EXACT_OUTLINE
    return edges_seen or (exact and PRIMITIVES[plain.category] == "box" and lifted == "revolution")


def _is_possible(candidate: Candidate) -> bool:
    """Tell whether a candidate's camera is not rolled, and the candidate is not a disc that may be a bowl."""
    family = candidate.family
    thick = PRIMITIVES[family.template.category] == "disc" and family.measures(candidate.spreads)["thick"] > MOST_DISC
    return candidate.upright and not thick


def _solidity(mask: np.ndarray) -> float:
    """Return the area of a mask (H, W) over that of its convex hull."""
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    if not contours:
        return 0.0
    return float(mask.sum() / max(cv2.contourArea(cv2.convexHull(np.concatenate(contours))), 1.0))
