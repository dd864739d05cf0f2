"""Second opinion on the object mask, from colours alone, with another initialization and at a coarser scale.

It shares no model with ``segmentation``: Gaussian mixtures of the photo's own colours (GrabCut: Rother, Kolmogorov, Blake
2004) replace smooth surfaces and flooding, and shaded versions of the background's colours replace tests of shadow edges. The
two methods therefore fail in different places.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from manitwin.models.matting.background import border_ring, length
from manitwin.models.matting.outline import dilated, eroded

SIDE_PX = 288
SHADES = (0.82, 0.64, 0.46)  # shares of the background's linear light that remain in shadows of a lit scene
CLOSER = 1.3  # minimum gain in resolution for a second pass
MARGIN = 0.15  # of the object's longer side: margin around it in the second pass
BLURRED_PX = 4  # at ``SIDE_PX``: maximum error of the first pass's outline
LEAST_PIXELS = 30
SECTORS, LEAST_SECTORS = 32, 5  # sectors of directions from the picture's centre
NEAR_LAB = 9.0
ROUNDS = 3
WEIGHTS = np.array([0.6, 1, 1], np.float32)  # of L*a*b*: lightness varies more than colour along a background
LEAST_FAR_LAB, MOST_FAR_LAB = 4.0, 9.0  # distance from all border colours at which a pixel starts as object
TEXTURES = 5.0
MOST_SAMPLES = 4000


@dataclass(frozen=True)
class MaskBounds:
    """Lower and upper bound of the object mask, each (H, W).

    ``certain`` has colours of neither the background nor its shade; ``possible`` has all colours but the background's own.
    """

    certain: np.ndarray
    possible: np.ndarray


def colour_opinion(rgb: np.ndarray) -> MaskBounds:
    """Segment ``rgb`` (H, W, 3) uint8 by colour alone at ``SIDE_PX``, and again at a finer scale around a small object.

    The first pass finds the object, the second refines its outline. With shades of the border's colours as background,
    shadows are removed, and so are grey parts of the object; without the shades both stay. The object lies between the two
    results.
    """
    far = _segment_by_colour(rgb, SIDE_PX, None)
    box = _around(far.possible)
    if box is None:
        return far
    blurred_px = max(2, round(BLURRED_PX * max(rgb.shape[:2]) / SIDE_PX))
    longest = max(side.stop - side.start for side in box)
    side_px = min(max(rgb.shape[:2]), round(SIDE_PX * max(rgb.shape[:2]) / longest))
    if side_px < CLOSER * min(SIDE_PX, max(rgb.shape[:2])):
        return far
    near = _segment_by_colour(rgb, side_px, box)
    return MaskBounds(
        *(_refine_outline(*looks, blurred_px) for looks in ((far.certain, near.certain), (far.possible, near.possible)))
    )


def _refine_outline(far: np.ndarray, near: np.ndarray, band_px: int) -> np.ndarray:
    """Return the mask (H, W) of the first pass, replaced by that of the finer pass within a band along its outline."""
    along = dilated(far, band_px) & ~eroded(far, band_px)
    return np.asarray(np.where(along, near, far))


def _around(mask: np.ndarray) -> tuple[slice, slice] | None:
    """Return the row and column slices around a mask (H, W) with a margin; None for an empty mask."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return None
    margin = round(MARGIN * max(np.ptp(rows), np.ptp(columns))) + 8
    return (
        slice(max(0, int(rows.min()) - margin), min(mask.shape[0], int(rows.max()) + margin + 1)),
        slice(max(0, int(columns.min()) - margin), min(mask.shape[1], int(columns.max()) + margin + 1)),
    )


def _segment_by_colour(rgb: np.ndarray, side_px: int, box: tuple[slice, slice] | None) -> MaskBounds:
    """Segment ``rgb`` by colour at a given scale, only within ``box`` if it is given."""
    scale = min(1.0, side_px / max(rgb.shape[:2]))
    small = cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = cv2.bilateralFilter(small, 5, 18, 2)
    ring = border_ring(*small.shape[:2])
    lab = _flattened(cv2.cvtColor(small.astype(np.float32) / 255, cv2.COLOR_RGB2LAB), ring)
    texture = float(np.median(length(lab - cv2.GaussianBlur(lab, (0, 0), 4))[ring]))
    far = float(np.clip(TEXTURES * texture, LEAST_FAR_LAB, MOST_FAR_LAB))
    border = _colours_of_background(lab, ring)
    shades = np.concatenate([border, *(_shaded(border, share) for share in SHADES)])
    height, width = ring.shape
    part: tuple[slice, ...] = (slice(None), slice(None))
    if box is not None:
        part = tuple(
            slice(int(side.start * scale), min(n, int(np.ceil(side.stop * scale))))
            for side, n in zip(box, ring.shape, strict=True)
        )
        ring = border_ring(*lab[part].shape[:2])
    masks = []
    for known in (shades, border):
        whole = np.zeros((height, width), np.float32)
        whole[part] = _cut(np.ascontiguousarray(lab[part]), ring, known, far)
        masks.append(cv2.resize(whole, rgb.shape[1::-1], interpolation=cv2.INTER_LINEAR) > 0.5)
    return MaskBounds(*masks)


def _flattened(lab: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Return L*a*b* (H, W, 3) minus the lighting gradient that a quadratic fitted to the border explains."""
    y, x = np.mgrid[-1 : 1 : lab.shape[0] * 1j, -1 : 1 : lab.shape[1] * 1j]
    basis = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], -1)
    used = ring
    for _ in range(3):
        coefficients = np.linalg.lstsq(basis[used], lab[used], rcond=None)[0]
        fit = basis @ coefficients
        off = length(lab - fit)
        used = ring & (off < 2.5 * np.median(off[ring]) + 0.5)
    smooth = off[ring].mean() < 0.7 * length(lab - lab[ring].mean(0))[ring].mean()
    return np.asarray(lab - (fit - fit[ring].mean(0)) if smooth else lab, np.float32)


def _colours_of_background(lab: np.ndarray, ring: np.ndarray) -> np.ndarray:
    """Return the border colours (N, 3) that are seen in many directions, or are near such colours.

    This excludes the colours of an object that touches the border.
    """
    rows, columns = np.nonzero(ring)
    centre = (np.array(ring.shape) - 1) / 2
    bearing = np.arctan2((rows - centre[0]) / ring.shape[0], (columns - centre[1]) / ring.shape[1])
    sector = ((bearing / (2 * np.pi) + 0.5) * SECTORS).astype(int) % SECTORS
    cells, at = _distinct(np.rint(lab[rows, columns] * WEIGHTS / 6).astype(np.int64))
    seen = np.zeros((len(cells), SECTORS), bool)
    seen[at, sector] = True
    wide = seen.sum(1) >= LEAST_SECTORS
    if not wide.any():
        wide[:] = True
    apart = np.linalg.norm(cells[:, None] - cells[wide][None].astype(float), axis=2).min(1) * 6
    kept = (apart < NEAR_LAB)[at]
    return np.asarray(lab[rows[kept], columns[kept]][:: max(1, int(kept.sum()) // MOST_SAMPLES)])


def _distinct(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the distinct rows (M, 3) of ``cells`` (N, 3) int64, sorted, and the index (N,) of each cell's row.

    Values must lie within +-2^19.
    """
    half, bits = 1 << 19, 20
    keys, at = np.unique(
        ((cells[:, 0] + half) << 2 * bits) + ((cells[:, 1] + half) << bits) + cells[:, 2] + half, return_inverse=True
    )
    low = (1 << bits) - 1
    return np.column_stack([keys >> 2 * bits, (keys >> bits) & low, keys & low]) - half, at


def _cut(lab: np.ndarray, ring: np.ndarray, known: np.ndarray, far_lab: float) -> np.ndarray:
    """Segment pixels farther than ``far_lab`` from the ``known`` background colours (N, 3); return the mask (H, W) float32."""
    far = _distance_from(known, lab)
    labels = np.where(far > far_lab, cv2.GC_PR_FGD, cv2.GC_PR_BGD).astype(np.uint8)
    labels[ring & (far < 2 * far_lab)] = cv2.GC_BGD
    if (labels == cv2.GC_PR_FGD).sum() < LEAST_PIXELS or not (labels == cv2.GC_BGD).any():
        return np.zeros(lab.shape[:2], np.float32)
    # rows appended below the picture add the known colours to the background model; only the first touches the picture
    width = lab.shape[1]
    rows = int(np.ceil(len(known) / width))
    lesson = np.resize(known, (rows * width, 3)).reshape(rows, width, 3)
    every = np.concatenate([labels, np.full((rows, width), cv2.GC_BGD, np.uint8)])
    picture = np.clip(np.concatenate([lab, lesson]) * [2.55, 1, 1] + [0, 128, 128], 0, 255).astype(np.uint8)
    cv2.setRNGSeed(1)
    cv2.grabCut(picture, every, (0, 0, 1, 1), np.zeros((1, 65)), np.zeros((1, 65)), ROUNDS, cv2.GC_INIT_WITH_MASK)
    cut = every[: lab.shape[0]]
    return ((cut == cv2.GC_FGD) | (cut == cv2.GC_PR_FGD)).astype(np.float32)


def _shaded(lab: np.ndarray, share: float) -> np.ndarray:
    """Return L*a*b* colours in a share of the light: the cube root of each tristimulus value scales (CIE 1976)."""
    root = share ** (1 / 3)
    return np.asarray(lab * root - np.array([16 * (1 - root), 0, 0], np.float32), np.float32)


def _distance_from(known: np.ndarray, lab: np.ndarray) -> np.ndarray:
    """Return the distance (H, W) of each pixel to the nearest of the ``known`` colours, in L*a*b* with less weight on L*."""
    samples, pixels = known * WEIGHTS, lab * WEIGHTS
    cells, inverse = _distinct(np.rint(samples / 2).astype(np.int64))
    counts = np.bincount(inverse)
    centres = cells[counts >= 3] * np.float32(2) if (counts >= 3).any() else cells * np.float32(2)
    apart, _ = cKDTree(centres).query(pixels.reshape(-1, 3))
    return np.asarray(apart, np.float32).reshape(lab.shape[:2])
