"""The up direction of a world from its camera poses: photos are usually taken with a level camera."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

MOST_ROLL_DEG = 10.0
"""Root mean square roll of cameras up to which they count as level, for handheld cameras."""
_AXIS_ROLL_DEG = 5.0  # the roll up to which a world axis is accepted as up
_LEAST_SPREAD = 0.2  # least singular value of the cameras' right axes: below it, the level direction is ambiguous
_LEAST_UPRIGHT = 0.3  # least mean component of the cameras' own up; portraits taken sideways have 0
_SAME_UP = 0.8  # cosine of 37 degrees: up directions farther apart contradict each other
_ROUNDS = 10
_LEAST_ON_EDGE = 8  # cameras: with fewer, some direction is level with a side of each image by chance
_EDGE_ROLL_DEG = 6.0  # chance alone does not reach a roll this small
# component of the mean viewing direction against up: objects are seen from above, which gives the sign
_LEAST_DOWN = 0.15
_LEAST_AHEAD = 0.2  # horizontal component below which a viewing direction has no reliable azimuth
_AXES = {
    "z": (0, 0, 1.0),
    "y": (0, 1.0, 0),
    "-y": (0, -1.0, 0),
    "-z": (0, 0, -1.0),
    "x": (1.0, 0, 0),
    "-x": (-1.0, 0, 0),
}


@dataclass(frozen=True)
class UpDirection:
    """The up direction ``axis (3,)``, a description of how it was found, and the RMS roll of the cameras about it."""

    axis: np.ndarray
    said: str
    roll_deg: float


def up_from_level_cameras(rotations: np.ndarray, usual: str | None = None) -> UpDirection | None:
    """Return the up direction from camera ``rotations (N, 3, 3)`` (world to camera, x right, y down); None if ambiguous.

    Tried in order: a world axis about which the cameras are level, first ``usual`` ('z', '-y', ...); any direction about which
    they are level; a direction about which each camera is level along one side of its image, as for phones held upright or
    sideways, with the sign from the cameras looking down; finally, for rolled cameras, ``usual`` if most cameras are the right
    way up about it.
    """
    aside, upward = rotations[:, 0], -rotations[:, 1]
    for name in sorted(_AXES, key=lambda name: name != usual):
        told = _about(np.array(_AXES[name]), aside, upward)
        if told is not None and told <= _AXIS_ROLL_DEG:
            return UpDirection(
                np.array(_AXES[name]), f"the world's {name} axis, which the cameras are level about", told
            )
    _, spread, directions = np.linalg.svd(aside / np.sqrt(len(aside)))
    if len(aside) > 1 and spread[1] >= _LEAST_SPREAD:
        level = directions[2] * (1.0 if float(upward.mean(axis=0) @ directions[2]) >= 0 else -1.0)
        told = _about(level, aside, upward)
        if told is not None and told <= MOST_ROLL_DEG:
            return UpDirection(level, "the direction that the cameras are level about", told)
    on_edge = _up_from_image_edges(rotations)
    if on_edge is not None:
        return on_edge
    if usual is not None and float(upward.mean(axis=0) @ np.array(_AXES[usual])) >= _LEAST_UPRIGHT:
        roll = _roll_deg(np.array(_AXES[usual]), aside)
        return UpDirection(np.array(_AXES[usual]), f"the world's {usual} axis, as is usual of such files", roll)
    return None


def _up_from_image_edges(rotations: np.ndarray) -> UpDirection | None:
    """Return the direction that is level with one of the two sides of each camera's image."""
    down = rotations[:, 2].mean(axis=0)
    starts = [np.array(axis) for axis in _AXES.values()] + [-down / max(float(np.linalg.norm(down)), 1e-9)]
    found: list[UpDirection] = []
    for axis in starts:
        for _ in range(_ROUNDS):
            upright = np.abs(rotations[:, 0] @ axis) <= np.abs(rotations[:, 1] @ axis)
            sides = np.where(upright[:, None], rotations[:, 0], rotations[:, 1])
            _, spread, directions = np.linalg.svd(sides / np.sqrt(len(sides)))
            axis = directions[2]
        axis = axis * (1.0 if float(down @ axis) <= 0 else -1.0)
        if len(sides) >= _LEAST_ON_EDGE and spread[1] >= _LEAST_SPREAD and -float(down @ axis) >= _LEAST_DOWN:
            found.append(
                UpDirection(axis, "the direction that a side of each picture is level about", _roll_deg(axis, sides))
            )
    best = min(found, key=lambda told: told.roll_deg, default=None)
    return best if best is not None and best.roll_deg <= _EDGE_ROLL_DEG else None


def up_from_world_axis(rotations: np.ndarray, name: str) -> UpDirection | None:
    """Return a stated world axis ('y', 'z') as the up direction; None if most photos would be upside down.

    If the cameras indicate another direction, the description says so.
    """
    axis = np.array(_AXES[name])
    if float((-rotations[:, 1]).mean(axis=0) @ axis) < -_LEAST_UPRIGHT:
        return None
    seen, said = up_from_level_cameras(rotations), f"the world's {name} axis, as was stated"
    if seen is not None and float(seen.axis @ axis) < _SAME_UP:
        said += f", though the cameras tell {seen.said}"
    return UpDirection(axis, said, _roll_deg(axis, rotations[:, 0]))


def _about(axis: np.ndarray, aside: np.ndarray, upward: np.ndarray) -> float | None:
    """Return the RMS roll of cameras about an axis in degrees; None if they are not the right way up about it."""
    if float(upward.mean(axis=0) @ axis) < _LEAST_UPRIGHT:
        return None
    return _roll_deg(axis, aside)


def _roll_deg(axis: np.ndarray, aside: np.ndarray) -> float:
    return float(np.rad2deg(np.sqrt(np.mean(np.arcsin(np.clip(aside @ axis, -1, 1)) ** 2))))


def azimuth_deg(rotation: np.ndarray) -> float:
    """Return the azimuth (degrees) from which a camera sees the scene, about the vertical z, counter-clockwise seen from above.

    ``rotation (3, 3)`` is world to camera. For a camera that looks straight down or up, the bottom of its image counts as near.
    """
    ahead = rotation[2, :2]
    if np.linalg.norm(ahead) < _LEAST_AHEAD:
        ahead = rotation[1, :2] * (1.0 if rotation[2, 2] > 0 else -1.0)
    return float(np.rad2deg(np.arctan2(-ahead[1], -ahead[0])))
