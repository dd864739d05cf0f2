"""Which grasps have room for the hand beside the boxes of the furniture: all at once, before anything is planned."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.episodes.planning.convex_shapes import corners_of
from manitwin.episodes.planning.kinematic_body import KinematicBody
from manitwin.geometry.poses import inverse
from manitwin.geometry.rigid_body import StaticBox


class HandRoom:
    """The corners of a hand's shapes in the grasp frame: a hand one of whose corners is inside a box has no room there.

    It is the cheap half of a test: a hand that passes may still overlap a box by an edge.
    """

    def __init__(self, hand: KinematicBody):
        """Take the corners of the common hull of the shapes that have corners."""
        pieces = [points for shape in hand.geometry.geometryObjects if (points := corners_of(shape)) is not None]
        points = np.concatenate(pieces)
        self._corners = np.concatenate([points[ConvexHull(points).vertices]])

    def is_inside(self, gripper_to_world: np.ndarray, boxes: tuple[StaticBox, ...], clearance_m: float) -> np.ndarray:
        """Tell for each pose ``(N, 4, 4)`` whether a corner is nearer to a box than ``clearance_m``."""
        inside = np.zeros(len(gripper_to_world), dtype=bool)
        for box in boxes:
            to_box = inverse(box.box_to_world) @ gripper_to_world
            reach = np.asarray(box.half_extents_m) + clearance_m
            deep = np.ones((len(to_box), len(self._corners)), dtype=bool)
            for axis in (2, 0, 1):
                along = to_box[:, axis, :3] @ self._corners.T + to_box[:, axis, 3, None]
                deep &= np.abs(along) < reach[axis]
            inside |= deep.any(1)
        return inside
