"""Silhouettes seen by pinhole cameras: point-in-silhouette tests, and their mutual consistency."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np

FAR_PX = 24.0
"""Maximum distance outside a silhouette that is resolved, in pixels of a ``PinholeSilhouette``; larger ones are set to it."""
RIM_RAYS, MOST_PASSING_PX = 48, 6.0
_STEPS = 40  # samples of a ray through the object's surroundings
_AROUND = 1.15  # times the object's radius estimated from the silhouettes


@dataclass(frozen=True)
class PinholeSilhouette:
    """Signed distance to one silhouette in pixels, positive inside, and the camera that saw it.

    ``distance (H, W) float32`` is that of ``signed_distance``, for a mask whose first pixel is ``box (2,)`` (x, y) of the
    picture. ``matrix (3, 4)`` projects points of the object frame (x to the first photo's right, y away from its camera, z
    up) to homogeneous pixels of the picture; the third coordinate is the depth. ``focal_px`` is the focal length. Pixels are
    those of the scaled picture.
    """

    distance: np.ndarray
    box: np.ndarray
    matrix: np.ndarray
    focal_px: float

    @cached_property
    def corner(self) -> np.ndarray:
        """First pixel (x, y) of the padded ``distance``."""
        return np.asarray(self.box - FAR_PX)

    @cached_property
    def rim(self) -> np.ndarray:
        """Centres ``(N, 2)`` of the pixels along the silhouette's outer border, in the picture."""
        inside = (self.distance > 0).astype(np.uint8)
        lines, _ = cv2.findContours(inside, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
        return np.asarray(max(lines, key=len)[:, 0, :] + self.corner + 0.5, float)

    @cached_property
    def rim_rays(self) -> np.ndarray:
        """Subset ``(RIM_RAYS, 2)`` of ``rim``, spread along it."""
        return np.asarray(self.rim[np.linspace(0, len(self.rim) - 1, RIM_RAYS).astype(int)])

    @cached_property
    def rim_circle(self) -> tuple[np.ndarray, float]:
        """Centre ``(2,)`` of the bounding box of ``rim``, and the maximum distance of the rim from it in pixels."""
        middle = (self.rim.min(axis=0) + self.rim.max(axis=0)) / 2
        return middle, float(np.linalg.norm(self.rim - middle, axis=1).max())

    def with_camera(self, matrix: np.ndarray, focal_px: float) -> PinholeSilhouette:
        """Return the same silhouette with another camera."""
        other = PinholeSilhouette(self.distance, self.box, matrix, focal_px)
        for name in (
            "corner",
            "rim",
            "rim_rays",
            "rim_circle",
        ):  # shared, because the search for a camera tries a thousand poses
            other.__dict__[name] = getattr(self, name)
        return other

    @property
    def position(self) -> np.ndarray:
        """Projection centre ``(3,)``."""
        return np.asarray(-np.linalg.solve(self.matrix[:, :3], self.matrix[:, 3]))

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return columns, rows and depths of points ``(..., 3)``; column and row are 0 for points behind the camera."""
        seen = points @ self.matrix[:, :3].T + self.matrix[:, 3]
        depth = seen[..., 2]
        safe = np.where(depth > 1e-6, depth, np.inf)
        return seen[..., 0] / safe, seen[..., 1] / safe, depth

    def distance_and_pixel_size(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the signed distance of points ``(..., 3)`` inside the silhouette in pixels, and the size of a pixel at each."""
        found, depth = self._sample_distance(points)
        return found, np.maximum(depth, 1e-6) / self.focal_px

    def signed_distance_px(self, points: np.ndarray) -> np.ndarray:
        """Return the signed distance of points ``(..., 3)`` inside the silhouette in pixels."""
        return self._sample_distance(points)[0]

    def _sample_distance(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        column, row, depth = self.project(points)
        flat = column.reshape(1, -1) - self.corner[0] - 0.5, row.reshape(1, -1) - self.corner[1] - 0.5
        found = _interpolate(self.distance, *flat).reshape(column.shape)
        return np.where(depth > 1e-6, found, -FAR_PX), depth

    def rays(self, pixels: np.ndarray) -> np.ndarray:
        """Return the directions ``(N, 3)`` through pixels ``(N, 2)``, scaled to depth 1."""
        return np.asarray(np.linalg.solve(self.matrix[:, :3], np.column_stack([pixels, np.ones(len(pixels))]).T).T)


def _interpolate(image: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Interpolate an image at positions, in slices because OpenCV accepts at most 32,767 columns."""
    size = 1 << 14
    column, row = column.astype(np.float32), row.astype(np.float32)
    parts = [
        cv2.remap(
            image,
            column[:, at : at + size],
            row[:, at : at + size],
            cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=-FAR_PX,
        )
        for at in range(0, column.shape[1], size)
    ]
    return np.concatenate(parts, axis=1) if len(parts) > 1 else parts[0]


def signed_distance(mask: np.ndarray) -> np.ndarray:
    """Return the signed distance of each pixel inside a mask ``(H, W) bool``, padded by ``FAR_PX``.

    Distances outside are limited to ``FAR_PX``.
    """
    padded = np.pad(mask, int(FAR_PX))
    inside = cv2.distanceTransform(padded.astype(np.uint8), cv2.DIST_L2, 5)
    outside = cv2.distanceTransform((~padded).astype(np.uint8), cv2.DIST_L2, 5)
    return np.maximum(np.where(padded, inside - 0.5, 0.5 - outside), -FAR_PX).astype(np.float32)


def bounding_sphere(sights: Sequence[PinholeSilhouette]) -> tuple[np.ndarray, float]:
    """Return a centre ``(3,)`` and a radius that contain the object.

    The centre is the point nearest to the rays through the centres of the silhouettes.
    """
    normal, moment, identity = np.zeros((3, 3)), np.zeros(3), np.eye(3)
    for sight in sights:
        ray = sight.rays(sight.rim_circle[0][None])[0]
        ray /= np.linalg.norm(ray)
        across = identity - np.outer(ray, ray)
        normal += across
        moment += across @ sight.position
    centre = np.linalg.lstsq(normal, moment, rcond=None)[0]
    reach = [sight.rim_circle[1] * max(float(sight.project(centre)[2]), 0) / sight.focal_px for sight in sights]
    return centre, _AROUND * max(reach)


def points_on_rays(own: PinholeSilhouette, pixels: np.ndarray, surroundings: tuple[np.ndarray, float]) -> np.ndarray:
    """Return points ``(N, steps, 3)`` along the rays through pixels ``(N, 2)`` of one silhouette, within ``surroundings``."""
    centre, radius = surroundings
    depth = float(own.project(centre)[2])
    depths = np.linspace(max(depth - radius, 0.05 * depth), depth + radius, _STEPS)
    return np.asarray(own.position + own.rays(pixels)[:, None, :] * depths[None, :, None])


def least_distance_px(sights: Sequence[PinholeSilhouette], number: int, points: np.ndarray) -> np.ndarray:
    """Return the minimum signed distance of points ``(..., 3)`` inside all silhouettes but one, in pixels."""
    least = np.full(points.shape[:-1], FAR_PX, np.float32)
    for other, sight in enumerate(sights):
        if other != number:
            least = np.minimum(least, sight.signed_distance_px(points))
    return least


def mean_ray_miss_px(sights: Sequence[PinholeSilhouette]) -> float:
    """Return the mean distance in pixels by which rays along all silhouettes miss the others' silhouettes.

    Each ray's distance is limited to MOST_PASSING_PX.
    """
    surroundings = bounding_sphere(sights)
    passed = []
    for number, sight in enumerate(sights):
        best = least_distance_px(sights, number, points_on_rays(sight, sight.rim_rays, surroundings)).max(axis=1)
        # the centre of a rim pixel is half a pixel inside the outline
        passed.append(np.clip(0.5 - best, 0.0, MOST_PASSING_PX))
    return float(np.mean(passed))
