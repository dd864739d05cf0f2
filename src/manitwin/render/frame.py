"""A picture with depth and part ids, and how it is made from one with more pixels."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

DARKENING_RADIUS = 0.035  # of the picture's height: how far a nearer surface throws its soft shade
DARKENING_STRENGTH = 2.6
DARKENING_MOST = 0.55


@dataclass(frozen=True)
class Frame:
    """A picture of size (H, W).

    ``rgb (H, W, 3) uint8`` over the background; ``coverage (H, W) float32``, the share of each pixel that the object
    covers; ``ids (H, W) int32``, the index of the part at the pixel's centre, -1 for none; ``depth (H, W) float32``
    there along the viewing axis in the object's unit, 0 where ids is -1.
    """

    rgb: np.ndarray
    coverage: np.ndarray
    ids: np.ndarray
    depth: np.ndarray


def reduced_frame(
    color: np.ndarray,
    part: np.ndarray,
    depth: np.ndarray,
    *,
    background: tuple[int, int, int],
    supersample: int,
    radius: float,
) -> Frame:
    """Reduce a picture ``supersample`` times each way.

    ``color (H, W, 3) float32`` in [0, 1], ``part (H, W)`` with -1 for none, ``depth (H, W)``; ``radius`` is that of the
    object. Colours are averaged over the background; 1/depth is linear over the picture of a plane, so the harmonic
    mean of the subpixels of one part is its depth at the pixel's centre.
    """
    k = supersample
    height, width = part.shape[0] // k, part.shape[1] // k
    seen = part >= 0
    ids = part[k // 2 :: k, k // 2 :: k].copy()
    count, inverse_sum = np.zeros(ids.shape), np.zeros(ids.shape)
    for row in range(k):
        for column in range(k):
            same = (part[row::k, column::k] == ids) & (ids >= 0)
            count += same
            inverse_sum += same / depth[row::k, column::k]
    at_center = (count / np.where(ids >= 0, inverse_sum, 1.0)).astype(np.float32)
    coverage = cv2.resize(seen.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
    lit = np.where(seen[..., None], color, np.float32(0.0))
    lit = cv2.resize(lit, (width, height), interpolation=cv2.INTER_AREA)
    lit *= depth_shade(at_center, ids >= 0, radius)[..., None]
    rgb = lit + (1 - coverage)[..., None] * (np.array(background, dtype=np.float32) / 255)
    return Frame(np.rint(np.clip(rgb, 0, 1) * 255).astype(np.uint8), coverage, ids, at_center)


def depth_shade(depth: np.ndarray, seen: np.ndarray, radius: float) -> np.ndarray:
    """Return a factor ``(H, W) float32`` that darkens what lies behind its surroundings: cavities, contacts, overlaps.

    Stands for the occluded ambient light that a rasteriser lacks. Source: Luft, Colditz, Deussen 2006, "Image
    enhancement by unsharp masking the depth buffer", eq. 1-3 (depth darkening); the background takes no part in the
    blur.
    """
    sigma = DARKENING_RADIUS * depth.shape[0]
    weight = seen.astype(np.float32)
    # A quarter of the size: the blur is wide, and this costs a sixteenth.
    size = (max(1, depth.shape[1] // 4), max(1, depth.shape[0] // 4))
    small = [cv2.resize(image, size, interpolation=cv2.INTER_AREA) for image in (depth * weight, weight)]
    blurred, share = (cv2.GaussianBlur(image, (0, 0), sigma / 4) for image in small)
    around = cv2.resize(blurred / np.maximum(share, 1e-6), depth.shape[::-1], interpolation=cv2.INTER_LINEAR)
    behind = np.maximum(depth - around, 0.0) / radius
    return np.where(seen, 1 - np.minimum(DARKENING_STRENGTH * behind, DARKENING_MOST), 1.0).astype(np.float32)
