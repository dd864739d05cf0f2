"""Distances between thumb and fingers of a multi-finger hand, from the collision shapes of its URDF."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import transform_points
from manitwin.robots.grippers.multi_finger import MultiFingerGripper


class Fingertips:
    """Fingertips of a hand: for each finger, thumb first, the vertices of its most distal link with a collision shape."""

    def __init__(self, hand: MultiFingerGripper):
        """Take a hand; raises ValueError if a finger has no collision shape."""
        self._hand, names = hand, [link.name for link in hand.links]
        self.links: list[int] = []
        for number, finger in enumerate(hand.fingers):
            shaped = [index for index in map(names.index, finger) if hand.links[index].shapes]
            if not shaped:
                raise ValueError(
                    f"fingers: finger {number} ({', '.join(finger)}) has no <collision> in the URDF, so it can"
                    f" touch nothing; name links with a <collision>, or add one"
                )
            self.links.append(max(shaped, key=lambda index: _depth(hand, index)))
        self._corners_m = [
            np.concatenate([shape.to_mesh().vertices for shape in hand.links[index].shapes]) for index in self.links
        ]

    def bounds_m(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return the corners of each fingertip's bounding box, ``(F, 2, 3)`` in the grasp frame, at joints ``(J,)``."""
        poses = self._hand.link_poses(joints_rad)[self.links]
        corners_m = [transform_points(pose, points) for pose, points in zip(poses, self._corners_m, strict=True)]
        return np.array([(points.min(0), points.max(0)) for points in corners_m])

    def gaps_m(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return the gap along X from the thumb's tip to each other fingertip, ``(F - 1,)``; negative if they overlap along X."""
        bounds_m = self.bounds_m(joints_rad)
        return np.asarray(bounds_m[1:, 0, 0] - bounds_m[0, 1, 0])

    def reach_m(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return the largest coordinate along +Z of the grasp frame of each fingertip, ``(F,)``, thumb first."""
        return np.asarray(self.bounds_m(joints_rad)[:, 1, 2])

    def centers_m(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return the bounding-box centre of each fingertip, ``(F, 3)`` in the grasp frame, thumb first."""
        return np.asarray(self.bounds_m(joints_rad).mean(axis=1))


def _depth(hand: MultiFingerGripper, index: int) -> int:
    """Return the number of links between a link and the root."""
    depth = 0
    while (index := hand.links[index].parent) >= 0:
        depth += 1
    return depth
