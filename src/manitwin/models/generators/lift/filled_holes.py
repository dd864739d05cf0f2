"""Whether a cut-out fills the holes that its name has: the rings of scissors in which the ground is seen.

Ground that is seen through a small ring has shade, and in a JPEG the ring's own tint: the cut-out alone does not tell it from a
part of the thing. That such a thing has a hole there, and that what is there is more like the ground than like the thing, does.
"""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.generators.templates.fitting.drawing import edges_between, silhouette
from manitwin.models.generators.templates.fitting.fit import Fitted
from manitwin.models.generators.templates.fitting.view import normalised

SIDE_PX = 256
LEAST_HOLES = 0.02
"""Of what is seen of a thing: smaller holes are left out of a fit as well."""
MOST_OPEN = 0.25
"""Of the template's holes: a cut-out that has more of them has them."""
LEAST_GROUND = 0.5
"""Of the template's holes: as much is filled with ground. A fit that is not believed lies only roughly on the thing."""
LEAST_CONTRAST_LAB = 20.0
"""Between the thing and the ground around: with less nobody can tell which of them is seen."""
AROUND = 0.12
"""Of the thing's longer side, as far as its ground is looked at."""


def reject_filled_holes(fitted: Fitted, rgba: np.ndarray) -> None:
    """Raise Rejected (``generator_failed``) where the ground of ``rgba (H, W, 4) uint8`` is seen in a hole of the mask's thing.

    ``fitted`` is the nearest that a thing of its name comes to the mask, which is the alpha; under it are the photo's colours.
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
    if holes_px < LEAST_HOLES * drawn.sum() or _holes(mask).sum() > MOST_OPEN * holes_px:
        return
    if _ground_inside(small[..., :3], mask) < LEAST_GROUND * holes_px:
        return
    raise Rejected(
        "generator_failed",
        f"its cut-out fills the holes of the {fitted.category} with what is more like the ground than like the thing; give a mask"
        " of it (--mask), draw its outline (manitwin review cutouts --draw --redraw ID), or photograph it larger",
        "generate",
    )


def _holes(mask: np.ndarray) -> np.ndarray:
    return np.asarray(ndimage.binary_fill_holes(mask) & ~mask)


def _ground_inside(rgb: np.ndarray, mask: np.ndarray) -> int:
    """Return how many pixels that the rest of a ``mask (H, W) bool`` encloses are nearer to the ground than to the thing."""
    lab = cv2.cvtColor(rgb.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    away_px = cv2.distanceTransform((~mask).astype(np.uint8), cv2.DIST_L2, cv2.DIST_MASK_5)
    side_px = max(np.ptp(np.nonzero(mask), axis=1)) + 1
    beside = (away_px > 3) & (away_px < 3 + AROUND * side_px)
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
