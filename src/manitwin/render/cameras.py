"""Pinhole cameras around an object, and projection of points.

Camera frame (OpenGL): x right, y up, looking along -z. Pixel coordinates: x right, y down, with the centre of the upper left
pixel at (0.5, 0.5).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import cv2
import numpy as np

from manitwin.geometry.poses import inverse, transform_points

OPENGL_TO_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenGL's camera frame (x right, y up, looking along -z) to OpenCV's (x right, y down, looking along +z), and vice versa."""

# Eight views, one every 45 degrees of azimuth: four from the height of a person looking at a table, two from well above (into
# cavities) and two from below, on opposite sides, so that most surface is seen more than once.
ORBIT_ELEVATIONS_DEG = (20.0, 50.0, 20.0, -35.0, 20.0, 65.0, 20.0, -35.0)
ORBIT_FIRST_AZIMUTH_DEG = -60.0
ORBIT_ASPECTS = (1.0, 1.62, 2.62, 4.24)
"""Aspect ratios of the views, close enough that an object fills 60 % of both sides, up to a ratio of 1 : 6."""
HERO_ELEVATION_DEG, HERO_FLAT_ELEVATION_DEG = 26.0, 50.0
FLAT = 0.3  # ratio of height to the longer side of the footprint, below which an object lies rather than stands
HERO_AZIMUTHS_DEG = np.arange(-60.0, 300.0, 30.0)
HERO_FRONT_AZIMUTHS_DEG = np.array([-60.0, -90.0, -120.0])  # about -Y, the front of an object made from a photo or text
FILL = 0.88  # largest share of the image's half width for the silhouette


@dataclass(frozen=True)
class Camera:
    """A pinhole camera with square pixels and its principal point at the image centre.

    ``camera_to_object`` is ``(4, 4)``, with OpenGL axes and translation in the object's unit of length; ``fov_y_rad`` is the
    full vertical field of view.
    """

    camera_to_object: np.ndarray
    fov_y_rad: float
    width_px: int
    height_px: int

    @property
    def focal_px(self) -> float:
        """The focal length in pixels, for both axes."""
        return self.height_px / 2 / float(np.tan(self.fov_y_rad / 2))

    @property
    def position(self) -> np.ndarray:
        """The projection centre ``(3,)`` in the object frame."""
        return self.camera_to_object[:3, 3]

    def scaled(self, factor: float) -> Camera:
        """Return the camera with the same image of the object scaled by ``factor`` about its origin."""
        pose = self.camera_to_object.copy()
        pose[:3, 3] *= factor
        return Camera(pose, self.fov_y_rad, self.width_px, self.height_px)

    def resized(self, width_px: int, height_px: int) -> Camera:
        """Return the same camera with another image size; the vertical field of view is kept."""
        return Camera(self.camera_to_object, self.fov_y_rad, width_px, height_px)

    def to_json(self) -> dict[str, Any]:
        """Return the camera as JSON values, for ``from_json``."""
        return {
            "camera_to_object": self.camera_to_object.tolist(),
            "fov_y_rad": self.fov_y_rad,
            "width_px": self.width_px,
            "height_px": self.height_px,
        }

    @classmethod
    def from_json(cls, value: dict[str, Any]) -> Camera:
        """Create a camera from the values of ``to_json``."""
        pose = np.array(value["camera_to_object"], dtype=float)
        return cls(pose, value["fov_y_rad"], value["width_px"], value["height_px"])


def sapien_axes(camera: Camera) -> np.ndarray:
    """Return the rotation ``(3, 3)`` from SAPIEN's camera frame (x forward, y left, z up) to the object frame."""
    right, up, backward = camera.camera_to_object[:3, :3].T
    return np.stack([-backward, -right, up], 1)


def look_at(eye: np.ndarray, target: np.ndarray) -> np.ndarray:
    """Return ``camera_to_object (4, 4)`` of a camera at ``eye`` that looks at ``target``, with +Z up in the image.

    Looking straight up or down, +Y is up in the image.
    """
    backward = np.asarray(eye, dtype=float) - target
    backward /= np.linalg.norm(backward)
    up = np.array([0.0, 0.0, 1.0]) if abs(backward[2]) < 1 - 1e-9 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, backward)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3, 0], pose[:3, 1], pose[:3, 2], pose[:3, 3] = right, np.cross(backward, right), backward, eye
    return pose


def framing_camera(
    points: np.ndarray, *, azimuth_deg: float, elevation_deg: float, fov_y_deg: float, width_px: int, height_px: int
) -> Camera:
    """Return the camera from a given direction that shows all points ``(N, 3)``, centred and as large as possible.

    Equivariant to scale: points scaled by s give this camera scaled by s.
    """
    azimuth, elevation = np.deg2rad(azimuth_deg), np.deg2rad(elevation_deg)
    backward = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    center = np.array([(along.min() + along.max()) / 2 for along in points.T])
    rotation = look_at(center + backward, center)[:3, :3]
    seen = (points - center) @ rotation
    tangent_y = FILL * np.tan(np.deg2rad(fov_y_deg) / 2)
    tangents = np.array([tangent_y * width_px / height_px, tangent_y])
    # x - cx| <= t (d - z) for all points bounds d and cx from both sides; the least d is where both bounds meet.
    depths = [seen[:, 2] * tangent for tangent in tangents]
    upper, lower = (
        np.array([(seen[:, axis] + depth).max() for axis, depth in enumerate(depths)]),
        np.array([(seen[:, axis] - depth).min() for axis, depth in enumerate(depths)]),
    )
    distance = float(((upper - lower) / (2 * tangents)).max())
    offset = np.append((upper + lower) / 2, distance)
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = rotation, center + rotation @ offset
    return Camera(pose, float(np.deg2rad(fov_y_deg)), width_px, height_px)


def orbit_cameras(
    points: np.ndarray,
    *,
    fov_y_deg: float,
    size_px: int,
    elevations_deg: Sequence[float] = ORBIT_ELEVATIONS_DEG,
    first_azimuth_deg: float = ORBIT_FIRST_AZIMUTH_DEG,
) -> list[Camera]:
    """Return a camera for each elevation around ``points (N, 3)``, at equal steps of azimuth.

    Source: paper, "Physical Property Estimation" (8 multi-view renders); the elevations are this project's choice. The aspect
    ratio of an image is that of the object in it, rounded to one of ``ORBIT_ASPECTS``, with about ``size_px`` squared pixels;
    ``fov_y_deg`` is the field of view along the longer side.
    """
    return [
        _fitted_camera(points, first_azimuth_deg + 360.0 / len(elevations_deg) * i, elevation, fov_y_deg, size_px)
        for i, elevation in enumerate(elevations_deg)
    ]


def _fitted_camera(
    points: np.ndarray, azimuth_deg: float, elevation_deg: float, fov_deg: float, size_px: int
) -> Camera:
    def shaped(width_px: int, height_px: int) -> Camera:
        tangent = np.tan(np.deg2rad(fov_deg) / 2) * height_px / max(width_px, height_px)
        return framing_camera(
            points,
            azimuth_deg=azimuth_deg,
            elevation_deg=elevation_deg,
            fov_y_deg=float(np.rad2deg(2 * np.arctan(tangent))),
            width_px=width_px,
            height_px=height_px,
        )

    square = shaped(size_px, size_px)
    width, height = np.ptp(project(points, square)[0], axis=0)
    aspects = np.array(ORBIT_ASPECTS)
    aspect = float(aspects[np.abs(np.log(aspects) - abs(np.log(width / height))).argmin()])
    if aspect == 1.0:
        return square
    long_px, short_px = (4 * round(size_px * factor / 4) for factor in (aspect**0.5, aspect**-0.5))
    return shaped(long_px, short_px) if width > height else shaped(short_px, long_px)


def hero_camera(
    points: np.ndarray, *, fov_y_deg: float, width_px: int, height_px: int, from_front: bool = False
) -> Camera:
    """Return the camera, among twelve three-quarter views, that shows the object best: the one with the largest silhouette.

    The silhouette is measured in the object's unit. Flat objects are seen from a higher elevation, and their area in the image
    counts as well, which favours the image's diagonal. ``from_front``: only views from -Y, the side that a photo shows of a
    standing object, and from which a lying object is the right way up.
    """
    flat = not is_tall(points)
    elevation = HERO_FLAT_ELEVATION_DEG if flat else HERO_ELEVATION_DEG
    best: tuple[float, Camera] | None = None
    for azimuth in HERO_FRONT_AZIMUTHS_DEG if from_front else HERO_AZIMUTHS_DEG:
        camera = framing_camera(
            points,
            azimuth_deg=float(azimuth),
            elevation_deg=elevation,
            fov_y_deg=fov_y_deg,
            width_px=width_px,
            height_px=height_px,
        )
        seen = (points @ camera.camera_to_object[:3, :2]).astype(np.float32)
        area = cv2.contourArea(cv2.convexHull(seen))
        score = area**2 * silhouette_area_px(points, camera) if flat else area
        if best is None or score > best[0] * 1.02:
            best = score, camera
    assert best is not None
    return best[1]


def is_tall(points: np.ndarray) -> bool:
    """Return whether an object with points ``(N, 3)`` in the object frame is too high to be seen from above."""
    extents = np.ptp(points, axis=0)
    return bool(extents[2] >= FLAT * extents[:2].max())


def silhouette_area_px(points: np.ndarray, camera: Camera) -> float:
    """Return the area in pixels of the convex outline of points ``(N, 3)`` in the image."""
    return float(cv2.contourArea(cv2.convexHull(project(points, camera)[0].astype(np.float32))))


def project(points: np.ndarray, camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Project points ``(N, 3)`` in the object frame.

    Returns pixel coordinates ``(N, 2)`` and depths ``(N,)``, the distance along the viewing axis in the points' unit. Points
    behind the camera have a negative depth and meaningless pixel coordinates.
    """
    seen = transform_points(inverse(camera.camera_to_object), points)
    depth = -seen[:, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = camera.focal_px * seen[:, :2] / depth[:, None] * [1, -1]
    return pixels + np.array([camera.width_px, camera.height_px]) / 2, depth


def pixel_rays(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return the rays through all pixel centres, row by row.

    Origins ``(H*W, 3)`` and directions ``(H*W, 3)``, with a component of 1 along the viewing axis, so that a ray parameter is a
    depth.
    """
    x, y = np.meshgrid(np.arange(camera.width_px) + 0.5, np.arange(camera.height_px) + 0.5)
    seen = np.stack(
        [(x - camera.width_px / 2) / camera.focal_px, -(y - camera.height_px / 2) / camera.focal_px, -np.ones_like(x)],
        -1,
    ).reshape(-1, 3)
    directions = seen @ camera.camera_to_object[:3, :3].T
    return np.broadcast_to(camera.position, directions.shape), directions
