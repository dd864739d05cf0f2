"""Camera model of an object resting on its base: yaw, elevation, roll, perspective, and placement in the photo.

Photo frame: x right, y down, origin at the centre of the object's box, whose longer side is 1. Object frame: Z up, front towards
-Y; for projection the object's box is centred and its half diagonal is 1.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

LEAST_PERSPECTIVE, MOST_PERSPECTIVE = 0.02, 0.55


@dataclass(frozen=True)
class View:
    """A camera: ``yaw_rad`` rotates the object about Z, ``elevation_rad`` is the camera's elevation, ``roll_rad`` rotates the
    image clockwise.

    ``perspective`` is the object's half diagonal over the camera distance; ``scale``, ``x`` and ``y`` place the object in the
    photo frame.
    """

    yaw_rad: float
    elevation_rad: float
    roll_rad: float
    perspective: float
    scale: float = 1.0
    x: float = 0.0
    y: float = 0.0

    @property
    def object_to_camera(self) -> np.ndarray:
        """Rotation ``(3, 3)`` to camera axes: x right, y up, z towards the camera."""
        cos_y, sin_y = np.cos(self.yaw_rad), np.sin(self.yaw_rad)
        cos_e, sin_e = np.cos(self.elevation_rad), np.sin(self.elevation_rad)
        cos_r, sin_r = np.cos(self.roll_rad), np.sin(self.roll_rad)
        turn = np.array([[cos_y, -sin_y, 0.0], [sin_y, cos_y, 0.0], [0.0, 0.0, 1.0]])
        tilt = np.array([[1.0, 0.0, 0.0], [0.0, sin_e, cos_e], [0.0, -cos_e, sin_e]])
        roll = np.array([[cos_r, sin_r, 0.0], [-sin_r, cos_r, 0.0], [0.0, 0.0, 1.0]])
        return roll @ tilt @ turn

    def in_camera(self, points: np.ndarray) -> np.ndarray:
        """Return normalized object points ``(N, 3)`` in camera axes about the object's centre."""
        return np.asarray(points @ self.object_to_camera.T)

    def project(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return photo-frame positions ``(N, 2)`` of normalized object points ``(N, 3)``, and their distances ``(N,)``."""
        seen = self.in_camera(points)
        nearness = 1.0 / (1.0 - self.perspective * seen[:, 2])
        flat = seen[:, :2] * np.array([1.0, -1.0]) * nearness[:, None]
        return self.scale * flat + np.array([self.x, self.y]), 1.0 / self.perspective - seen[:, 2]

    @property
    def camera_position(self) -> np.ndarray:
        """Projection centre ``(3,)`` in normalized object coordinates."""
        return np.asarray(self.object_to_camera[2] / self.perspective)


def normalised(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray, float]:
    """Return vertices ``(V, 3)`` relative to their box's centre in half diagonals, that centre ``(3,)`` and the half diagonal."""
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    center, half = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    return (vertices - center) / half, center, half


def frame_placement(flat: np.ndarray) -> tuple[float, float, float]:
    """Return scale and shift that bring points ``(N, 2)`` into the photo frame: longer side 1, centred."""
    low, high = flat.min(axis=0), flat.max(axis=0)
    scale = 1.0 / float((high - low).max())
    x, y = -scale * (low + high) / 2
    return scale, float(x), float(y)


def apply_yaw(view: View, vertices: np.ndarray) -> tuple[View, np.ndarray]:
    """Return vertices ``(V, 3)`` rotated about Z by a view's yaw, and the equivalent view without yaw.

    The rotated vertices have another box, to which a view is relative; the resulting shift along the line of sight is neglected.
    """
    cos, sin = np.cos(view.yaw_rad), np.sin(view.yaw_rad)
    turn = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])
    turned = vertices @ turn.T
    (_, center, half), (_, its_center, its_half) = normalised(vertices), normalised(turned)
    larger = its_half / half
    ahead = replace(view, yaw_rad=0.0, perspective=float(view.perspective * larger), scale=float(view.scale * larger))
    x, y, _ = ahead.in_camera((its_center - turn @ center)[None] / its_half)[0]
    return replace(ahead, x=float(view.x + ahead.scale * x), y=float(view.y - ahead.scale * y)), turned
