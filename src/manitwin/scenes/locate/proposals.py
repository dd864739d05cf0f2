"""Object proposals without masks: segments above the dominant plane, separated at depth jumps."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from manitwin.errors import UsageError
from manitwin.scenes.locate.depth_view import DepthView, known_depth, measured_noise_m

LEAST_PX, MOST_PROPOSALS = 150, 16
_FITTED, _TRIED, _PLANES = 4000, 200, 3
_NEAR_M, _ABOVE_M, _BELOW_M, _JUMP_M = 0.004, 0.007, 0.5, 0.007
"""Metres: plane inliers; least height above the table; largest height; depth jump between neighbouring pixels."""
_MOST_NOISE_M = 0.01
"""With noisier depths, any plane would fit."""
_LEAST_SHARE = 0.08
"""Least share of all pixels on a table."""
_PARALLEL = np.cos(np.deg2rad(8))
_MEDIAN_PX = 5


@dataclass(frozen=True)
class Plane:
    """The points ``p`` with ``normal @ p = offset_m``; the camera is on the side of the unit ``normal (3,)``."""

    normal: np.ndarray
    offset_m: float

    def height_m(self, points: np.ndarray) -> np.ndarray:
        """Return the heights of points ``(..., 3)`` above the plane."""
        return np.asarray(points @ self.normal - self.offset_m)


def table_plane(view: DepthView, rng: np.random.Generator) -> Plane:
    """Return the support plane: among the largest plane and those parallel to it, the one nearest to the camera.

    RANSAC (Fischler and Bolles 1981), followed by least squares. Raises UsageError if no plane covers 8 % of the picture.
    """
    pixels = np.flatnonzero(known_depth(view))
    if len(pixels) < _FITTED // 10:
        raise UsageError(f"the depth image has only {len(pixels)} known depths; give --mask, or an image with more")
    points = view.points(rng.choice(pixels, min(_FITTED, len(pixels)), replace=False))
    near_m = _NEAR_M + 2 * min(measured_noise_m(view, np.ones(view.depth_m.shape, bool)), _MOST_NOISE_M)
    planes: list[Plane] = []
    left = points
    for _ in range(_PLANES):
        if len(left) < _LEAST_SHARE * len(points):
            break
        plane, within = _largest(left, near_m, rng)
        if within.sum() < _LEAST_SHARE * len(points):
            break
        if not planes or plane.normal @ planes[0].normal > _PARALLEL:
            planes.append(plane)
        left = left[~within]
    if not planes:
        raise UsageError("no plane in the depth image is large enough to be a table; give --mask")
    return max(planes, key=lambda plane: -abs(plane.offset_m))


def proposals(view: DepthView, plane: Plane) -> list[np.ndarray]:
    """Return masks ``(H, W) bool`` of segments above a plane, largest first; touching objects may share one."""
    depth = np.where(np.isfinite(view.depth_m), view.depth_m, 0.0).astype(np.float32)
    smooth = np.asarray(cv2.medianBlur(depth, _MEDIAN_PX)).astype(float)
    known = smooth > 0
    calm = DepthView(smooth, view.intrinsics)
    height = plane.height_m(calm.points(np.arange(smooth.size))).reshape(smooth.shape)
    noise_m = measured_noise_m(view, known)
    above = known & (height > _ABOVE_M + noise_m) & (height < _BELOW_M)
    labels = _segments(smooth, above, _JUMP_M + noise_m)
    counts = np.bincount(labels[above]) if above.any() else np.zeros(0, int)
    order = np.argsort(-counts, kind="stable")[:MOST_PROPOSALS]
    masks = [above & (labels == label) for label in order if counts[label] >= LEAST_PX]
    return [mask for mask in masks if not _cut_by_frame(mask)]


def _segments(depth: np.ndarray, inside: np.ndarray, jump_m: float) -> np.ndarray:
    """Return a segment label ``(H, W)`` for each pixel; neighbours with continuous depth share a segment."""
    numbers = np.arange(depth.size).reshape(depth.shape)
    pairs = []
    for a, b in ((np.s_[:, :-1], np.s_[:, 1:]), (np.s_[:-1], np.s_[1:])):
        joined = inside[a] & inside[b] & (np.abs(depth[a] - depth[b]) < jump_m)
        pairs.append(np.stack([numbers[a][joined], numbers[b][joined]]))
    first, second = np.concatenate(pairs, axis=1)
    graph = coo_matrix((np.ones(len(first), np.int8), (first, second)), shape=(depth.size, depth.size))
    return np.asarray(connected_components(graph, directed=False)[1]).reshape(depth.shape)


def _cut_by_frame(mask: np.ndarray) -> bool:
    """Return whether much of a segment's border is on the picture's border: furniture or backdrop rather than an object."""
    frame = int(mask[0].sum() + mask[-1].sum() + mask[:, 0].sum() + mask[:, -1].sum())
    return frame > np.sqrt(mask.sum())


def _largest(points: np.ndarray, near_m: float, rng: np.random.Generator) -> tuple[Plane, np.ndarray]:
    best: tuple[int, Plane] | None = None
    for _ in range(_TRIED):
        a, b, c = points[rng.choice(len(points), 3, replace=False)]
        plane = _through(np.cross(b - a, c - a), a)
        if plane is not None:
            count = int((np.abs(plane.height_m(points)) < near_m).sum())
            if best is None or count > best[0]:
                best = count, plane
    if best is None:
        raise UsageError("the points of the depth image lie on one line; give --mask")
    within = np.abs(best[1].height_m(points)) < near_m
    mean = points[within].mean(0)
    fitted = _through(np.linalg.svd(points[within] - mean, full_matrices=False)[2][2], mean)
    plane = fitted or best[1]
    return plane, np.abs(plane.height_m(points)) < near_m


def _through(normal: np.ndarray, point: np.ndarray) -> Plane | None:
    length = float(np.linalg.norm(normal))
    if length < 1e-12:
        return None
    normal = normal / length
    offset = float(normal @ point)
    return Plane(-normal, -offset) if offset > 0 else Plane(normal, offset)
