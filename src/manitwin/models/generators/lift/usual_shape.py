"""Checks of a lifted solid against the name's template: whether the object is not round, or has other proportions.

The silhouette of a shoe seen from the toe is that of a body of revolution, that of a pencil from its end that of a peg, and
that of a book at its edge that of a bar. The template of the name gives the shape of such objects.
"""

from __future__ import annotations

from functools import cache

import cv2
import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import SolidError, coarser, union
from manitwin.models.annotators.descriptions import article
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.lift.hint import hint_from_name
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.fit import alternative_categories, template_for
from manitwin.models.generators.templates.template import Template

LEAST_TURNED_SHARE = 0.86
"""Minimum share of a solid within one disc per level for a body of revolution.

A square bar has pi/4 = 0.79 and a hexagonal one 0.91. Of 280 templates, those that are bodies of revolution apart from
handles and spouts have 0.87 to 0.98, the others 0.86 or less.
"""
_LEVELS, _SIDE_PX = 24, 96
_COARSE = 0.6
_AXIS_ROTATIONS_DEG = ((0.0, 0.0, 0.0), (90.0, 0.0, 0.0), (0.0, 90.0, 0.0))
_NON_REVOLUTION_SHAPES = frozenset({"two", "frame", "arc", "pistol", "seat", "legs", "bag"})
"""Words of a prior's shape that exclude a body of revolution."""
MARGIN = 2.0
"""Maximum factor by which a proportion may exceed the range of the template's measures.

Of 351 photos of synthetic objects of 93 categories lifted without their templates, 72 exceed it: all but one share at most
0.53 of their volume with the true object (median 0.25), the others 0.72 in the median.
"""
LEAST_MISSING = 0.03
"""Tolerated error of the thickness of a flat object, over its length, such as a turner seen from above.

Its surfaces then deviate by half of that; those of the 351 lifted objects deviate by 0.026 in the median.
"""


def revolution_conflict(name: str | None) -> str | None:
    """Return why an object of this name is no body of revolution, by its template or, without one, its prior; else None.

    An object that its prior calls round or cylindrical may be one whatever its template is, and so may an object whose shape
    word is shared with round templates (a basket is an open container, as a flower pot is), and an unknown one.
    """
    prior = find_prior(name)
    if prior is None or hint_from_name(name).round:
        return None
    meant = _possible_templates(name)
    if meant:
        alike = [category for category in load_templates() if load_priors()[category].shape == prior.shape]
        if any(_is_revolution(category) for category in [*(template.category for template in meant), *alike]):
            return None
    elif not _NON_REVOLUTION_SHAPES & set(prior.shape.replace("-", " ").replace(",", " ").split()):
        return None
    return f"a round thing would have its outline, but {article(prior.category)} {prior.category} is not round"


def proportion_conflict(name: str | None, extents: np.ndarray, *, turned: bool = False) -> str | None:
    """Return why sides ``(3,)`` are impossible for all objects of this name's template; None if they are possible.

    A body of revolution (``turned``) never looks longer than it is, so it may be as long as it looks. Names that are not the
    template's own (a boot is a kind of shoe) and objects of arbitrary proportions are not tested.
    """
    meant = _possible_templates(name)
    if not meant or not _is_own_name(meant[0], name) or any(template.any_proportions for template in meant):
        return None
    found = _ratios(np.asarray(extents, float))
    low, high = (np.array(ends) for ends in zip(*(_usual_ratios(template.category) for template in meant), strict=True))
    low, high = low.min(axis=0), high.max(axis=0)
    category = meant[0].category
    for ratio, least, most, side in zip(found, low, high, ("wide", "thick"), strict=True):
        if least / MARGIN <= ratio <= (np.inf if turned else most * MARGIN):
            continue
        if 0 < 1 / most - 1 / ratio < LEAST_MISSING:
            continue
        usual = f"{least:.1f} to {most:.1f}" if f"{least:.1f}" != f"{most:.1f}" else f"{least:.1f}"
        return (
            f"it would be {ratio:.1f} times as long as {side}, and {article(category)} {category} is so {usual} times: its"
            f" outline from here does not tell how {side} it is"
        )
    return None


def _possible_templates(name: str | None) -> list[Template]:
    """Return the templates that a name may mean, its own first; empty without one."""
    template = template_for(name)
    if template is None:
        return []
    templates = load_templates()
    return [template, *(templates[kind] for kind in alternative_categories(template.category, name))]


def _is_own_name(template: Template, name: str | None) -> bool:
    words = " ".join((name or "").lower().replace("_", " ").replace("-", " ").split())
    return any(words == own or words.endswith(f" {own}") for own in (template.category, *template.names))


def _ratios(extents: np.ndarray) -> np.ndarray:
    """Return the ratios of length to width and to thickness ``(2,)``."""
    longest, second, shortest = np.sort(extents)[::-1]
    return np.array([longest / second, longest / shortest])


@cache
def _usual_ratios(category: str) -> tuple[np.ndarray, np.ndarray]:
    """Return the minimum and maximum ``_ratios`` of a template with typical measures, varying one at a time to its limits."""
    template = load_templates()[category]
    usual = template.typical_measures()
    tried = [usual]
    for name, measure in template.measures.items():
        tried += [usual | {name: measure.low}, usual | {name: measure.high}]
    ratios = []
    for measures in tried:
        try:
            with coarser(_COARSE):
                mesh = template.build(**measures).assembly.mesh()
        except SolidError:  # a limit that is incompatible with the typical values of the others
            continue
        ratios.append(_ratios(np.ptp(mesh.vertices, axis=0)))
    return np.min(ratios, axis=0), np.max(ratios, axis=0)


@cache
def _is_revolution(category: str) -> bool:
    """Tell whether a template with typical measures is round about one of its axes, apart from handles and spouts."""
    template = load_templates()[category]
    with coarser(_COARSE):
        whole = union([solid for _, solid in template.build(**template.typical_measures()).assembly.solids()])
    return max(revolution_share(whole.rotate(turn)) for turn in _AXIS_ROTATIONS_DEG) >= LEAST_TURNED_SHARE


def revolution_share(solid: Manifold) -> float:
    """Return the share of a solid, with holes filled, within the largest disc of each of its level sections."""
    low, high = np.reshape(solid.bounding_box(), (2, 3))
    scale = (_SIDE_PX - 8) / float((high - low)[:2].max())
    area_px, disc_px = 0.0, 0.0
    for level in range(_LEVELS):
        section = np.zeros((_SIDE_PX, _SIDE_PX), np.uint8)
        for loop in solid.slice(low[2] + (level + 0.5) / _LEVELS * (high - low)[2]).to_polygons():
            cv2.fillPoly(section, [np.rint((np.asarray(loop) - low[:2]) * scale + 4).astype(np.int32)], 1)
        area_px += float(section.sum())
        disc_px += np.pi * float(cv2.distanceTransform(section, cv2.DIST_L2, 5).max()) ** 2
    return disc_px / area_px
