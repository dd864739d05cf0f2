"""Detection of a mask that fills holes which the named object has, such as the rings of scissors.

Background seen through a small ring is shaded, and in a JPEG has the tint of the ring, so the mask alone does not tell it
from a part of the object. It is detected by the template, which has a hole there, and by colours closer to the background
than to the object.
"""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.generators.templates.fitting.drawing import edges_between, silhouette
from manitwin.models.generators.templates.fitting.fit import TemplateFit
from manitwin.models.generators.templates.fitting.view import normalised

SIDE_PX = 256
LEAST_HOLES = 0.02
"""Minimum share of holes in the visible object; fits ignore smaller holes too."""
MOST_OPEN_HOLES = 0.25
"""Share of the template's hole area; a mask with more hole area has the holes."""
LEAST_BACKGROUND_SHARE = 0.5
"""Minimum share of the template's hole area that is filled with background; a poor fit overlaps only roughly."""
LEAST_CONTRAST_LAB = 20.0
"""Minimum L*a*b* distance between object and surrounding background; below it the two cannot be told apart."""
BACKGROUND_WIDTH_SHARE = 0.12
"""Width of the surrounding background, as a share of the object's longer side."""


def reject_filled_holes(fitted: TemplateFit, rgba: np.ndarray) -> None:
    """Raise Rejected (``generator_failed``) if background is visible in a hole of the object that the mask fills.

    ``rgba (H, W, 4) uint8`` has the mask as alpha, with the colours of the photo below it. ``fitted`` is the closest fit of
    the named object's template to the mask.
    """
    height, width = rgba.shape[:2]
    scale = SIDE_PX / max(height, width)
    small = cv2.resize(rgba, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    mask = small[..., 3] > 127
    solid = fitted.made.mesh
    points, _, _ = normalised(solid.vertices)
    flat, _ = fitted.view.project(points)
    pixels = (flat * fitted.box_px + np.array(fitted.center_px)) * scale
    drawn = silhouette(pixels, solid.faces, edges_between(solid.faces), SIDE_PX)[: mask.shape[0], : mask.shape[1]] > 0
    holes_px = int(_holes(drawn).sum())
    if holes_px < LEAST_HOLES * drawn.sum() or _holes(mask).sum() > MOST_OPEN_HOLES * holes_px:
        return
    if _enclosed_background_px(small[..., :3], mask) < LEAST_BACKGROUND_SHARE * holes_px:
        return
    raise Rejected(
        "generator_failed",
        f"its cut-out fills the holes of the {fitted.category} with what is more like the ground than like the thing; give a mask"
        " of it (--mask), draw its outline (manitwin review cutouts --draw --redraw ID), or photograph it larger",
        "generate",
    )


def _holes(mask: np.ndarray) -> np.ndarray:
    return np.asarray(ndimage.binary_fill_holes(mask) & ~mask)


def _enclosed_background_px(rgb: np.ndarray, mask: np.ndarray) -> int:
    """Return the number of enclosed pixels of ``mask (H, W) bool`` with colours closer to the background than to the object."""
    lab = cv2.cvtColor(rgb.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    away_px = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    side_px = max(np.ptp(np.nonzero(mask), axis=1)) + 1
    beside = (away_px > 3) & (away_px < 3 + BACKGROUND_WIDTH_SHARE * side_px)
    if not beside.any():
        return 0
    ground, thing = np.median(lab[beside], axis=0), np.median(lab[mask], axis=0)
    if np.linalg.norm(ground - thing) < LEAST_CONTRAST_LAB:
        return 0
    alike = mask & (np.linalg.norm(lab - ground, axis=2) < np.linalg.norm(lab - thing, axis=2))
    labels, count = ndimage.label(alike)
    open_to_ground = np.unique(labels[cv2.dilate((~mask).astype(np.uint8), np.ones((5, 5), np.uint8)) > 0])
    enclosed = ~np.isin(np.arange(count + 1), open_to_ground)
    enclosed[0] = False
    return int(enclosed[labels].sum())
