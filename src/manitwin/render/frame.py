"""A picture with depth, and how it is made from one with more pixels."""

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
    covers; ``depth (H, W) float32``, that of the surface along the viewing axis in the object's unit, 0 where the object
    covers less than half a pixel.
    """

    rgb: np.ndarray
    coverage: np.ndarray
    depth: np.ndarray


def reduced_frame(
    color: np.ndarray,
    buffer: np.ndarray,
    *,
    nearest: float,
    farthest: float,
    background: tuple[int, int, int],
    supersample: int,
    radius: float,
) -> Frame:
    """Reduce a picture ``supersample`` times each way.

    ``color (H, W, 4) uint8`` is black and transparent where nothing is; ``buffer (H, W) float32`` is the depth buffer,
    linear in 1/depth from 0 at ``nearest`` to 1 at ``farthest``, and 1 where nothing is; ``radius`` is that of the
    object. Colours are averaged over the background; 1/depth is linear over the picture of a plane, so its mean over
    what is covered is the inverse depth at the pixel's centre.
    """
    size = (color.shape[1] // supersample, color.shape[0] // supersample)
    coverage = _averaged(cv2.extractChannel(color, 3).astype(np.float32), size) / np.float32(255)
    empty = np.float32(1) - coverage
    seen = coverage >= 0.5
    nearness = np.float32(1 / nearest) + _averaged(buffer, size) * np.float32(1 / farthest - 1 / nearest)
    at_center = np.zeros_like(coverage)
    np.divide(coverage, nearness - empty * np.float32(1 / farthest), out=at_center, where=seen)
    lit = _averaged(color, size)[..., :3] * depth_shade(at_center, seen, radius)[..., None]
    rgb = lit + empty[..., None] * np.array(background, dtype=np.float32)
    return Frame(np.rint(np.minimum(rgb, 255)).astype(np.uint8), coverage, at_center)


def _averaged(image: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


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
