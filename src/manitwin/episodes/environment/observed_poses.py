"""The poses that an environment shows, with the signs of quaternions that recorded episodes have."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import quaternion_wxyz, without_sign_changes
from manitwin.physics.sapien.world import RobotWorld


class ObservedPoses:
    """Reads tips and objects ``(k, 7)`` (m, quaternion wxyz) of a world; quaternions never change their sign on the way.

    They begin as near as can be to those of the world as it is first seen, whose signs are those with which recordings begin:
    arms at home, objects where the scene has them. So a start that differs a little has numbers that differ a little.
    """

    def __init__(self, world: RobotWorld):
        """Take a world before anything of it has moved."""
        self._last = without_sign_changes(_poses(world)[None, :, 3:])[0]

    def read(self, world: RobotWorld) -> tuple[np.ndarray, np.ndarray]:
        """Return the poses of all tips and of all objects as they are now."""
        poses = _poses(world)
        self._last = poses[:, 3:] = without_sign_changes(poses[None, :, 3:], self._last)[0]
        tips, objects = np.split(poses, [len(world.robots)])
        return tips, objects


def _poses(world: RobotWorld) -> np.ndarray:
    tips = np.array([arm.gripper_pose() for arm in world.robots])
    objects = [np.concatenate([pose.p, pose.q]) for pose in (body.entity_pose for body in world.bodies)]
    return np.concatenate([np.column_stack([tips[:, :3, 3], quaternion_wxyz(tips[:, :3, :3])]), objects])
