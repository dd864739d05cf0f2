"""Does the open hand overlap the object? Boxes of the hand against convex hulls, by separating axes."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.gripper import Gripper

PAIRS_AT_ONCE = 20_000


class HandCollision:
    """The hulls of an object, prepared to be tested against many hand poses."""

    def __init__(self, hulls: tuple[np.ndarray, ...]):
        """Take convex vertices, each ``(V, 3)`` m in the object frame."""
        self._hulls = []
        for vertices in hulls:
            equations = np.unique(ConvexHull(vertices).equations.round(9), axis=0)
            self._hulls.append((vertices.astype(np.float32), equations.astype(np.float32)))
        self._low = np.array([v.min(0) for v in hulls])
        self._high = np.array([v.max(0) for v in hulls])

    def overlaps(
        self, gripper: Gripper, gripper_to_object: np.ndarray, *, opening_m: float, clearance_m: float
    ) -> np.ndarray:
        """Tell for each grasp ``(N, 4, 4)`` whether the hand at an opening comes closer than ``clearance_m`` to a hull."""
        return self.boxes_overlap(gripper.boxes(opening_m), gripper_to_object, clearance_m)

    def boxes_overlap(self, boxes: list[PlacedBox], gripper_to_object: np.ndarray, clearance_m: float) -> np.ndarray:
        """Tell for each grasp ``(N, 4, 4)`` whether one of the boxes comes closer than ``clearance_m`` to a hull.

        The separating axes tried are the normals of box and hull, not the products of their edges (Gottschalk et al.
        1996, section 5): no overlap is missed, and near misses of edge by edge, less than a hull's rounding, count as
        overlaps.
        """
        result = np.zeros(len(gripper_to_object), dtype=bool)
        for box_to_gripper, half_extents_m in boxes:
            index = np.flatnonzero(~result)
            box_to_object = gripper_to_object[index] @ box_to_gripper
            result[index] = self._box_overlaps(box_to_object, half_extents_m + clearance_m)
        return result

    def _box_overlaps(self, box_to_object: np.ndarray, half_m: np.ndarray) -> np.ndarray:
        axes, center = box_to_object[:, :3, :3].astype(np.float32), box_to_object[:, :3, 3].astype(np.float32)
        reach = (np.abs(axes) @ half_m.astype(np.float32))[:, None]
        near = ((center[:, None] + reach >= self._low) & (center[:, None] - reach <= self._high)).all(2)
        hit = np.zeros(len(center), dtype=bool)
        for number, (vertices, equations) in enumerate(self._hulls):
            pairs = np.flatnonzero(near[:, number] & ~hit)
            for start in range(0, len(pairs), PAIRS_AT_ONCE):
                some = pairs[start : start + PAIRS_AT_ONCE]
                hit[some] = _overlap(axes[some], center[some], half_m.astype(np.float32), vertices, equations)
        return hit


def _overlap(
    axes: np.ndarray, center: np.ndarray, half_m: np.ndarray, vertices: np.ndarray, equations: np.ndarray
) -> np.ndarray:
    """Tell whether no normal of the boxes ``(P)`` or of the hull separates them."""
    normals, offsets = equations[:, :3], equations[:, 3]
    gap = center @ normals.T + offsets - np.abs(np.swapaxes(axes, 1, 2) @ normals.T).transpose(0, 2, 1) @ half_m
    apart = (gap > 0).any(1)
    rest = np.flatnonzero(~apart)
    local = (vertices - center[rest, None]) @ axes[rest]
    apart[rest] = ((local.min(1) > half_m) | (local.max(1) < -half_m)).any(1)
    return ~apart
