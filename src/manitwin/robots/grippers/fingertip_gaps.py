"""The distance between thumb and fingers of a hand with many joints, as the links of its URDF have it."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, cKDTree

from manitwin.geometry.poses import inverse, transform_points
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.links import LinkShape

SPACING_M = 0.003
"""Of points on a fingertip: facing surfaces 1 cm apart are measured up to 0.4 mm too far."""
MOST_SPACED = 20.0
"""Sides of a tip are cut into no more pieces than this."""


class Fingertips:
    """The last link with a shape of each finger, the thumb's first: points on its shapes, and the planes around them."""

    def __init__(self, hand: MultiFingerGripper):
        """Take a hand; raises ValueError where a finger has no collision shape."""
        self._hand, names = hand, [link.name for link in hand.links]
        self.links: list[int] = []
        for number, finger in enumerate(hand.fingers):
            shaped = [index for index in map(names.index, finger) if hand.links[index].shapes]
            if not shaped:
                raise ValueError(
                    f"fingers: finger {number} ({', '.join(finger)}) has no <collision> in the URDF, so that it can touch"
                    " nothing; name its links that have one, or give them one"
                )
            self.links.append(max(shaped, key=lambda index: len(_ancestors(hand, index))))
        parts = [[_solid(shape) for shape in hand.links[index].shapes] for index in self.links]
        self._points_m = [np.concatenate([points for points, _ in solids]) for solids in parts]
        self._planes = [[(points.min(0), points.max(0), planes) for points, planes in solids] for solids in parts]

    def points_m(self, joints_rad: np.ndarray) -> list[np.ndarray]:
        """Return points on each fingertip ``(P, 3)`` in the grasp frame, at joints ``(J,)``."""
        poses = self._hand.link_poses(joints_rad)[self.links]
        return [transform_points(pose, points) for pose, points in zip(poses, self._points_m, strict=True)]

    def gaps_m(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return the distance of the thumb's tip from each other fingertip ``(F - 1,)``, zero where they overlap."""
        poses, tips = self._hand.link_poses(joints_rad)[self.links], self.points_m(joints_rad)
        near = cKDTree(tips[0])
        return np.array(
            [
                0.0
                if self._is_inside(0, poses[0], tips[other]) or self._is_inside(other, poses[other], tips[0])
                else float(near.query(tips[other])[0].min())
                for other in range(1, len(tips))
            ]
        )

    def reach_m(self, joints_rad: np.ndarray) -> np.ndarray:
        """Return how far along +Z of the grasp frame each fingertip reaches ``(F,)``, the thumb's first."""
        return np.array([points[:, 2].max() for points in self.points_m(joints_rad)])

    def _is_inside(self, finger: int, pose: np.ndarray, points_m: np.ndarray) -> bool:
        local_m = transform_points(inverse(pose), points_m)
        for low_m, high_m, planes in self._planes[finger]:
            some = local_m[((local_m > low_m) & (local_m < high_m)).all(axis=1)]
            if len(some) and (some @ planes[:, :3].T + planes[:, 3] < 0).all(axis=1).any():
                return True
        return False


def _ancestors(hand: MultiFingerGripper, index: int) -> list[int]:
    found = []
    while (index := hand.links[index].parent) >= 0:
        found.append(index)
    return found


def _solid(shape: LinkShape) -> tuple[np.ndarray, np.ndarray]:
    """Return points on a shape ``(P, 3)``, and outward planes ``(E, 4)`` around it, both in the link's frame."""
    if shape.half_extents_m is not None:
        mesh = trimesh.creation.box(2 * shape.half_extents_m)
    elif shape.radius_m is not None:
        mesh = trimesh.creation.icosphere(3, shape.radius_m)
    elif shape.corners_m is not None:
        mesh = trimesh.convex.convex_hull(shape.corners_m)
    else:
        raise AssertionError("a shape is a box, a sphere or corners")
    corners_m = transform_points(shape.shape_to_link, np.asarray(mesh.vertices))
    edge_m = max(SPACING_M, float(np.ptp(corners_m, axis=0).max()) / MOST_SPACED)
    points_m, _ = trimesh.remesh.subdivide_to_size(corners_m, mesh.faces, edge_m, max_iter=20)
    _, one_of_each_cell = np.unique(np.floor(np.asarray(points_m) / SPACING_M), axis=0, return_index=True)
    return np.asarray(points_m)[np.sort(one_of_each_cell)], np.unique(ConvexHull(corners_m).equations.round(9), axis=0)
