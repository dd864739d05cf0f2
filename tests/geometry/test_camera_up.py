"""Which way is up, as level cameras say it."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.camera_up import azimuth_deg, up_from_level_cameras, up_from_world_axis
from posed_things import PLACES, TO_OPENCV, pose_at


def _rotations(turn: np.ndarray, roll_deg: float = 0.0) -> np.ndarray:
    """Of cameras whose world is turned by ``turn``; they are rolled to both sides."""
    poses = [pose_at(*place, roll_deg=roll_deg * (-1) ** k) for k, place in enumerate(PLACES)]
    return np.array([TO_OPENCV @ pose[:3, :3].T @ turn.T for pose in poses])


def test_an_axis_of_the_world_is_told_by_level_cameras() -> None:
    y_down = np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]])
    for turn, name in ((np.eye(3), "z"), (y_down, "-y")):
        told = up_from_level_cameras(_rotations(turn, 3.0), "z")
        assert told is not None and f"world's {name} axis" in told.said and told.roll_deg == pytest.approx(3, abs=0.5)


def test_any_direction_is_told_by_level_cameras() -> None:
    turn, _ = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))
    turn = turn * np.sign(np.linalg.det(turn))
    told = up_from_level_cameras(_rotations(turn, 2.0))
    assert told is not None and float(told.axis @ turn[:, 2]) > np.cos(np.deg2rad(3))


def test_rolled_cameras_tell_nothing_but_what_is_usual() -> None:
    rolled = _rotations(np.eye(3), 40.0)
    assert up_from_level_cameras(rolled) is None
    told = up_from_level_cameras(rolled, "z")
    assert told is not None and "usual" in told.said
    assert up_from_level_cameras(_rotations(np.eye(3), 90.0), "z") is None


def test_pictures_upright_and_across_tell_it_together() -> None:
    """As of a telephone: half of the pictures are rolled by a right angle, to either side, and all by a few degrees."""
    turn, _ = np.linalg.qr(np.array([[1.0, 2, 3], [0, 1, 4], [5, 6, 0]]))
    turn = turn * np.sign(np.linalg.det(turn))
    rolls = [2, 88, -3, -91, 93, 1, -2, 90, -88, 3]
    places = [(37.0 * k, 15.0 + 5 * k, 1.0) for k in range(len(rolls))]
    poses = [pose_at(*place, roll_deg=roll) for place, roll in zip(places, rolls, strict=True)]
    rotations = np.array([TO_OPENCV @ pose[:3, :3].T @ turn.T for pose in poses])
    told = up_from_level_cameras(rotations)
    assert told is not None and float(told.axis @ turn[:, 2]) > np.cos(np.deg2rad(3)) and "a side of each" in told.said
    assert up_from_level_cameras(rotations[:7]) is None  # of so few some direction is level by chance


def test_what_stands_on_its_head_is_not_believed() -> None:
    upright = up_from_world_axis(_rotations(np.eye(3)), "z")
    assert upright is not None and upright.said == "the world's z axis, as was stated"
    aside = up_from_world_axis(_rotations(np.eye(3)), "y")
    assert aside is not None and "though the cameras tell the world's z axis" in aside.said
    assert up_from_world_axis(_rotations(np.diag([1.0, -1, -1])), "z") is None


@pytest.mark.parametrize("elevation_deg", [-80, 0, 40, 89.9])
def test_turns_are_told_from_above_and_below_too(elevation_deg: float) -> None:
    turns = [azimuth_deg(TO_OPENCV @ pose_at(turn, elevation_deg, 1.0)[:3, :3].T) for turn in (0.0, 70.0)]
    assert (turns[1] - turns[0]) % 360 == pytest.approx(70)
