"""How likely each pixel near a rough outline is object: a small network over patches around it.

A patch shows, at two sizes, the rough mask and the colours as they lie between those on both sides of the outline, so that the
network sees an edge whatever its colours are. It is a perceptron of two hidden layers, which learned from composites of the
project's own (``benchmarks/train_outline_network.py``) where edges lie that lenses blur, cameras sharpen and JPEG smears, and
that a narrow shadow is none.
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
"""Sides of the two patches, odd, and how many pixels one of the second's is wide."""
VALUES = 5
"""Of each pixel of a patch; one more, the contrast of both sides, is asked where the patch is."""
AT_ONCE = 4096
LEAST_CONTRAST_LAB = 5.0
COLOUR_LAB, LIGHT_LAB, CONTRAST_LAB = 20.0, 25.0, 40.0
"""That count as one to the network."""


def share_near_outline(rgb: np.ndarray, mask: np.ndarray, band_px: int) -> np.ndarray:
    """Return how likely each pixel (H, W) of ``rgb`` (H, W, 3) uint8 is object, in [0, 1], by a rough ``mask`` (any size).

    Pixels more than ``band_px`` and one from the mask's outline stay as they are.
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
    values, near = outline_values(rgb[box], rough[box], band_px)
    told = (rough[box] > 0.5).astype(np.float32)
    rows, columns = np.nonzero(near)
    windows = patch_windows(values)
    for first in range(0, len(rows), AT_ONCE):
        some = np.s_[first : first + AT_ONCE]
        told[rows[some], columns[some]] = _answers(patches(windows, rows[some], columns[some]))
    share[box] = told
    return share


def outline_values(rgb: np.ndarray, rough: np.ndarray, band_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Return what patches are made of, (H, W, VALUES + 1) float32, and which pixels (H, W) the outline may run through.

    ``rough`` (H, W) float32 is the mask at the size of ``rgb``. The values: the mask; where the colour lies on the way from the
    ground's to the object's, and how far beside it; how much lighter it is than the ground, and how far from its hue and chroma;
    the contrast of both. The object's colour is that of the nearest pixels well inside, the ground's the mean just outside. Each
    is shifted to lie around zero, as perceptrons want it.
    """
    solid = rough > 0.5
    depth = cv2.distanceTransform(solid.astype(np.uint8), cv2.DIST_L2, 5)
    away = cv2.distanceTransform((~solid).astype(np.uint8), cv2.DIST_L2, 5)
    near = (depth <= band_px + 1) & (away <= band_px + 1)
    values = np.zeros((*solid.shape, VALUES + 1), np.float32)
    values[..., 0] = rough - 0.5
    reach = 2 * band_px + 3
    thickest = cv2.dilate(depth, np.ones((reach, reach), np.uint8))
    inner = solid & (depth >= np.minimum(band_px + 1, 0.7 * thickest))
    outer = ~solid & (away > band_px + 1) & (away < 4 * band_px + 6)
    if not inner.any() or not outer.any():
        return values, near
    lab = cv2.cvtColor(rgb.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)
    own = cv2.blur(_spread(*_mean_of(lab, inner, 3), inner), (2 * band_px + 1, 2 * band_px + 1))
    beyond, known = _mean_of(lab, outer, 4 * band_px + 5)
    beyond = _spread(beyond, known, known)
    step, offset = own - beyond, lab - beyond
    contrast = length(step)
    along = (offset * step).sum(2) / np.maximum(contrast**2, LEAST_CONTRAST_LAB**2)
    beside = np.sqrt(np.maximum((offset**2).sum(2) - (along * contrast) ** 2, 0))
    tint = np.hypot(offset[..., 1], offset[..., 2])
    values[..., 1] = np.clip(along, -1, 2) - 0.5
    values[..., 2] = np.clip(beside / COLOUR_LAB, 0, 2) - 0.3
    values[..., 3] = np.clip(offset[..., 0] / LIGHT_LAB, -2, 2)
    values[..., 4] = np.clip(tint / COLOUR_LAB, 0, 2) - 0.3
    values[..., 5] = np.clip(contrast / CONTRAST_LAB, 0, 2) - 0.7
    return values, near


@dataclass(frozen=True)
class PatchWindows:
    """What patches are cut from, each a view: ``pixels (H, W, VALUES, NEAR_PX, NEAR_PX)``, ``around (H, W, VALUES, AROUND_PX,
    AROUND_PX)`` and ``contrast (H, W)``, by the pixel in their middle."""

    pixels: np.ndarray
    around: np.ndarray
    contrast: np.ndarray


def patch_windows(values: np.ndarray) -> PatchWindows:
    """Return the windows around each pixel of a picture, given its ``outline_values``."""
    reach = AROUND_PX // 2 * STEP_PX
    off = reach - NEAR_PX // 2
    padded = np.pad(values[..., :VALUES], ((reach, reach), (reach, reach), (0, 0)), mode="edge")
    pixels = _windows(padded, NEAR_PX)[off : len(values) + off, off : values.shape[1] + off]
    around = _windows(cv2.blur(padded, (STEP_PX, STEP_PX)), 2 * reach + 1)[..., ::STEP_PX, ::STEP_PX]
    return PatchWindows(pixels, around, values[..., VALUES])


def patches(windows: PatchWindows, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Return the patches (N, F) float32 around pixels.

    First ``(VALUES, NEAR_PX, NEAR_PX)`` pixels, then ``(VALUES, AROUND_PX, AROUND_PX)`` means of ``STEP_PX`` squares, then the
    contrast.
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
    """Return the windows (H, W, K, side, side) of a picture (H', W', K), whose rows lie together in memory."""
    by_value = np.ascontiguousarray(np.moveaxis(padded, 2, 0))
    return np.moveaxis(sliding_window_view(by_value, (side_px, side_px), axis=(1, 2)), 0, 2)


def outline_model() -> str:
    """Return what a twin's provenance calls the network: its file by its digest."""
    return f"outline-network sha256:{hashlib.sha256(_weights_file()).hexdigest()[:12]}"


def _answers(given: np.ndarray) -> np.ndarray:
    """Return how likely the pixel in the middle of each of the ``patches`` (N, F) is object, (N,) in [0, 1]."""
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


def _mean_of(lab: np.ndarray, used: np.ndarray, side_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the mean colour (H, W, 3) of the ``used`` pixels in a square around each, and where there are any."""
    weight = cv2.blur(used.astype(np.float32), (side_px, side_px))
    total = cv2.blur(lab * used[..., None].astype(np.float32), (side_px, side_px))
    return total / np.maximum(weight, 1e-6)[..., None], weight > 1e-3


def _spread(colours: np.ndarray, known: np.ndarray, used: np.ndarray) -> np.ndarray:
    """Return at each pixel the colour (H, W, 3) of the nearest of the ``used`` that is ``known``."""
    at = ndimage.distance_transform_edt(~(used & known), return_distances=False, return_indices=True)
    return np.asarray(colours[at[0], at[1]])
