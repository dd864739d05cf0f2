"""Appearance descriptor of an object in a picture: network features and a colour histogram, without the background."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.classifiers.efficientnet_lite import SIDE_PX, features

VERSION = 1
"""Version of the descriptor; vectors of different versions cannot be compared."""
NETWORK, COLORS = 1280, 256
LENGTH = NETWORK + COLORS
COLOR_WEIGHT = 0.3
"""Weight of colours relative to 1 for the network.

Of 0, 0.3, 0.5 and 1 it identifies the most tuning twins in scenes (benchmarks/search.py).
"""
MARGIN = 0.1
"""Margin around the object, as a share of its longer side."""
GREY = 127
"""Background grey: the mean of the network's training data, and the best of the tested backgrounds."""
LEAST_PX = 16
"""Minimum number of pixels of a mask."""
_LIGHTNESS_BINS, _CHROMA_BINS, _CHROMA_REACH = 4, 8, 96.0
_BLUR = np.array([0.107, 0.786, 0.107])
"""Gaussian with a standard deviation of half a bin, so that a colour near the edge of a bin also matches the next bin."""


def appearance_descriptor(rgb: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the descriptor ``(1536,) float32`` of the object ``mask (H, W)``, 0..1, in ``rgb (H, W, 3) uint8``: a unit vector.

    The dot product of two descriptors is (cosine of the network features + 0.3 times the Bhattacharyya coefficient of the
    CIELAB histograms) / 1.3: 1 for the same picture. Raises ValueError for a mask of fewer than 16 pixels, Unavailable
    without the network's weights.
    """
    square, inside = center_object(rgb, mask)
    network = features(square[None])[0, -NETWORK:].astype(np.float64)
    network /= max(float(np.linalg.norm(network)), 1e-9)
    joined = np.concatenate([network, np.sqrt(COLOR_WEIGHT) * color_histogram(square, inside)])
    return (joined / np.sqrt(1 + COLOR_WEIGHT)).astype(np.float32)


def center_object(rgb: np.ndarray, mask: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the object on grey in a square ``(224, 224, 3) uint8``, centred and scaled to fit, and its mask there."""
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
    """Return the square roots ``(256,)`` of a colour histogram with sum 1, so that a dot product is a Bhattacharyya coefficient.

    It has 4 bins of lightness and 8 x 8 bins of chroma, over the pixels well inside the mask, since edge pixels are mixed
    with the background.
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
