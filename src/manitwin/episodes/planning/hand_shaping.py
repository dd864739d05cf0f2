"""Placements of a multi-finger hand's shapes for planning, at the joints that a grasp has before it closes."""

from __future__ import annotations

from typing import Any

import numpy as np

from manitwin.episodes.planning.kinematic_body import KinematicBody
from manitwin.episodes.planning.libraries import pin
from manitwin.episodes.planning.obstacle_shapes import pose_of
from manitwin.robots.grippers.multi_finger import MultiFingerGripper


class HandShaping:
    """Finger shapes of a body, each fixed to its link."""

    def __init__(self, body: KinematicBody, gripper: MultiFingerGripper, joints_rad: np.ndarray):
        """Take a body that was built with the hand at ``joints_rad (J,)``."""
        self._body, self._gripper = body, gripper
        numbers = {link.name: number for number, link in enumerate(gripper.links)}
        poses = gripper.link_poses(joints_rad)
        self._shapes: list[tuple[int, int, Any]] = []
        for index, link in enumerate(body.links):
            number = numbers.get(link)
            if number is not None and gripper.finger_of_link[number] >= 0:
                link_to_joint = body.gripper_to_joint * pose_of(poses[number])
                placement = body.geometry.geometryObjects[index].placement
                self._shapes.append((index, number, link_to_joint.inverse() * pin.SE3(placement)))

    @property
    def moving(self) -> frozenset[int]:
        """Indices of the finger shapes."""
        return frozenset(index for index, _, _ in self._shapes)

    def placements(self, joints_rad: np.ndarray) -> dict[int, Any]:
        """Return the placement of each finger shape, by index, for the hand at ``joints_rad (J,)``."""
        poses = self._gripper.link_poses(joints_rad)
        joint = self._body.gripper_to_joint
        return {index: joint * pose_of(poses[number]) * on_link for index, number, on_link in self._shapes}
