"""Strips along an outline with the background's tint, dimmed: the shadow of a coloured object, or a grey part of it."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import MIN_SHADE, Background, length
from manitwin.models.matting.hard_shadow import LEAST_ATTACHED, MOST_ATTACHED, edge_width_px
from manitwin.models.matting.outline import dilated, disk, eroded, opened
from manitwin.models.matting.shadow import falls_inward

MOST_LIGHT = 0.95  # of the background's light: lighter pixels are mixed rims
MOST_TINT = 0.12  # spread of the channels' ratios that other light sources add to a shadow
OWN_TINT, OWN_TIMES = 0.15, 2.2
"""Minimum tint of the object, absolute and relative to the strip's (3 to 9 times in synthetic shadows)."""
LEAST_CORE = 0.4  # of the mask: an object mostly of the background's tint gives no evidence
MOST_DEPTH = 0.3  # of the core's depth: thicker regions are no strips
LEAST_SHARE = 0.003  # of the mask
LEAST_EDGE, LEAST_WIDTH_PX, LEAST_FALLING = 1.05, 1.15, 0.95  # a perfect edge is 1.05 px wide
WIDER = 1.2  # times the width of the object's outline, which is the blur of the photo


@dataclass(frozen=True)
class Strips:
    """Masks (H, W): ``shadow`` ends in a penumbra towards the light, ``doubtful`` in an outline as sharp as the object's own."""

    shadow: np.ndarray
    doubtful: np.ndarray


def shade_strips(background: Background, mask: np.ndarray, gradient: np.ndarray) -> Strips:
    """Return the strips along the outline of ``mask`` (H, W) that are shadow by their colour, or may be.

    If the object's tint is far from the background's, a shadow is a strip of the background's tint, dimmed, along the object.
    Its edge towards the object is stronger than its edge towards the light, and its light only falls on the way in. A grey
    part of a coloured object has an outline as sharp as the object's, as has the shadow of a very small lamp; or it is
    attached at its end only. (``hard_shadow`` finds shadows by their penumbra where colours do not help.)
    """
    light, tint = background.light, background.tint
    strips = opened(mask & (light > MIN_SHADE) & (light < MOST_LIGHT) & (tint < MOST_TINT), 1)
    core = mask & ~dilated(strips, 1)
    shadow, doubtful = np.zeros(mask.shape, bool), np.zeros(mask.shape, bool)
    if not strips.any() or core.sum() < LEAST_CORE * mask.sum():
        return Strips(shadow, doubtful)
    own = float(np.percentile(tint[core], 15))
    if own < OWN_TINT:
        return Strips(shadow, doubtful)
    core_depth = float(cv2.distanceTransform(core.astype(np.uint8), cv2.DIST_L2, 5).max())
    sharp = cv2.dilate(gradient, disk(4))
    contrast = length(background.residual)
    falling = falls_inward(light, ~mask)
    own_px = _outline_width_px(contrast, mask, sharp, strips)
    count, labels = cv2.connectedComponents(strips.astype(np.uint8), connectivity=4)
    for index in range(1, count):
        strip = labels == index
        rim = dilated(strip, 3) & ~strip
        to_thing, to_light = rim & mask, rim & ~mask
        attached = to_thing.sum() / max(int(rim.sum()), 1)
        if strip.sum() < LEAST_SHARE * mask.sum() or not LEAST_ATTACHED < attached < MOST_ATTACHED:
            continue
        inner = eroded(strip, 1)
        light_edge = np.array(np.median(sharp[to_light]))
        width_px = edge_width_px(np.median(contrast[inner if inner.any() else strip]), light_edge)
        depth = float(cv2.distanceTransform(strip.astype(np.uint8), cv2.DIST_L2, 5).max())
        if (
            own > OWN_TIMES * float(np.median(tint[strip]))
            and np.percentile(sharp[to_thing], 25) > LEAST_EDGE * light_edge
            and width_px > LEAST_WIDTH_PX
            and falling[strip].mean() > LEAST_FALLING
            and depth < MOST_DEPTH * core_depth
        ):
            (shadow if width_px > WIDER * own_px else doubtful)[strip] = True
    return Strips(shadow, doubtful)


def _outline_width_px(contrast: np.ndarray, mask: np.ndarray, sharp: np.ndarray, strips: np.ndarray) -> float:
    """Return the blur width in pixels of the outline of ``mask`` away from ``strips``."""
    inner = eroded(mask, 4)
    outline = mask & ~eroded(mask, 1) & ~dilated(strips, 8)
    if not outline.any() or not inner.any():
        return np.inf
    nearest = ndimage.distance_transform_edt(~inner, return_distances=False, return_indices=True)
    widths = edge_width_px(contrast[nearest[0], nearest[1]], sharp)
    return float(np.percentile(widths[outline], 25))
