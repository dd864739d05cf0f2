"""Gripper drawings from boxes that follow the grasp width: a simple fork for many grasps, the whole hand for one.

A box is ``{center, half, quaternion, shift, grow}`` in the grasp frame (+Z approach, X closing), in metres, quaternion wxyz. At
an opening w, its centre moves by ``shift * w`` along X, and its half extent in X grows by ``grow * w``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.errors import UsageError
from manitwin.geometry.boxes import box_corners
from manitwin.geometry.poses import quaternion_wxyz
from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.gripper import Gripper, load_gripper, shipped_grippers

_STEP_M = 0.01
_STEM_M = 0.03
_FINGER_M = 0.045
"""Drawn finger length of an unknown gripper."""


def gripper_shape(name: str, rod_m: float, depth_m: float) -> dict[str, Any]:
    """Return the drawing of a gripper: ``known``, ``fork`` and ``hand``, lists of boxes.

    ``rod_m`` is the thickness of a fork's rods. For a gripper that is not shipped with the package, the fork's fingers end at the
    depth ``depth_m`` of its grasps, and ``hand`` is empty.
    """
    if name not in shipped_grippers():
        return {"known": False, "fork": _fork(depth_m - _FINGER_M, depth_m, rod_m), "hand": []}
    try:
        gripper = load_gripper(name)
    except UsageError:
        return {"known": False, "fork": _fork(depth_m - _FINGER_M, depth_m, rod_m), "hand": []}
    hand = _opening(gripper)
    symbol = gripper.symbol(0.0)
    ends = _fingers(symbol)
    fork = _fork(*ends, rod_m) if ends is not None else [_box(*each) for each in symbol]
    return {"known": True, "fork": fork, "hand": hand}


def _opening(gripper: Gripper) -> list[dict[str, Any]]:
    """Return a gripper's boxes with their motion as it opens, computed from two openings; the motion is linear in X."""
    closed, open_ = gripper.boxes(0.0), gripper.boxes(_STEP_M)
    if len(closed) != len(open_):
        return [_box(*each) for each in closed]
    return [
        _box(pose, half, shift=float(later[0, 3] - pose[0, 3]) / _STEP_M)
        for (pose, half), (later, _) in zip(closed, open_, strict=True)
    ]


def _fingers(boxes: list[PlacedBox]) -> tuple[float, float] | None:
    """Return the start and end of the fingers along Z (boxes beside x = 0 are fingers); None if there are none."""
    front, tip, sides = 0.0, 0.0, set()
    for pose, half in boxes:
        top = float(box_corners(half, pose)[:, 2].max())
        side = np.sign(pose[0, 3]) if abs(pose[0, 3]) > 1e-9 else 0
        sides.add(side)
        front, tip = (max(front, top), tip) if side == 0 else (front, max(tip, top))
    return (front, tip) if {1, -1} <= sides and tip > front else None


def _fork(front_m: float, tip_m: float, rod_m: float) -> list[dict[str, Any]]:
    half, reach = rod_m / 2, max(tip_m - front_m, rod_m) / 2
    finger = [half, half, reach]
    parts = [
        _axis_box([side * half, 0.0, tip_m - reach], finger, shift=side / 2) for side in (1, -1)
    ]  # outside the contact faces
    bar = _axis_box([0.0, 0.0, front_m], [rod_m, half, half], grow=0.5)
    stem = _axis_box([0.0, 0.0, front_m - _STEM_M / 2], [half, half, _STEM_M / 2])
    return [*parts, bar, stem]


def _axis_box(center: list[float], half: list[float], *, shift: float = 0.0, grow: float = 0.0) -> dict[str, Any]:
    return {"center": center, "half": half, "quaternion": [1.0, 0.0, 0.0, 0.0], "shift": shift, "grow": grow}


def _box(pose: np.ndarray, half: np.ndarray, shift: float = 0.0) -> dict[str, Any]:
    turned = quaternion_wxyz(pose[None, :3, :3])[0].tolist()
    return {**_axis_box(pose[:3, 3].tolist(), half.tolist(), shift=shift), "quaternion": turned}
