"""What a thing looks like in a picture, as one vector: a network's features and its colours, without its background."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.classifiers.efficientnet_lite import SIDE_PX, features

VERSION = 1
"""Vectors of another version are of no use beside these."""
NETWORK, COLORS = 1280, 256
LENGTH = NETWORK + COLORS
COLOR_WEIGHT = 0.3
"""Against the network's 1. Of 0, 0.3, 0.5 and 1 it names most of the tuning twins in scenes (benchmarks/search.py)."""
MARGIN = 0.1
"""Of the thing's longer side, around it."""
GREY = 127
"""Behind the thing: the mean of what the network was trained on, and of the kinds of background that were tried the best."""
LEAST_PX = 16
"""A mask of fewer pixels shows nothing."""
_LIGHTNESS_BINS, _CHROMA_BINS, _CHROMA_REACH = 4, 8, 96.0
_BLUR = np.array([0.107, 0.786, 0.107])
"""A Gaussian of half a bin: a colour at the border of a bin is near to those beyond it."""


def look_of(rgb: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the unit vector ``(1536,) float32`` of what ``mask (H, W)``, 0..1, shows of ``rgb (H, W, 3) uint8``.

    Its dot product with another is (cosine of the networks' features + 0.3 times the Bhattacharyya coefficient of the
    histograms in CIELAB) / 1.3: 1 for the same picture. Raises ValueError for a mask of fewer than 16 pixels, Unavailable
    without the network's weights.
    """
    square, inside = centered(rgb, mask)
    network = features(square[None])[0, -NETWORK:].astype(np.float64)
    network /= max(float(np.linalg.norm(network)), 1e-9)
    joined = np.concatenate([network, np.sqrt(COLOR_WEIGHT) * color_histogram(square, inside)])
    return (joined / np.sqrt(1 + COLOR_WEIGHT)).astype(np.float32)


def centered(rgb: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the thing on grey in a square ``(224, 224, 3) uint8``, centred, as large as may be, and its mask there."""
    rows, columns = np.nonzero(mask > 0.5)
    if len(rows) < LEAST_PX:
        raise ValueError(f"a mask of {len(rows)} pixels shows nothing")
    top, left, bottom, right = rows.min(), columns.min(), rows.max() + 1, columns.max() + 1
    side = (1 + 2 * MARGIN) * max(bottom - top, right - left)
    scale = SIDE_PX / side
    move = np.array(
        [
            [scale, 0, SIDE_PX / 2 - scale * (left + right) / 2],
            [0, scale, SIDE_PX / 2 - scale * (top + bottom) / 2],
        ]
    )
    share = mask.astype(np.float32)[..., None]
    bare = rgb * share + GREY * (1 - share)
    way = cv2.INTER_AREA if side > SIDE_PX else cv2.INTER_LINEAR
    square = cv2.warpAffine(
        bare.astype(np.float32),
        move,
        (SIDE_PX, SIDE_PX),
        flags=way,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(GREY, GREY, GREY),
    )
    inside = cv2.warpAffine(share, move, (SIDE_PX, SIDE_PX), flags=cv2.INTER_LINEAR)
    return np.rint(np.clip(square, 0, 255)).astype(np.uint8), inside


def color_histogram(square: np.ndarray, inside: np.ndarray) -> np.ndarray:
    """Return the square roots ``(256,)`` of the shares of colours, whose squares add up to 1.

    Four bins of lightness by 8 x 8 of chroma, over the pixels well inside: edges are mixed with what is behind.
    """
    sure = inside > 0.9
    lab = cv2.cvtColor(square.astype(np.float32) / 255, cv2.COLOR_RGB2LAB)[sure if sure.any() else inside > 0.5]
    chroma = np.clip(lab[:, 1:] / _CHROMA_REACH, -1, 1) / 2 + 0.5
    places = np.column_stack([np.clip(lab[:, :1] / 100, 0, 1), chroma])
    bins = (_LIGHTNESS_BINS, _CHROMA_BINS, _CHROMA_BINS)
    counts, _ = np.histogramdd(places, bins=bins, range=[(0, 1)] * 3)
    for axis in range(3):
        counts = np.apply_along_axis(lambda row: np.convolve(row, _BLUR, mode="same"), axis, counts)
    return np.asarray(np.sqrt(counts / counts.sum()).ravel())
