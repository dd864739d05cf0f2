"""A gripper as a slim fork of rods, so that many of them leave the object to be seen."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import trimesh

from manitwin.render.raycast import merged

Boxes = Sequence[tuple[np.ndarray, np.ndarray]]
"""``(box_to_gripper (4, 4), half_extents_m (3,))`` of each box of palm and fingers, grasp frame: +Z approach, X
closing."""

_unit_box = trimesh.creation.box(bounds=[[0, 0, 0], [1, 1, 1]])
_UNIT_BOX = np.asarray(_unit_box.vertices), np.asarray(_unit_box.faces)  # made once: trimesh takes a millisecond for it

STEM_SHARE = 0.5  # the stem's length, in that of the fingers


def gripper_fork(boxes: Boxes, rod_m: float) -> trimesh.Trimesh:
    """Return rods of ``rod_m`` thickness in the grasp frame: one along each finger's inner face, a crossbar, a stem.

    Fingers are the boxes beside the middle plane x = 0; they reach from the palm's front to their tips. A gripper without
    any, a suction cup, is its boxes.
    """
    sides: dict[int, list[np.ndarray]] = {1: [], -1: []}
    front = 0.0
    for box_to_gripper, half in boxes:
        corners = _corners(box_to_gripper, half)
        if abs(box_to_gripper[0, 3]) < 1e-9:
            front = max(front, float(corners[:, 2].max()))
        else:
            sides[1 if box_to_gripper[0, 3] > 0 else -1].append(corners)
    if not all(sides.values()):
        return gripper_body(boxes)
    rods, tips = [], []
    for corners_of_side in sides.values():
        corners = np.concatenate(corners_of_side)
        x = float(corners[np.abs(corners[:, 0]).argmin(), 0])
        x += np.copysign(rod_m / 2, float(corners[:, 0].mean()))
        tips.append(float(corners[:, 2].max()))
        rods.append(_rod([x, 0, front], [x, 0, tips[-1]], rod_m))
    reach = max(abs(float(rod.vertices[:, 0].mean())) for rod in rods)
    rods.append(_rod([-reach, 0, front], [reach, 0, front], rod_m))
    rods.append(_rod([0, 0, front - STEM_SHARE * (max(tips) - front)], [0, 0, front], rod_m))
    return merged(rods)


def gripper_body(boxes: Boxes) -> trimesh.Trimesh:
    """Return the boxes themselves as one mesh in the grasp frame."""
    return merged([trimesh.creation.box(2 * half, box_to_gripper) for box_to_gripper, half in boxes])


def _rod(start: Sequence[float], end: Sequence[float], thickness: float) -> trimesh.Trimesh:
    """Return a square rod along an axis of the frame, closed around both ends."""
    low, high = np.minimum(start, end) - thickness / 2, np.maximum(start, end) + thickness / 2
    return trimesh.Trimesh(low + _UNIT_BOX[0] * (high - low), _UNIT_BOX[1], process=False)


def _corners(box_to_gripper: np.ndarray, half: np.ndarray) -> np.ndarray:
    signs = np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
    return (signs * half) @ box_to_gripper[:3, :3].T + box_to_gripper[:3, 3]
