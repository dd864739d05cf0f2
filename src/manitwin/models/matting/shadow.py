"""Cast shadows and gaps: what lies between an object's silhouette and the background, and is background."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.background import Background
from manitwin.models.matting.outline import dilated, eroded, flood, opened

MIN_SHADE, MAX_SHADE = (
    0.25,
    0.985,
)  # ratio of reflected light: darker is no cast shadow of a lit scene, lighter is none at all
MAX_PENUMBRA = 3.5  # L*a*b* units per pixel at working size; cast shadows of the studied photos have 1.5 to 3.3
NEUTRAL = 0.08  # spread of the channels' ratios in a shadow of one light
RISE = 0.05  # of the background's light: what shading and noise add on a way into a shadow
TINTED = 0.25  # the same where a second, coloured light fills the shadow


def light_ratio(background: Background) -> np.ndarray:
    """Return each pixel's linear light (H, W, 3) over that of the expected background."""
    smooth = np.clip(cv2.cvtColor(cv2.GaussianBlur(background.lab, (0, 0), 0.8), cv2.COLOR_LAB2RGB), 0, 1) ** 2.2
    expected = np.clip(cv2.cvtColor(background.expected, cv2.COLOR_LAB2RGB), 0, 1) ** 2.2
    return (smooth + 2e-3) / (expected + 2e-3)


def could_be_shade(background: Background) -> np.ndarray:
    """Return where a photo (H, W) has the background's colour, darkened without tint."""
    ratio = light_ratio(background)
    mean = ratio.mean(2)
    neutral = np.linalg.norm(ratio / mean[..., None] - 1, axis=2) / np.sqrt(3) < NEUTRAL
    return (mean > MIN_SHADE) & (mean < MAX_SHADE) & neutral


def cast_shadow(background: Background, candidate: np.ndarray, gradient: np.ndarray, threshold: float) -> np.ndarray:
    """Return the part of ``candidate`` that is a soft shadow, or the faint glow of light bounced off the object.

    It is darker than the background and reached from outside without crossing an edge that is sharp against those of
    what cannot be a shadow: a third as sharp where the chroma stays (up to the tint of light bounced off the object), an
    eighth where several lights tint the shadow. A glow differs from the background by less than 15 % of what the object does.
    """
    ratio = light_ratio(background)
    darkening = ratio.mean(2)
    tint = ratio / darkening[..., None] - 1
    shady = (darkening > MIN_SHADE) & (darkening < MAX_SHADE)
    tinted = np.linalg.norm(tint, axis=2) / np.sqrt(3)
    certain = opened(candidate & ~(shady & (tinted < TINTED)) & (background.distance > 4), 2)
    edge = _object_edge(certain, candidate, gradient)
    shady &= falls_inward(darkening, ~candidate)
    plain = _without_bounce(tint, ratio[certain]) < NEUTRAL
    softest = gradient < max(threshold, 0.12 * edge)
    soft = (plain & (gradient < max(threshold, min(0.3 * edge, MAX_PENUMBRA)))) | ((tinted < TINTED) & softest)
    outside = ~candidate
    lit = dilated(shady, 3) & (background.distance < 3.5) & dilated(outside, 4)  # the outer flank of a penumbra
    contrast = np.linalg.norm(background.residual, axis=2)
    faint = contrast < 0.15 * (np.median(contrast[certain]) if certain.any() else 0.0)
    glow = faint & softest
    reached = flood(outside | ((shady | lit) & soft) | glow, outside, ball_px=2, regrow_px=4) & candidate
    return reached


def falls_inward(light: np.ndarray, outside: np.ndarray) -> np.ndarray:
    """Return where ``light`` (H, W) only falls on some way in from ``outside``, up to ``RISE``.

    A cast shadow is darkest where it meets what casts it. What is lighter again behind a dark line is an object: its rim,
    or the near wall of a transparent one. Grey reconstruction by dilation (Vincent 1993) gives the best way's darkest pixel.
    """
    smooth = cv2.GaussianBlur(light, (0, 0), 1.0).astype(np.float32)
    darkest = np.where(outside, smooth, 0).astype(np.float32)
    cross = cv2.getStructuringElement(cv2.MORPH_CROSS, (3, 3))
    while True:
        grown = np.where(outside, smooth, np.minimum(cv2.dilate(darkest, cross), smooth))
        if np.array_equal(grown, darkest):
            return np.asarray(smooth - darkest < RISE)
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
    return np.linalg.norm(left, axis=2) / np.sqrt(3)


def _object_edge(certain: np.ndarray, candidate: np.ndarray, gradient: np.ndarray) -> float:
    """Return the typical edge of what is certainly no shadow."""
    if certain.sum() > 0.15 * candidate.sum():
        rim = dilated(certain, 3) & ~eroded(certain, 3)
        return float(np.median(cv2.dilate(gradient, np.ones((7, 7), np.uint8))[rim]))
    return float(np.percentile(gradient[candidate], 85)) if candidate.any() else 0.0


def gaps(background: Background, candidate: np.ndarray, gradient: np.ndarray, threshold: float) -> np.ndarray:
    """Return enclosed regions through which the background is seen: the hole of a ring, the eye of a handle.

    Such a region has the expected colour without bias, or that colour evenly shaded, and its rim has not.
    """
    ratio = light_ratio(background)
    shade = ratio.mean(2)
    even = (shade > 0.55) & (shade < MAX_SHADE) & (np.linalg.norm(ratio / shade[..., None] - 1, axis=2) < 0.12)
    quiet = candidate & (gradient < 4 * threshold) & ((background.distance < 4) | even)
    count, labels, stats, _ = cv2.connectedComponentsWithStats(quiet.astype(np.uint8), connectivity=4)
    found = np.zeros(candidate.shape, bool)
    for index in range(1, count):
        if stats[index, cv2.CC_STAT_AREA] < max(12, 3e-5 * candidate.size):
            continue
        part = labels == index
        residual = np.median(background.residual[part], 0)
        bias = float(np.linalg.norm(residual * [0.7, 1, 1]))
        shaded = stats[index, cv2.CC_STAT_AREA] > 0.01 * candidate.sum() and np.linalg.norm(residual[1:]) < 3
        rim = dilated(part, 4) & ~dilated(part, 1)
        clear = np.percentile(background.distance[rim], 20)
        if (bias < 1.5 and np.median(background.distance[rim]) > 5) or (shaded and clear > 12):
            found |= part
    see_through = even | (background.distance < 4)
    for _ in range(6):  # up to the rim's own edge
        found |= dilated(found, 1) & see_through & candidate
    return found
