"""Distances between grasps, and farthest-point subsets of grasps.

A parallel gripper turned by 180 degrees about its approach direction is the same gripper: such grasps have distance zero.
"""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import quaternion_wxyz

METRES_PER_RADIAN = 0.05  # weight of rotation against translation: half a turn counts as 16 cm, the length of a hand


def approach_octants(gripper_to_object: np.ndarray) -> np.ndarray:
    """Return the octant 0..7 of the object frame that contains the approach direction of each grasp ``(N, 4, 4)``."""
    return (gripper_to_object[:, :3, 2] >= 0) @ np.array([1, 2, 4])


def fingertips(gripper_to_object: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    """Return the points ``(N, 3)`` m between the fingertips of grasps ``(N, 4, 4)``, in the object frame."""
    return gripper_to_object[:, :3, 3] + gripper_to_object[:, :3, 2] * np.asarray(depth_m)[:, None]


def farthest_grasps(gripper_to_object: np.ndarray, depth_m: np.ndarray, count: int, start: int = 0) -> np.ndarray:
    """Return the indices of ``count`` of the grasps ``(N, 4, 4)`` by farthest point sampling.

    The seven numbers of the paper's "7-DoF FPS" are position and unit quaternion: the distance is that of the fingertips plus
    ``METRES_PER_RADIAN`` times the angle between the orientations. Starts at index ``start``; returns all indices if there are
    no more than ``count``.
    """
    if len(gripper_to_object) <= count:
        return np.arange(len(gripper_to_object))
    tips = fingertips(gripper_to_object, depth_m)
    quaternion = quaternion_wxyz(gripper_to_object[:, :3, :3])
    w, x, y, z = quaternion.T
    half_turned = np.stack([-z, y, -x, w], axis=1)  # quaternion product with half a turn about Z
    chosen = np.empty(count, dtype=np.int64)
    chosen[0] = start
    nearest = np.full(len(tips), np.inf)
    for i in range(1, count):
        last = chosen[i - 1]
        cosine = np.maximum(np.abs(quaternion @ quaternion[last]), np.abs(half_turned @ quaternion[last]))
        angle = 2 * np.arccos(np.minimum(cosine, 1))
        nearest = np.minimum(nearest, np.linalg.norm(tips - tips[last], axis=1) + METRES_PER_RADIAN * angle)
        nearest[chosen[:i]] = -1
        chosen[i] = int(nearest.argmax())
    return chosen
