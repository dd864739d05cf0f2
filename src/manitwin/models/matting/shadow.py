"""Removal of soft cast shadows and of gaps through which the background is visible from a candidate mask."""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import MAX_SHADE, MIN_SHADE, NEUTRAL, Background, length, total
from manitwin.models.matting.outline import dilated, disk, eroded, flood_region, holds, opened

MAX_PENUMBRA = 3.5  # L*a*b* units per pixel at working size; cast shadows in sample photos have 1.5 to 3.3
MOST_HELD = 0.04  # of a gap's area: a region that encloses more than this is a label with print
CLEARLY = 2.5  # minimum deviation of a gap's rim from the background, relative to that of the gap's colour
SHADED_TINT = 0.03  # spread of the channels' ratios; background seen through synthetic loops has 0.007 to 0.022
SHADED_SLOPE = 1.5  # L*a*b* per pixel: half the steepest gradient of a shadow without an edge
MOSTLY_NARROW = 0.6  # of a region's outline: texture within a shadow does not surround it
WALL_PX = 12  # search radius around a gap for its wall
RISE = 0.05  # of the background's light: rise by shading and noise on a path into a shadow
TINTED = 0.25  # maximum tint of a shadow that a second, coloured light fills


def cast_shadow(
    background: Background, candidate: np.ndarray, gradient: np.ndarray, threshold: float, narrow: np.ndarray
) -> np.ndarray:
    """Return the part of ``candidate`` that is a soft shadow, or the faint glow of light bounced off the object.

    A shadow is darker than the background, and it is reached from outside without crossing a sharp edge. The limit is
    relative to the edges of pixels that are certainly object: a third where the chroma stays (up to the tint of bounced
    light), an eighth where several lights tint the shadow. A glow differs from the background by less than 15 % of the
    object's contrast. Neither is bounded by edges as ``narrow`` as the photo's own, as a pale cap or a grey handle is.
    """
    ratio, darkening = background.light_ratio, background.light
    tint = ratio / darkening[..., None] - 1
    shady = (darkening > MIN_SHADE) & (darkening < MAX_SHADE)
    tinted = background.tint
    certain = opened(candidate & ~(shady & (tinted < TINTED)) & (background.distance > 4), 2)
    edge = _object_edge(certain, candidate, gradient)
    shady &= falls_inward(darkening, ~candidate)
    plain = _without_bounce(tint, ratio[certain]) < NEUTRAL
    softest = gradient < max(threshold, 0.12 * edge)
    soft = (plain & (gradient < max(threshold, min(0.3 * edge, MAX_PENUMBRA)))) | ((tinted < TINTED) & softest)
    outside = ~candidate
    lit = dilated(shady, 3) & (background.distance < 3.5) & dilated(outside, 4)  # outer flank of a penumbra
    contrast = length(background.residual)
    faint = contrast < 0.15 * (np.median(contrast[certain]) if certain.any() else 0.0)
    glow = faint & softest
    free = outside | ((shady | lit) & soft) | glow
    reached, held = (flood_region(let, outside, ball_px=2, regrow_px=4) & candidate for let in (free, free & ~narrow))
    return reached & ~_sharply_bounded(opened(reached & ~held, 2), outside | held, narrow)


def _sharply_bounded(regions: np.ndarray, outside: np.ndarray, narrow: np.ndarray) -> np.ndarray:
    """Return those ``regions`` whose outline towards the ``outside`` lies mostly on ``narrow`` edges."""
    near_narrow = dilated(narrow, 3)
    count, labels = cv2.connectedComponents(regions.astype(np.uint8), connectivity=4)
    found = np.zeros(regions.shape, bool)
    for index in range(1, count):
        part = labels == index
        outline = dilated(part, 3) & outside
        if not outline.any() or near_narrow[outline].mean() > MOSTLY_NARROW:
            found |= dilated(part, 2) & ~outside
    return found


def falls_inward(light: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """Return where ``light`` (H, W) decreases monotonically, within ``RISE``, along some path from ``outside``.

    A cast shadow is darkest where it meets the object. A region that is lighter again behind a dark line is object: its rim,
    or the near wall of a transparent one. Grey-scale reconstruction by dilation (Vincent 1993) gives the darkest pixel of the
    best path.
    """
    smooth = cv2.GaussianBlur(light, (0, 0), 1.0).astype(np.float32)
    rows, columns = np.nonzero(~outside)
    if not len(rows):
        return np.ones(light.shape, bool)
    box = np.s_[max(0, rows.min() - 2) : rows.max() + 3, max(0, columns.min() - 2) : columns.max() + 3]
    near, free = smooth[box], np.where(outside[box], smooth[box], 0).astype(np.float32)
    darkest, cross = free, cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    falling = np.ones(light.shape, bool)
    while True:
        grown = darkest
        for _ in range(8):
            grown = np.maximum(np.minimum(cv2.dilate(grown, cross), near), free)
        if np.array_equal(grown, darkest):
            falling[box] = near - darkest < RISE
            return falling
        darkest = grown


def _without_bounce(tint: np.ndarray, object_ratio: np.ndarray) -> np.ndarray:
    """Return the magnitude of a tint without its component towards the object's own tint."""
    left = tint
    if len(object_ratio):
        own = np.median(object_ratio, axis=0)
        own = own - own.mean()
        size = float(np.linalg.norm(own))
        if size > 0.1:
            along = np.maximum(tint @ (own / size), 0)
            left = tint - along[..., None] * (own / size)
    return length(left) / np.sqrt(3)


def _object_edge(certain: np.ndarray, candidate: np.ndarray, gradient: np.ndarray) -> float:
    """Return the typical gradient along the edge of pixels that are certainly no shadow."""
    if certain.sum() > 0.15 * candidate.sum():
        rim = dilated(certain, 3) & ~eroded(certain, 3)
        return float(np.median(cv2.dilate(gradient, np.ones((7, 7), np.uint8))[rim]))
    return float(np.percentile(gradient[candidate], 85)) if candidate.any() else 0.0


def gaps(background: Background, candidate: np.ndarray, gradient: np.ndarray, threshold: float) -> np.ndarray:
    """Return enclosed regions through which the background is visible, such as the hole of a ring or the eye of a handle.

    Such a region has the expected background colour, possibly evenly shaded; no more texture than the border (or than a
    shadow with the background's tint); and a rim that clearly differs from both.
    """
    shade, tint = background.light, background.tint
    even = (shade > 0.45) & (shade < MAX_SHADE) & (tint < 0.12)
    quiet = candidate & (gradient < 4 * threshold) & ((background.distance < 4) | even)
    outside = eroded(~candidate, 2)
    contrast = length(background.residual)
    usual = float(np.median(gradient[background.border])) + threshold
    count, labels, stats, _ = cv2.connectedComponentsWithStats(quiet.astype(np.uint8), connectivity=4)
    found = np.zeros(candidate.shape, bool)
    for index in range(1, count):
        left, top, width, height, area = stats[index]
        if area < max(12, 3e-5 * candidate.size):
            continue
        box = np.s_[max(0, top - 5) : top + height + 5, max(0, left - 5) : left + width + 5]
        part = labels[box] == index
        residual = np.median(background.residual[box][part], 0)
        bias = float(np.linalg.norm(residual * [0.7, 1, 1]))
        rim = dilated(part, 4) & ~dilated(part, 1)
        rim_contrast = contrast[box][rim]
        inner = eroded(part, 2)
        drawn = float(np.percentile(gradient[box][inner], 75)) if inner.any() else 0.0
        quietly = drawn < usual or (drawn < SHADED_SLOPE and float(np.percentile(tint[box][part], 75)) < SHADED_TINT)
        own = max(1.5, 0.8 * background.noise_lab)
        clear = float(np.percentile(rim_contrast, 25))
        same = bias < own and np.median(rim_contrast) > CLEARLY * max(own, bias)
        shaded = residual[0] < own and np.hypot(*residual[1:]) < own + 1.5 and clear > CLEARLY * max(own, bias)
        distant = background.distance[box][rim]
        if not _is_walled(background.lab, outside, labels == index, own):
            continue
        certain = (bias < 1.5 and np.median(distant) > 5) or (
            area > 0.01 * candidate.sum() and np.hypot(*residual[1:]) < 3 and np.percentile(distant, 20) > 12
        )
        if certain or (
            quietly and holds(part) < MOST_HELD * area and (same or (shaded and area > 4e-4 * candidate.size))
        ):
            found[box] |= part
    see_through = even | (background.distance < 4)
    for _ in range(6):  # grow to the edge of the rim
        found |= dilated(found, 1) & see_through & candidate
    return found


def _is_walled(lab: np.ndarray, outside: np.ndarray, region: np.ndarray, noise_lab: float) -> bool:
    """Tell whether a region is surrounded by colours that are no mixture of its own colour and that of the background beside it.

    A true gap is separated from the outer background by the object. A grey body, or a body that the colour surfaces took for
    background, has only its own blurred edge there, whose colours lie on the line between its own and the background's.
    """
    rows, columns = np.nonzero(region)
    box = np.s_[
        max(0, rows.min() - WALL_PX) : rows.max() + WALL_PX + 1,
        max(0, columns.min() - WALL_PX) : columns.max() + WALL_PX + 1,
    ]
    part, beyond = region[box], outside[box]
    if not beyond.any():
        return True
    filled = part | (cv2.morphologyEx(part.astype(np.uint8), cv2.MORPH_CLOSE, disk(2)) > 0)
    inner = eroded(part, 2)
    inner = inner if inner.any() else part
    own, ground = (
        lab[box][tuple(ndimage.distance_transform_edt(~of, return_distances=False, return_indices=True))]
        for of in (inner, beyond)
    )
    step = ground - own
    offset = lab[box] - own
    share = np.clip(total(offset * step) / np.maximum(total(step**2), 1e-6), 0, 1)
    off = np.where(part | beyond, 0, length(cv2.GaussianBlur(offset - share[..., None] * step, (0, 0), 0.8)))
    near = dilated(filled, WALL_PX // 2)
    wall = cv2.dilate(np.where(near, off, 0).astype(np.float32), disk(WALL_PX // 2))
    outline = filled & ~eroded(filled, 1)
    return float(np.percentile(wall[outline], 20)) > CLEARLY * noise_lab
