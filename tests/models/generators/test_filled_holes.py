"""Cut-outs that fill what a thing of their name has open, and such as are right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.generators.lift.filled_holes import reject_filled_holes
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.drawing import edges_between, silhouette
from manitwin.models.generators.templates.fitting.evidence import extract_evidence
from manitwin.models.generators.templates.fitting.fit import TemplateFit, assemble_fit, build_fitted_object
from manitwin.models.generators.templates.fitting.least_squares import PlacedView
from manitwin.models.generators.templates.fitting.residual import Residual
from manitwin.models.generators.templates.fitting.view import View, normalised

SIDE, BOX = 512, 220.0
GROUND, DARK, PALE = (205, 200, 190), (40, 40, 45), (190, 186, 180)


def _seen(category: str) -> tuple[TemplateFit, np.ndarray]:
    """Return a thing seen from above, and its silhouette (512, 512) bool."""
    template = load_templates()[category]
    made = build_fitted_object(template, template.typical_measures())
    view = View(yaw_rad=0.0, elevation_rad=1.5, roll_rad=0.3, perspective=0.1)
    flat, _ = view.project(normalised(made.mesh.vertices)[0])
    center = (SIDE / 2, SIDE / 2)
    mask = silhouette(flat * BOX + np.array(center), made.mesh.faces, edges_between(made.mesh.faces), SIDE) > 0
    left = Residual(iou=0.76, outline=0.02, edges=0.5, shading=0.5, hidden=0.0, edge_px=10)
    found = assemble_fit(made, PlacedView(view, False), left, extract_evidence(_cut_out(mask, mask)))
    return replace(found, center_px=center, box_px=BOX), mask


def _cut_out(
    thing: np.ndarray, alpha: np.ndarray, colour: tuple[int, int, int] = DARK, inside: tuple[int, int, int] = PALE
) -> np.ndarray:
    """Return a photo of a ``thing`` with what is ``inside`` its holes, cut out by ``alpha``."""
    rgb = np.empty((SIDE, SIDE, 3), np.uint8)
    rgb[:] = GROUND
    rgb[ndimage.binary_fill_holes(thing)] = inside
    rgb[thing] = colour
    return np.dstack([rgb, 255 * alpha]).astype(np.uint8)


def test_scissors_whose_rings_are_filled_with_the_ground_are_refused() -> None:
    found, mask = _seen("scissors")
    filled = ndimage.binary_fill_holes(mask)
    assert filled.sum() > 1.05 * mask.sum(), "its rings are seen"
    with pytest.raises(Rejected, match="its cut-out fills the holes of the scissors") as caught:
        reject_filled_holes(found, _cut_out(mask, filled))
    assert caught.value.reason == "generator_failed" and caught.value.stage == "generate"


def test_open_rings_rings_of_the_things_own_colour_and_things_without_holes_are_not() -> None:
    found, mask = _seen("scissors")
    filled = ndimage.binary_fill_holes(mask)
    reject_filled_holes(found, _cut_out(mask, mask))
    reject_filled_holes(found, _cut_out(mask, filled, inside=(60, 58, 60)))
    reject_filled_holes(found, _cut_out(mask, filled, colour=(190, 190, 185)))
    plain, outline = _seen("spoon")
    patch = ndimage.binary_erosion(outline, iterations=6)
    reject_filled_holes(plain, _cut_out(outline & ~patch, outline))
