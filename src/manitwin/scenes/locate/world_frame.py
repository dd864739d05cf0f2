"""World frame of a located scene: +Z up from the table, with the robot's base at the origin if a calibration is given."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.poses import rotation_between, transform, transform_points
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.proposals import Plane

MOST_LEAN_RAD = np.deg2rad(3.0)
"""Largest tilt of the observed table in the base's frame: calibrations are accurate to a degree, and tables level to less."""
AHEAD_M = 0.5
"""Distance of the objects from the origin without a calibration: the middle of a table-mounted arm's reach."""
AROUND_M = 1.0
_ON_PLANE_M = 0.006
_EDGE_SHARE = 0.01
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class WorldFrame:
    """``camera_to_world (4, 4)``, m, +Z up; the table's height; its tilt ``lean_rad`` in the base's frame.

    The world is rotated so that the table is level. ``calibrated``: the origin is the robot's base; otherwise its position is
    assumed, on the camera's side of the objects.
    """

    camera_to_world: np.ndarray
    table_m: float
    calibrated: bool
    lean_rad: float


def base_world_frame(camera_to_base: np.ndarray, plane: Plane, about: np.ndarray) -> WorldFrame:
    """Return the base's frame, levelled at the table below the point ``about (3,)`` in the camera's frame.

    Raises UsageError if the table tilts by more than 3 degrees, since the calibration or the plane is then wrong.
    """
    up = camera_to_base[:3, :3] @ plane.normal
    lean_rad = float(np.arccos(np.clip(up @ _UP, -1, 1)))
    if lean_rad > MOST_LEAN_RAD:
        raise UsageError(
            f"--base: the visible table leans by {np.rad2deg(lean_rad):.1f} degrees in the frame of the base, but"
            f" at most"
            f" {np.rad2deg(MOST_LEAN_RAD):.0f} are allowed; calibrate again, or look at a level table"
        )
    below = transform_points(camera_to_base, (about - plane.height_m(about) * plane.normal)[None])[0]
    level = transform(rotation_between(up, _UP))
    level[:3, 3] = below - level[:3, :3] @ below
    return WorldFrame(level @ camera_to_base, float(below[2]), True, lean_rad)


def table_world_frame(plane: Plane, about: np.ndarray) -> WorldFrame:
    """Return a frame with the table at z = 0, +X away from the camera, and the point ``about (3,)`` above (0.5, 0)."""
    ahead = np.array([0.0, 0.0, 1.0]) - plane.normal[2] * plane.normal
    if np.linalg.norm(ahead) < 0.1:  # for a vertical view, away from the camera is up in the picture
        ahead = np.array([0.0, -1.0, 0.0]) + plane.normal[1] * plane.normal
    ahead /= np.linalg.norm(ahead)
    turn = np.stack([ahead, np.cross(plane.normal, ahead), plane.normal])
    below = about - plane.height_m(about) * plane.normal
    return WorldFrame(transform(turn, np.array([AHEAD_M, 0.0, 0.0]) - turn @ below), 0.0, False, 0.0)


def table_points(view: DepthView, world: WorldFrame, noise_m: float) -> np.ndarray:
    """Return the visible points ``(N, 2)`` of the table, m in the world."""
    points = transform_points(world.camera_to_world, view.points(np.flatnonzero(known_depth(view))))
    return np.asarray(points[np.abs(points[:, 2] - world.table_m) < _ON_PLANE_M + 2 * noise_m, :2])


def visible_rectangle(points: np.ndarray, kept: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners ``(2,)`` of the axis-aligned rectangle of the table's points ``(N, 2)``.

    It always contains ``kept (K, 2)``, the points of the objects; points more than a metre from their mean are ignored.
    """
    middle = kept.mean(0)
    near = points[np.linalg.norm(points - middle, axis=1) < AROUND_M]
    near = near if len(near) else kept
    low, high = (np.quantile(near, share, axis=0) for share in (_EDGE_SHARE, 1 - _EDGE_SHARE))
    return np.minimum(low, kept.min(0)), np.maximum(high, kept.max(0))
