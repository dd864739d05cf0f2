"""Measures of a found mask that tell right cut-outs from wrong ones, taken from the photo and not from how the mask was found."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import length
from manitwin.models.matting.outline import dilated, disk, eroded, gradient_magnitude, opened
from manitwin.models.matting.segmentation import Segmentation

NEAR_SHARE = 0.4  # of the object's longer side: edges farther out are not its own
BEYOND_PX = 5
LEAST_EDGE, LEAST_TIMES = 2.5, 2.5  # in L*a*b* a pixel, and against what the ground's texture reaches
AS_SHARP = 0.8  # of the outline: gradient at a fine scale over that at a coarse one, larger where an edge is sharper
COARSE_PX = 2.5
LONG_SHARE, LEAST_LONG_PX = 0.06, 8  # of the object's longer side: shorter pieces are texture
VALLEY_PX = 4  # half the width of the widest slot that counts as one
DEEP = 0.15  # of the contrast on both sides
FULL = 0.6  # of the object's contrast: what is on both sides of a slot
MOST_LIGHT, MOST_TINT = (
    1.1,
    0.15,
)  # of the ground's, and spread of the channels' ratios: ground in a slot, mixed with its sides


@dataclass(frozen=True)
class Doubts:
    """Measures of a mask, each 0 or more; more is worse.

    ``edges_beyond`` edges as sharp as the outline that lie outside of it and near, in outline lengths: a part was lost;
    ``slots`` share in narrow strips that are more like the ground than both their sides; ``unknown_to_colours`` what differs from
    what colours call certain, or possible where that is nearer, but for slivers, as a share of both; ``thinness`` outline over
    area: a third of a pixel off all around is much of a thin thing.
    """

    edges_beyond: float
    slots: float
    unknown_to_colours: float
    thinness: float


LIMITS = Doubts(edges_beyond=0.30, slots=0.045, unknown_to_colours=0.068, thinness=0.077)
"""What 97 % of right cut-outs stay below, of those that the other scores believe (``python benchmarks/matting_limits.py``)."""


def doubts_of(found: Segmentation, *, zoom: float = 1.0) -> Doubts:
    """Measure a mask that is not empty; ``zoom`` is the photo's size over the mask's, as far as it says how fine outlines are."""
    mask, background = found.mask, found.background
    area = float(mask.sum())
    outline = mask & ~eroded(mask, 1)
    ratio = background.light_ratio
    light = ratio.mean(2)
    tint = length(ratio / np.maximum(light, 1e-3)[..., None] - 1) / np.sqrt(3)
    slots = _slots(length(background.residual), mask) & (tint < MOST_TINT) & (light < MOST_LIGHT)
    return Doubts(
        edges_beyond=float(_sharp_beyond(found, outline).sum() / outline.sum()),
        slots=float(slots.sum()) / area,
        unknown_to_colours=min(_apart(mask, way) for way in (found.colours.certain, found.colours.possible)),
        thinness=float(outline.sum()) / area / zoom,
    )


def _apart(mask: np.ndarray, other: np.ndarray) -> float:
    return float(opened(mask ^ other, 1).sum() / (mask | other).sum())


def _sharp_beyond(found: Segmentation, outline: np.ndarray) -> np.ndarray:
    """Return the crests (H, W) of edges outside the mask, near it, that are as sharp as its outline.

    The steepest gradient of a step that is blurred by s, seen at scale t, goes with 1 / sqrt(s^2 + t^2): the ratio of two scales
    tells how sharp an edge is, whatever its contrast.
    """
    gradient, background = found.gradient, found.background
    sharpness = gradient / np.maximum(gradient_magnitude(background.lab, COARSE_PX), 0.05)
    across = [cv2.dilate(gradient, np.ones(shape, np.uint8)) <= gradient + 1e-6 for shape in ((1, 3), (3, 1))]
    crest = across[0] | across[1]
    own = crest & dilated(outline, 2)
    typical = float(np.median(sharpness[own])) if own.any() else 1.6
    rows, columns = np.nonzero(found.mask)
    longest = float(max(np.ptp(rows), np.ptp(columns)) + 1)
    away = ndimage.distance_transform_edt(~found.mask)
    near = (away > BEYOND_PX) & (away < NEAR_SHARE * longest) & ~dilated(background.seam, 3)
    strong = gradient > max(LEAST_TIMES * found.edge_threshold, LEAST_EDGE)
    edges = crest & near & strong & (sharpness > AS_SHARP * typical)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(dilated(edges, 1).astype(np.uint8), connectivity=8)
    extent = np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT])
    return np.asarray(edges & (extent > max(LEAST_LONG_PX, LONG_SHARE * longest))[labels])


def _slots(contrast: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return narrow strips (H, W) of the object that are more like the ground than what is on both sides of them."""
    own = np.where(mask, contrast, 0).astype(np.float32)
    closed = cv2.morphologyEx(own, cv2.MORPH_CLOSE, disk(VALLEY_PX))
    deep = closed - contrast > DEEP * closed
    return np.asarray(mask & deep & (closed > FULL * float(np.median(contrast[mask]))))
