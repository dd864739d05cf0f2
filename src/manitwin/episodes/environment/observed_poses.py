"""Observed poses of an environment, with the quaternion signs of recorded episodes."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import quaternion_wxyz, without_sign_changes
from manitwin.physics.sapien.world import RobotWorld


class ObservedPoses:
    """Reads poses ``(k, 7)`` (m, quaternion wxyz) of tips and objects; quaternion signs are continuous over time.

    The initial signs are those closest to the world's first state, which recordings also start from: arms at home, objects as
    in the scene. A slightly different start therefore has slightly different numbers.
    """

    def __init__(self, world: RobotWorld):
        """Take a world before anything has moved."""
        self._last = without_sign_changes(_poses(world)[None, :, 3:])[0]

    def read(self, world: RobotWorld) -> tuple[np.ndarray, np.ndarray]:
        """Return the current poses of all tips and of all objects."""
        poses = _poses(world)
        self._last = poses[:, 3:] = without_sign_changes(poses[None, :, 3:], self._last)[0]
        tips, objects = np.split(poses, [len(world.robots)])
        return tips, objects


def _poses(world: RobotWorld) -> np.ndarray:
    tips = np.array([arm.gripper_pose() for arm in world.robots])
    objects = [np.concatenate([pose.p, pose.q]) for pose in (body.entity_pose for body in world.bodies)]
    return np.concatenate([np.column_stack([tips[:, :3, 3], quaternion_wxyz(tips[:, :3, :3])]), objects])
