"""RoboTwin's way from model_data to a closed hand, replayed in simulation: the fingers close on the object."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from known_twins import TWINS, body_of
from manitwin.assets.writers import robotwin
from manitwin.assets.writers.exporter import TwinContent
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien.trial import SapienTrial
from rigid_boxes import PANDA, SETTINGS

CONTACTS = 5
CONTACT_TO_GRIPPER = np.array([[0.0, 0, 1, 0], [-1, 0, 0, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
SPAWNED = np.array([[1.0, 0, 0, 0.2], [0, 0, -1, -0.1], [0, 1, 0, 0.741], [0, 0, 0, 1]])
"""A pose of the Y-up mesh on RoboTwin's table: quaternion wxyz 0.7071, 0.7071, 0, 0."""


def gripper_pose(config: dict[str, Any], index: int) -> np.ndarray:
    """The world pose that RoboTwin's get_point and get_grasp_pose make of a contact: X approaches, Y is along the closing."""
    local = np.array(config["contact_points_pose"][index])
    local[:3, 3] *= np.array(config["scale"])
    pose = SPAWNED @ local @ CONTACT_TO_GRIPPER
    pose[:3, 3] -= 0.12 * pose[:3, 0]
    return pose


def panda_in_object(gripper: np.ndarray) -> np.ndarray:
    """The Panda with its fingertips 0.12 m in front of RoboTwin's gripper frame, in the twin's object frame (+Z up)."""
    pose = np.eye(4)
    pose[:3, :3] = np.column_stack([gripper[:3, 1], gripper[:3, 2], gripper[:3, 0]])
    pose[:3, 3] = gripper[:3, 3] + (0.12 - PANDA.tip_depth_m) * gripper[:3, 0]
    object_to_world = SPAWNED @ np.array([[1.0, 0, 0, 0], [0, 0, 1, 0], [0, -1, 0, 0], [0, 0, 0, 1]])
    return np.linalg.inv(object_to_world) @ pose


def replayed(twin: TwinContent, body: RigidBody, indices: range) -> list[str]:
    exported = robotwin.export(twin)
    config = json.loads(exported.files[exported.main])
    poses = np.array([panda_in_object(gripper_pose(config, i)) for i in indices])
    return [result.outcome for result in SapienTrial().run(body, PANDA, poses, SETTINGS)]


@pytest.mark.parametrize("make", TWINS)
def test_both_frames_of_every_contact_hold_the_object(make: Any) -> None:
    twin = make()
    outcomes = replayed(twin, body_of(twin), range(2 * CONTACTS))
    assert outcomes == ["held"] * 2 * CONTACTS


def test_frame_with_another_closing_axis_does_not_hold() -> None:
    # what the formula's axes are worth: closing along the tray's wall instead of across it
    twin = TWINS[2]()
    exported = robotwin.export(twin)
    config = json.loads(exported.files[exported.main])
    poses = []
    for i in range(4):
        pose = panda_in_object(gripper_pose(config, i))
        pose[:3, :3] = np.column_stack([pose[:3, 1], -pose[:3, 0], pose[:3, 2]])
        poses.append(pose)
    outcomes = [result.outcome for result in SapienTrial().run(body_of(twin), PANDA, np.array(poses), SETTINGS)]
    assert "held" not in outcomes


def test_open_hand_at_the_contact_is_clear_of_the_table() -> None:
    # RoboTwin's table is at 0.74 m: the fingertips of a grasp from above stay over it
    twin = TWINS[0]()
    exported = robotwin.export(twin)
    config = json.loads(exported.files[exported.main])
    pose = gripper_pose(config, 0)
    assert np.allclose(pose[:3, 0], [0, 0, -1])
    assert pose[2, 3] - 0.12 == pytest.approx(0.741 + 0.09)
