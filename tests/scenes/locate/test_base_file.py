"""Where a camera is in a robot's frame, read without trust."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.geometry.poses import quaternion_wxyz, transform
from manitwin.scenes.locate.hand_eye_file import read_camera_to_base

TURN = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])


def written(folder: Path, told: Any) -> Path:
    path = folder / "base.json"
    path.write_text(json.dumps(told))
    return path


def test_a_matrix_and_a_quaternion_say_the_same(tmp_path: Path) -> None:
    pose = transform(TURN, np.array([0.4, -0.1, 0.7]))
    by_matrix = read_camera_to_base(written(tmp_path, {"camera_to_base": pose.tolist()}))
    quaternion = np.asarray(quaternion_wxyz(TURN)).tolist()
    by_quaternion = read_camera_to_base(
        written(tmp_path, {"position_m": [0.4, -0.1, 0.7], "quaternion_wxyz": quaternion})
    )
    assert by_matrix == pytest.approx(pose) and by_quaternion == pytest.approx(pose)


def test_a_rounded_rotation_is_made_one_again(tmp_path: Path) -> None:
    turn = np.round(np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0], 4)
    turn *= np.sign(np.linalg.det(turn))
    pose = read_camera_to_base(written(tmp_path, {"camera_to_base": transform(turn, np.zeros(3)).tolist()}))
    assert pose[:3, :3] @ pose[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)


@pytest.mark.parametrize(
    ("told", "said"),
    [
        ({}, "contains no camera pose"),
        ({"camera_to_base": [[1, 2], [3, 4]]}, "contains no camera pose"),
        ({"camera_to_base": (2 * np.eye(4)).tolist()}, "not a rigid transform"),
        ({"camera_to_base": np.diag([2.0, 2, 2, 1]).tolist()}, "its rotation is invalid"),
        ({"camera_to_base": np.diag([1.0, 1, -1, 1]).tolist()}, "its rotation is invalid"),
        ({"camera_to_base": transform(TURN, np.array([500.0, 0, 900])).tolist()}, "not a rigid transform in metres"),
        ({"position_m": [0, 0, 0], "quaternion_wxyz": [2, 0, 0, 0]}, "does not have length 1"),
        ({"position_m": [0, 0, 0], "quaternion_wxyz": [1e300, 1e300, 0, 0]}, "does not have length 1"),
    ],
)
def test_what_is_no_pose_is_refused(told: Any, said: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=said):
        read_camera_to_base(written(tmp_path, told))
