"""Distances between grasps, and far-apart subsets of them.

A parallel gripper turned by half a turn about its approach direction is the same gripper: such twins have distance
zero.
"""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import quaternion_wxyz

METRES_PER_RADIAN = 0.05  # weighs turning against moving: half a turn counts as much as 16 cm, the length of a hand


def approach_octants(gripper_to_object: np.ndarray) -> np.ndarray:
    """Return the octant 0..7 of the object frame that each approach direction of grasps ``(N, 4, 4)`` points into."""
    return (gripper_to_object[:, :3, 2] >= 0) @ np.array([1, 2, 4])


def fingertips(gripper_to_object: np.ndarray, depth_m: np.ndarray) -> np.ndarray:
    """Return the centres ``(N, 3)`` m between the fingertips of grasps ``(N, 4, 4)``, in the object frame."""
    return gripper_to_object[:, :3, 3] + gripper_to_object[:, :3, 2] * np.asarray(depth_m)[:, None]


def farthest_grasps(gripper_to_object: np.ndarray, depth_m: np.ndarray, count: int, start: int = 0) -> np.ndarray:
    """Return indices of ``count`` grasps of ``(N, 4, 4)``, each the farthest from those before it.

    Position and unit quaternion are the seven numbers of the paper's "7-DoF FPS": the distance is that of the
    fingertips plus ``METRES_PER_RADIAN`` times the angle between the orientations. Starts at ``start``; returns all
    where there are no more.
    """
    if len(gripper_to_object) <= count:
        return np.arange(len(gripper_to_object))
    tips = fingertips(gripper_to_object, depth_m)
    quaternion = quaternion_wxyz(gripper_to_object[:, :3, :3])
    w, x, y, z = quaternion.T
    half_turned = np.stack([-z, y, -x, w], axis=1)  # quaternion times that of half a turn about Z
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
