"""Cast shadows and gaps: what lies between an object's silhouette and the background, and is background."""

from __future__ import annotations

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.matting.background import MAX_SHADE, MIN_SHADE, NEUTRAL, Background, length, total
from manitwin.models.matting.outline import dilated, disk, eroded, flood, holds, opened

MAX_PENUMBRA = 3.5  # L*a*b* units per pixel at working size; cast shadows of the studied photos have 1.5 to 3.3
MOST_HELD = 0.04  # of a gap: what encloses a print is a label
CLEARLY = 2.5  # times what a gap's colour is off the background's: its rim is off by as much at least
SHADED_TINT = 0.03  # spread of the channels' ratios; of ground seen through made loops 0.007 to 0.022
SHADED_SLOPE = 1.5  # L*a*b* per pixel: half the steepest of a shadow without an edge
MOSTLY_NARROW = 0.6  # of a region's outline: drawing within a shadow does not go all around
WALL_PX = 12  # as far about a gap its wall is looked for
RISE = 0.05  # of the background's light: what shading and noise add on a way into a shadow
TINTED = 0.25  # the same where a second, coloured light fills the shadow


def cast_shadow(
    background: Background, candidate: np.ndarray, gradient: np.ndarray, threshold: float, narrow: np.ndarray
) -> np.ndarray:
    """Return the part of ``candidate`` that is a soft shadow, or the faint glow of light bounced off the object.

    It is darker than the background and reached from outside without crossing an edge that is sharp against those of
    what cannot be a shadow: a third as sharp where the chroma stays (up to the tint of light bounced off the object), an
    eighth where several lights tint the shadow. A glow differs from the background by less than 15 % of what the object does.
    Neither is bounded by an edge that is as ``narrow`` as the photo's own: a pale cap or a grey handle is.
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
    lit = dilated(shady, 3) & (background.distance < 3.5) & dilated(outside, 4)  # the outer flank of a penumbra
    contrast = length(background.residual)
    faint = contrast < 0.15 * (np.median(contrast[certain]) if certain.any() else 0.0)
    glow = faint & softest
    free = outside | ((shady | lit) & soft) | glow
    reached, held = (flood(let, outside, ball_px=2, regrow_px=4) & candidate for let in (free, free & ~narrow))
    return reached & ~_bounded(opened(reached & ~held, 2), outside | held, narrow)


def _bounded(regions: np.ndarray, outside: np.ndarray, narrow: np.ndarray) -> np.ndarray:
    """Return those ``regions`` that have mostly ``narrow`` edges towards the ``outside``."""
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
    """Return where ``light`` (H, W) only falls on some way in from ``outside``, up to ``RISE``.

    A cast shadow is darkest where it meets what casts it. What is lighter again behind a dark line is an object: its rim,
    or the near wall of a transparent one. Grey reconstruction by dilation (Vincent 1993) gives the best way's darkest pixel.
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
    """Return the size of a tint less what goes towards the object's own tint."""
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
    """Return the typical edge of what is certainly no shadow."""
    if certain.sum() > 0.15 * candidate.sum():
        rim = dilated(certain, 3) & ~eroded(certain, 3)
        return float(np.median(cv2.dilate(gradient, np.ones((7, 7), np.uint8))[rim]))
    return float(np.percentile(gradient[candidate], 85)) if candidate.any() else 0.0


def gaps(background: Background, candidate: np.ndarray, gradient: np.ndarray, threshold: float) -> np.ndarray:
    """Return enclosed regions through which the background is seen: the hole of a ring, the eye of a handle.

    Such a region has the expected colour, or that colour evenly shaded, no more drawing than the border has (or no more than a
    shadow of the ground's own tint), and a rim that differs from both clearly.
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
        if not _walled(background.lab, outside, labels == index, own):
            continue
        certain = (bias < 1.5 and np.median(distant) > 5) or (
            area > 0.01 * candidate.sum() and np.hypot(*residual[1:]) < 3 and np.percentile(distant, 20) > 12
        )
        if certain or (
            quietly and holds(part) < MOST_HELD * area and (same or (shaded and area > 4e-4 * candidate.size))
        ):
            found[box] |= part
    see_through = even | (background.distance < 4)
    for _ in range(6):  # up to the rim's own edge
        found |= dilated(found, 1) & see_through & candidate
    return found


def _walled(lab: np.ndarray, outside: np.ndarray, region: np.ndarray, noise_lab: float) -> bool:
    """Return whether colours that are no mixture of a region's own and the background's beside it surround the region.

    Through a ring the ground is seen with the ring between it and the ground around; a grey body, or one that the surfaces took
    for ground, has nothing but its own blurred edge there, whose colours go straight from its own to the background's.
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
