"""Reader of the JSON file of a hand-eye calibration: the camera's pose in the frame of a robot's base."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object
from manitwin.geometry.poses import rotation_from_quaternion_wxyz, transform

MAX_BASE_BYTES = 1 << 20
REMEDY = (
    'give {"camera_to_base": [[..], [..], [..], [0, 0, 0, 1]]} or {"position_m": [x, y, z], "quaternion_wxyz": [w, x, y, z]} of'
    " the camera (x right, y down, z ahead) in the base's frame (z up, x ahead), metres"
)
_MOST_M = 100.0
_OFF = 1e-3
"""Calibrations are written with at least four digits."""


def read_camera_to_base(path: Path) -> np.ndarray:
    """Return ``camera_to_base (4, 4)``, m, from a calibration file; raises UsageError for an invalid pose."""
    told = read_json_object(path, UsageError, limit_bytes=MAX_BASE_BYTES, name=str(path), remedy=REMEDY)
    try:
        if "camera_to_base" in told:
            pose = np.array(told["camera_to_base"], float).reshape(4, 4)
        else:
            position, quaternion = (np.array(told[key], float) for key in ("position_m", "quaternion_wxyz"))
            if not np.abs(quaternion).max() < 2 or abs(np.linalg.norm(quaternion.reshape(4)) - 1) > _OFF:
                raise UsageError(f"{path}: quaternion_wxyz does not have length 1; {REMEDY}")
            pose = transform(rotation_from_quaternion_wxyz(quaternion), position.reshape(3))
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise UsageError(f"{path}: contains no camera pose; {REMEDY}") from error
    if not np.isfinite(pose).all() or np.abs(pose).max() > _MOST_M or np.abs(pose[3] - [0, 0, 0, 1]).max() > _OFF:
        raise UsageError(f"{path}: is not a rigid transform in metres; {REMEDY}")
    turn = pose[:3, :3]
    if np.abs(turn @ turn.T - np.eye(3)).max() > _OFF or np.linalg.det(turn) < 0:
        raise UsageError(
            f"{path}: its rotation is invalid (columns must be of length 1, orthogonal and right-handed); {REMEDY}"
        )
    left, _, right = np.linalg.svd(turn)
    return transform(left @ right, pose[:3, 3])
