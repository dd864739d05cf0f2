"""Placement outcomes of episodes: errors of the target against its goal, and disturbance of other objects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.settings import EpisodeSettings
from manitwin.geometry.poses import rotation_angle_rad, transform_points


@dataclass(frozen=True)
class PlacementErrors:
    """Errors of an object's pose against its goal: centre of mass, tilt, and heading."""

    position_error_m: float
    tilt_rad: float
    yaw_error_rad: float


def placement_errors(
    object_to_world: np.ndarray, goal_object_to_world: np.ndarray, center_of_mass_m: np.ndarray
) -> PlacementErrors:
    """Compare poses ``(4, 4)``; the yaw error (0 to pi) is that of the vertical rotation closest to the whole rotation."""
    turn = object_to_world[:3, :3] @ goal_object_to_world[:3, :3].T
    yaw = np.arctan2(turn[1, 0] - turn[0, 1], turn[0, 0] + turn[1, 1])
    return PlacementErrors(
        position_error_m=moved_m(goal_object_to_world, object_to_world, center_of_mass_m),
        tilt_rad=float(np.arccos(np.clip(turn[2, 2], -1, 1))),
        yaw_error_rad=float(abs(yaw)),
    )


def moved_m(before: np.ndarray, after: np.ndarray, center_of_mass_m: np.ndarray) -> float:
    """Return the displacement of the centre of mass between two poses ``(4, 4)``."""
    center = center_of_mass_m[None]
    return float(np.linalg.norm(transform_points(after, center) - transform_points(before, center)))


def turned_rad(before: np.ndarray, after: np.ndarray) -> float:
    """Return the rotation angle between two poses ``(4, 4)``."""
    return rotation_angle_rad(after[:3, :3] @ before[:3, :3].T)


def is_at_rest(poses: Sequence[np.ndarray], center_of_mass_m: np.ndarray, settings: EpisodeSettings) -> bool:
    """Tell whether a released object is at rest, by its poses ``(4, 4)`` in the last half second.

    Speeds are unsuitable: a tall box keeps rocking by a tenth of a degree, because rigid-body simulation does not damp it.
    """
    return all(
        moved_m(pose, poses[-1], center_of_mass_m) < settings.max_rest_m
        and turned_rad(pose, poses[-1]) < np.radians(settings.max_rest_deg)
        for pose in poses
    )


def placement_outcome(
    errors: PlacementErrors, *, at_rest: bool, released: bool, settings: EpisodeSettings
) -> str | None:
    """Return ``toppled`` or ``misplaced``, or None if the object is at its goal, at rest and released."""
    if not errors.tilt_rad < np.radians(settings.max_tilt_deg):
        return "toppled"
    if not (errors.position_error_m < settings.max_placed_m and at_rest and released):
        return "misplaced"
    return None


def is_disturbed(
    before: np.ndarray, after: np.ndarray, center_of_mass_m: np.ndarray, settings: EpisodeSettings
) -> bool:
    """Tell whether an object has moved or turned by more than the settings allow."""
    return (
        moved_m(before, after, center_of_mass_m) > settings.max_disturbed_m
        or turned_rad(before, after) > np.radians(settings.max_disturbed_deg)
    )  # fmt: skip
