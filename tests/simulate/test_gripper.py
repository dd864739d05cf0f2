"""The Panda's boxes against the numbers of its public URDF."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.errors import UsageError
from manitwin.geometry.poses import inverse, transform
from manitwin.simulate.gripper import load_gripper

# Boxes of the left finger in panda_v2_gripper.urdf: centre, half extents (m), rotation about X; the finger frame lies
# 0.0584 m above panda_hand, and the finger moves along +Y.
URDF_FINGER = [
    ((0, 18.5e-3, 11e-3), (11e-3, 7.5e-3, 10e-3), 0.0),
    ((0, 6.8e-3, 2.2e-3), (11e-3, 4.4e-3, 1.9e-3), 0.0),
    ((0, 15.9e-3, 28.35e-3), (8.75e-3, 3.5e-3, 11.75e-3), np.pi / 6),
    ((0, 7.58e-3, 45.25e-3), (8.75e-3, 7.6e-3, 9.25e-3), 0.0),
]
FINGER_HEIGHT_M = 0.0584
# The grasp frame closes along X, panda_hand along Y: a quarter turn about Z, either way.
PANDA_HAND_TO_GRIPPER = transform(Rotation.from_euler("z", -90, degrees=True).as_matrix())


def corners(box_to_frame: np.ndarray, half_extents_m: np.ndarray) -> np.ndarray:
    signs = np.stack(np.meshgrid([-1, 1], [-1, 1], [-1, 1]), -1).reshape(-1, 3)
    points = signs * half_extents_m @ box_to_frame[:3, :3].T + box_to_frame[:3, 3]
    return points[np.lexsort(points.round(7).T)]


@pytest.mark.parametrize("opening_m", [0.0, 0.05, 0.08])
def test_panda_fingers_are_the_boxes_of_its_urdf(opening_m: float) -> None:
    panda = load_gripper("panda")
    ours = panda.boxes(opening_m)[len(panda.palm_boxes) :]
    expected = []
    for side in (1, -1):
        for center, half, angle in URDF_FINGER:
            box = transform(
                Rotation.from_euler("x", side * angle).as_matrix(),
                np.array([center[0], side * (center[1] + opening_m / 2), center[2] + FINGER_HEIGHT_M]),
            )
            expected.append((PANDA_HAND_TO_GRIPPER @ box, np.array(half)))
    for (ours_pose, ours_half), (pose, half) in zip(ours, expected, strict=True):
        assert corners(ours_pose, ours_half) == pytest.approx(corners(pose, half), abs=1e-9)


def test_panda_pads_touch_when_closed_and_are_a_stroke_apart_when_open() -> None:
    panda = load_gripper("panda")
    for opening_m in (0.0, panda.opening_m):
        pad_to_gripper, half = panda.boxes(opening_m)[len(panda.palm_boxes) + 3]
        assert pad_to_gripper[0, 3] - half[0] == pytest.approx(opening_m / 2, abs=3e-5)


def test_second_finger_is_the_half_turn_of_the_first() -> None:
    panda = load_gripper("panda")
    half_turn = transform(np.diag([-1.0, -1.0, 1.0]))
    fingers = panda.boxes(0.06)[len(panda.palm_boxes) :]
    count = len(panda.finger_boxes)
    for (first, half), (second, other) in zip(fingers[:count], fingers[count:], strict=True):
        assert corners(half_turn @ first, half) == pytest.approx(corners(second, other), abs=1e-9)
    assert inverse(half_turn) == pytest.approx(half_turn)


def test_unknown_gripper_is_named_with_the_nearest() -> None:
    with pytest.raises(UsageError, match="did you mean 'panda'"):
        load_gripper("pandaa")
