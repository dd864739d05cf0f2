"""Outline refinement: a small network over patches estimates the object probability of each pixel near a rough outline.

A patch contains, at two scales, the rough mask and the colours relative to those on both sides of the outline, so that the
network sees an edge independently of its colours. The network is a perceptron with two hidden layers. It was trained on
composites (``benchmarks/train_outline_network.py``) to locate edges that lenses blur, cameras sharpen and JPEG smears, and to
ignore narrow shadows.
"""

from __future__ import annotations

import hashlib
import io
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import cv2
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy import ndimage

from manitwin.models.matting.background import length

WEIGHTS_FILE = "outline_network.npz"
NEAR_PX, AROUND_PX, STEP_PX = 11, 9, 3
"""Side lengths (odd) in pixels of the fine patch and in cells of the coarse patch, and the side of a coarse cell in pixels."""
VALUES = 5
"""Values per patch pixel; one more, the contrast of both sides, is given once per patch."""
AT_ONCE = 1024
ROWS_AT_ONCE = 64
"""Number of patches and of rows processed at a time; a whole photo of 2048 px would take 200 MB."""
LEAST_SHARE = 1e-3
"""Minimum share of a square that must be filled with pixels for their mean to count."""
LEAST_CONTRAST_LAB = 5.0
COLOUR_LAB, LIGHT_LAB, CONTRAST_LAB = 20.0, 25.0, 40.0
"""Scales in L*a*b* units that map to 1 in the network's input."""


def share_near_outline(rgb: np.ndarray, mask: np.ndarray, band_px: int) -> np.ndarray:
    """Return the object probability (H, W) in [0, 1] of each pixel of ``rgb`` (H, W, 3) uint8, near the outline of a rough mask.

    ``mask`` may have any size. Pixels more than ``band_px`` + 1 from its outline keep the mask's value.
    """
    height, width = rgb.shape[:2]
    rough = cv2.resize(mask.astype(np.float32), (width, height), interpolation=cv2.INTER_LINEAR)
    share = np.zeros((height, width), np.float32)
    rows, columns = np.nonzero(rough > 0.5)
    if not len(rows):
        return share
    margin = 6 * band_px + 8
    box = np.s_[
        max(0, rows.min() - margin) : rows.max() + margin + 1,
        max(0, columns.min() - margin) : columns.max() + margin + 1,
    ]
    sides = OutlineColours(rgb[box], rough[box], band_px)
    told = (rough[box] > 0.5).astype(np.float32)
    for top in range(0, len(told), ROWS_AT_ONCE):
        rows, columns = np.nonzero(sides.near[top : top + ROWS_AT_ONCE])
        if len(rows):
            windows = patch_windows(sides, top, min(top + ROWS_AT_ONCE, len(told)))
            for first in range(0, len(rows), AT_ONCE):
                some = np.s_[first : first + AT_ONCE]
                told[top + rows[some], columns[some]] = _evaluate_network(patches(windows, rows[some], columns[some]))
    share[box] = told
    return share


class _Spread:
    """Colours propagated from source pixels to other pixels; only sources that a requested pixel refers to are stored."""

    def __init__(self, nearest: np.ndarray, asked: np.ndarray):
        """Take the flat index ``nearest (H, W)`` int32 of each pixel's source, and the mask ``asked (H, W)`` of pixels."""
        wanted = nearest[asked]
        used = np.zeros(nearest.size, bool)
        used[wanted] = True
        self._places = np.flatnonzero(used).astype(np.int32)
        self._which: np.ndarray = np.zeros(nearest.shape, np.int32)
        self._which[asked] = np.searchsorted(self._places, wanted)
        self._colours = np.zeros((len(self._places), 3), np.float32)

    def take(self, colours: np.ndarray, top: int) -> None:
        """Store the requested ``colours (R, W, 3)`` of the rows from ``top`` on."""
        width = self._which.shape[1]
        first, end = np.searchsorted(self._places, (top * width, (top + len(colours)) * width))
        self._colours[first:end] = colours.reshape(-1, 3)[self._places[first:end] - top * width]

    def rows(self, top: int, end: int) -> np.ndarray:
        """Return the colours (R, W, 3) of the rows from ``top`` to ``end``; arbitrary where none was requested."""
        return self._colours[self._which[top:end]]


class OutlineColours:
    """Colours on both sides of a rough outline, and the patch values derived from them, computed some rows at a time.

    ``near (H, W)`` marks the pixels through which the outline may run. The object's colour is that of the nearest pixels well
    inside, the background's colour is the mean just outside.
    """

    def __init__(self, rgb: np.ndarray, rough: np.ndarray, band_px: int):
        """Take a picture (H, W, 3) uint8, its mask (H, W) float32 at that size, and the maximum error of the outline."""
        self.rough, self._rgb, self._band_px = rough, rgb, band_px
        self.near, inner, outer = _outline_zones(rough > 0.5, band_px)
        self._told_apart = bool(inner.any() and outer.any())
        if not self._told_apart:
            return
        beyond_px = 4 * band_px + 5
        shown = 2 * (AROUND_PX // 2 * STEP_PX + STEP_PX + band_px) + 1
        asked = cv2.dilate(self.near.astype(np.uint8), np.ones((shown, shown), np.uint8)) > 0
        self._inside = _Spread(_nearest(inner), asked)
        self._beyond = _Spread(_nearest(_share_of(outer, beyond_px) > LEAST_SHARE), asked)
        for top in range(0, len(rough), ROWS_AT_ONCE):
            end = min(top + ROWS_AT_ONCE, len(rough))
            self._inside.take(self._mean_of(inner, 3, top, end), top)
            self._beyond.take(self._mean_of(outer, beyond_px, top, end), top)

    def _mean_of(self, used: np.ndarray, side_px: int, top: int, end: int) -> np.ndarray:
        """Return the mean colour (R, W, 3) of ``used`` pixels (H, W) in a square around each pixel of rows ``top`` to ``end``.

        The result is near black where the square contains no used pixel.
        """
        first = max(0, top - side_px // 2)
        some = used[first : end + side_px // 2]
        total = self._lab(first, end + side_px // 2) * some[..., None]
        total = cv2.blur(total, (side_px, side_px), dst=total)
        total /= np.maximum(_share_of(some, side_px), 1e-6)[..., None]
        return np.asarray(total[top - first :][: end - top])

    def _lab(self, top: int, end: int) -> np.ndarray:
        """Return the L*a*b* colours (R, W, 3) float32 of the rows from ``top`` to ``end``."""
        scaled = self._rgb[top:end].astype(np.float32)
        scaled /= 255
        return cv2.cvtColor(scaled, cv2.COLOR_RGB2LAB)

    def values(self, top: int, end: int) -> np.ndarray:
        """Return the values (R, W, VALUES + 1) float32 of the rows from ``top`` to ``end``.

        They are the mask; the position of the colour on the line from the background's to the object's colour, and its
        distance from that line; its lightness relative to the background, and its distance from the background in hue and
        chroma; and the contrast of both sides. Each is shifted to be centred near zero, as a perceptron expects.
        """
        values = np.zeros((end - top, self.rough.shape[1], VALUES + 1), np.float32)
        values[..., 0] = self.rough[top:end] - 0.5
        if not self._told_apart:
            return values
        first = max(0, top - self._band_px)
        own = self._inside.rows(first, end + self._band_px)
        own = cv2.blur(own, (2 * self._band_px + 1, 2 * self._band_px + 1))[top - first :][: end - top]
        beyond = self._beyond.rows(top, end)
        step, offset = own - beyond, self._lab(top, end) - beyond
        contrast = length(step)
        along = _sum(offset * step) / np.maximum(contrast**2, LEAST_CONTRAST_LAB**2)
        beside = np.sqrt(np.maximum(_sum(offset**2) - (along * contrast) ** 2, 0))
        values[..., 1] = np.clip(along, -1, 2) - 0.5
        values[..., 2] = np.clip(beside / COLOUR_LAB, 0, 2) - 0.3
        values[..., 3] = np.clip(offset[..., 0] / LIGHT_LAB, -2, 2)
        values[..., 4] = np.clip(np.hypot(offset[..., 1], offset[..., 2]) / COLOUR_LAB, 0, 2) - 0.3
        values[..., 5] = np.clip(contrast / CONTRAST_LAB, 0, 2) - 0.7
        return values


@dataclass(frozen=True)
class PatchWindows:
    """Sliding windows from which patches are cut, as views indexed by the centre pixel.

    ``pixels (H, W, VALUES, NEAR_PX, NEAR_PX)``, ``around (H, W, VALUES, AROUND_PX, AROUND_PX)`` and ``contrast (H, W)``.
    """

    pixels: np.ndarray
    around: np.ndarray
    contrast: np.ndarray


def patch_windows(sides: OutlineColours, top: int, end: int) -> PatchWindows:
    """Return the windows around each pixel of the rows from ``top`` to ``end`` of a picture."""
    reach = AROUND_PX // 2 * STEP_PX + STEP_PX // 2
    first = max(0, top - reach)
    return windows_of(sides.values(first, min(end + reach, len(sides.near))), top - first, end - first)


def windows_of(values: np.ndarray, top: int, end: int) -> PatchWindows:
    """Return the windows around each pixel of the rows from ``top`` to ``end``, given ``values`` (H, W, VALUES + 1)."""
    height, width = values.shape[:2]
    inset = STEP_PX // 2
    reach = AROUND_PX // 2 * STEP_PX + inset
    rows = np.clip(np.arange(top - reach, end + reach), 0, height - 1)
    columns = np.clip(np.arange(-reach, width + reach), 0, width - 1)
    padded = values[rows[:, None], columns, :VALUES]
    off = reach - NEAR_PX // 2
    means = cv2.blur(padded, (STEP_PX, STEP_PX))[inset:-inset, inset:-inset]
    around = _windows(means, (AROUND_PX - 1) * STEP_PX + 1)[..., ::STEP_PX, ::STEP_PX]
    return PatchWindows(_windows(padded, NEAR_PX)[off:-off, off:-off], around, values[top:end, :, VALUES])


def patches(windows: PatchWindows, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return the patches (N, F) float32 around pixels.

    F is the concatenation of ``(VALUES, NEAR_PX, NEAR_PX)`` pixels, ``(VALUES, AROUND_PX, AROUND_PX)`` means of ``STEP_PX``
    squares, and the contrast.
    """
    count = len(rows)
    return np.concatenate(
        [
            windows.pixels[rows, columns].reshape(count, -1),
            windows.around[rows, columns].reshape(count, -1),
            windows.contrast[rows, columns, None],
        ],
        axis=1,
    )


def _windows(padded: np.ndarray, side_px: int) -> np.ndarray:
    """Return the windows (H, W, K, side, side) of a picture (H', W', K), with the rows of each window contiguous in memory."""
    by_value = np.ascontiguousarray(np.moveaxis(padded, 2, 0))
    return np.moveaxis(sliding_window_view(by_value, (side_px, side_px), axis=(1, 2)), 0, 2)


def outline_model() -> str:
    """Return the name of the network in a twin's provenance, with the digest of its file."""
    return f"outline-network sha256:{hashlib.sha256(_weights_file()).hexdigest()[:12]}"


def _evaluate_network(given: np.ndarray) -> np.ndarray:
    """Evaluate the network: return the object probability (N,) in [0, 1] of the centre pixels of ``patches`` (N, F)."""
    layers = _layers()
    for weight, bias in layers[:-1]:
        given = np.maximum(given @ weight + bias, 0)
    weight, bias = layers[-1]
    return np.asarray(1 / (1 + np.exp(-np.clip((given @ weight + bias)[:, 0], -30, 30))), np.float32)


@cache
def _layers() -> list[tuple[np.ndarray, np.ndarray]]:
    with np.load(io.BytesIO(_weights_file())) as arrays:
        count = len(arrays.files) // 2
        return [
            (arrays[f"{place}.weight"].astype(np.float32), arrays[f"{place}.bias"].astype(np.float32))
            for place in range(count)
        ]


def _weights_file() -> bytes:
    return (files("manitwin.models.matting") / WEIGHTS_FILE).read_bytes()


def _share_of(used: np.ndarray, side_px: int) -> np.ndarray:
    """Return the share (H, W) float32 of ``used`` pixels in a square around each pixel."""
    return np.asarray(cv2.blur(used.astype(np.float32), (side_px, side_px)))


def _outline_zones(solid: np.ndarray, band_px: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the masks (H, W) of pixels near the outline, well inside the object, and just outside it."""
    depth = cv2.distanceTransform(solid.astype(np.uint8), cv2.DIST_L2, 5)
    away = cv2.distanceTransform((~solid).astype(np.uint8), cv2.DIST_L2, 5)
    near = (depth <= band_px + 1) & (away <= band_px + 1)
    outer = ~solid & (away > band_px + 1) & (away < 4 * band_px + 6)
    reach = 2 * band_px + 3
    thickest = np.asarray(cv2.dilate(depth, np.ones((reach, reach), np.uint8), dst=away), np.float32)
    np.multiply(thickest, 0.7, out=thickest)
    return near, solid & (depth >= np.minimum(band_px + 1, thickest, out=thickest)), outer


def _nearest(used: np.ndarray) -> np.ndarray:
    """Return for each pixel the flat index (H, W) int32 of the nearest pixel of ``used`` (H, W)."""
    row, column = ndimage.distance_transform_edt(~used, return_distances=False, return_indices=True)
    row *= used.shape[1]
    row += column
    return row.copy()  # frees the array of columns


def _sum(products: np.ndarray) -> np.ndarray:
    """Return the sum (H, W) over three channels (H, W, 3), avoiding numpy's slow reduction of a short axis."""
    return np.asarray(products[..., 0] + products[..., 1] + products[..., 2])
