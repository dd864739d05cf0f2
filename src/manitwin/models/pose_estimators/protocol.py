"""What an estimator of poses is asked, and how it answers: one JSON document and files, by a folder or over HTTP.

The document of a question (``request.json``, or the body of a POST) has ``protocol``, ``name``, ``seed``, ``most_poses``,
``camera`` (``fx``, ``fy``, ``cx``, ``cy``, ``width``, ``height``; pixels' centres are whole numbers, as OpenCV has it),
``depth_unit_m``, ``diameter_m``, ``symmetries`` (4 x 4 motions of the object frame after which the shape is where it was) and
``files``, a name each: ``mesh`` (PLY, metres, object frame), ``visual`` (the textured GLB, Y-up as glTF has it: its (x, y, z) is
(x, -z, y) of the object frame), ``depth`` (PNG of 16 bits, 0 unknown), ``mask`` and ``rgb`` (null: no colours). The answer has
``model``, what answered, and ``poses``, the best first: ``object_to_camera`` (4 x 4, metres; camera: x right, y down, z ahead).
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
"""Rotations of networks in 32 bits are off by 1e-6; what is off by more is no rotation."""


@dataclass(frozen=True)
class PoseRequest:
    """A question: its document, and the content of each of its files by name."""

    document: dict[str, Any]
    files: Mapping[str, bytes]


@dataclass(frozen=True)
class PoseGuesses:
    """Poses ``object_to_camera (K, 4, 4)``, m, the best first; ``model`` is what answered."""

    poses: np.ndarray
    model: str


class PoseEstimator(Protocol):
    """The protocol of an estimator: ``spec`` is how it was named."""

    spec: str

    def guess(self, request: PoseRequest) -> PoseGuesses:
        """Answer a question; raises a BackendError where it does not, or not as the protocol has it."""
        ...


def parse_guesses(answer: Any, who: str) -> PoseGuesses:
    """Read an answer without trust; raises BadReply naming ``who``. Rotations are made exact."""
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
