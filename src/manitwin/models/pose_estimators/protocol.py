"""Protocol of pose estimators: one JSON document and files, exchanged in a folder or over HTTP.

The document of a request (``request.json``, or the body of a POST) has

- ``protocol``, ``name``, ``seed``, ``most_poses``
- ``camera``: ``fx``, ``fy``, ``cx``, ``cy``, ``width``, ``height`` in pixels; pixel centres have integer coordinates, as in
  OpenCV
- ``depth_unit_m``, ``diameter_m``
- ``symmetries``: 4 x 4 transforms of the object frame that map the shape to itself
- ``files``: names of the files ``mesh`` (PLY, metres, object frame), ``visual`` (the textured GLB, Y-up as in glTF: its (x,
  y, z)
  is (x, -z, y) of the object frame), ``depth`` (16-bit PNG, 0 unknown), ``mask`` and ``rgb`` (null: no colours)

The answer has ``model``, the name of the model, and ``poses``, the best first, each with ``object_to_camera`` (4 x 4, metres;
camera frame: x right, y down, z forward).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from manitwin.errors import BadReply
from manitwin.formats.printable import printable_line

PROTOCOL = "manitwin.pose/1"
MOST_POSES = 16
MOST_M = 100.0
MOST_SKEW = 1e-2
"""Maximum deviation of a matrix from a rotation. Rotations computed by networks in 32 bits deviate by 1e-6."""


@dataclass(frozen=True)
class PoseRequest:
    """A request: its document, and the content of each of its files by name."""

    document: dict[str, Any]
    files: Mapping[str, bytes]


@dataclass(frozen=True)
class PoseGuesses:
    """Poses ``object_to_camera (K, 4, 4)`` in m, the best first; ``model`` is the name of the model."""

    poses: np.ndarray
    model: str


class PoseEstimator(Protocol):
    """Protocol of a pose estimator; ``spec`` is the spec that created it."""

    spec: str

    def guess(self, request: PoseRequest) -> PoseGuesses:
        """Estimate poses; raises a BackendError if there is no answer, or one that violates the protocol."""
        ...


def parse_guesses(answer: Any, who: str) -> PoseGuesses:
    """Parse and validate an untrusted answer; raises BadReply naming ``who``. Rotations are orthonormalized."""
    told = answer if isinstance(answer, dict) else {}
    model, poses = told.get("model"), told.get("poses")
    if (
        not isinstance(model, str)
        or not model.strip()
        or not isinstance(poses, list)
        or not 0 < len(poses) <= MOST_POSES
    ):
        raise BadReply(f"{who}: answered with no 'model' and 1 to {MOST_POSES} 'poses'; it must follow {PROTOCOL}")
    found = [_pose(each, place, who) for place, each in enumerate(poses)]
    return PoseGuesses(np.array(found), printable_line(model.strip(), max_characters=80))


def _pose(told: Any, place: int, who: str) -> np.ndarray:
    """Validate one pose and orthonormalize its rotation; raises BadReply if it is not rigid or behind the camera."""
    try:
        pose = np.array(told["object_to_camera"], float)
        if pose.shape != (4, 4) or not np.isfinite(pose).all() or np.abs(pose).max() > MOST_M:
            raise ValueError
        left, _, right = np.linalg.svd(pose[:3, :3])
        turn = left @ right
        last = np.abs(pose[3] - [0, 0, 0, 1]).max()
        if np.linalg.det(turn) < 0 or max(np.abs(turn - pose[:3, :3]).max(), last) > MOST_SKEW or pose[2, 3] <= 0:
            raise ValueError
    except (KeyError, TypeError, ValueError, OverflowError) as error:
        raise BadReply(
            f"{who}: poses[{place}].object_to_camera is not a rigid transform (4 x 4, metres) in front of the"
            f" camera; it must follow"
            f" {PROTOCOL}"
        ) from error
    pose[:3, :3], pose[3] = turn, (0, 0, 0, 1)
    return pose
