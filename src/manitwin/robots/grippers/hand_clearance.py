"""Clearance between a hand's boxes and an object's convex hulls: collision of the open hand, and reach of the closing hand.

Hulls that a closing hand cannot reach are left out of a trial, because they cost time in every step and touch nothing.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper

PAIRS_AT_ONCE = 20_000
_SLOPES = [(0.0, 0.0), *((s * a, s * b) for s in (0.3, 1.0, 3.0, 12.0) for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)))]
_SLOPES += [(a, b) for s in (0.5, 2.0) for a in (s, -s) for b in (s, -s)]
_FACING = np.array([(1.0, *slope) for slope in _SLOPES])
"""Normals ``(25, 3)`` of candidate separating planes between a finger and the object, with X component 1."""


class HandCollision:
    """Collision test of an object's hulls against many hand poses."""

    def __init__(self, hulls: tuple[np.ndarray, ...]):
        """Take the vertices of convex hulls, each ``(V, 3)`` m in the object frame."""
        self._hulls = []
        for vertices in hulls:
            equations = np.unique(ConvexHull(vertices).equations.round(9), axis=0)
            self._hulls.append((vertices.astype(np.float32), equations.astype(np.float32)))
        self._low = np.array([v.min(0) for v in hulls])
        self._high = np.array([v.max(0) for v in hulls])

    def overlaps(
        self, gripper: Gripper, gripper_to_object: np.ndarray, *, opening_m: float, clearance_m: float
    ) -> np.ndarray:
        """Tell for each grasp ``(N, 4, 4)`` whether the hand at an opening is closer than ``clearance_m`` to a hull."""
        return self.boxes_overlap(gripper.boxes(opening_m), gripper_to_object, clearance_m)

    def boxes_overlap(self, boxes: list[PlacedBox], gripper_to_object: np.ndarray, clearance_m: float) -> np.ndarray:
        """Tell for each grasp ``(N, 4, 4)`` whether one of the boxes is closer than ``clearance_m`` to a hull.

        The separating axes tested are the face normals of box and hull, without the cross products of edges (Gottschalk et
        al. 1996, section 5). The test is conservative: no overlap is missed, and edge-to-edge near misses smaller than a
        hull's rounding count as overlaps.
        """
        result = np.zeros(len(gripper_to_object), dtype=bool)
        for box_to_gripper, half_extents_m in boxes:
            index = np.flatnonzero(~result)
            box_to_object = gripper_to_object[index] @ box_to_gripper
            result[index] = self._box_overlaps(box_to_object, half_extents_m + clearance_m)
        return result

    def _box_overlaps(self, box_to_object: np.ndarray, half_m: np.ndarray) -> np.ndarray:
        axes, center = box_to_object[:, :3, :3].astype(np.float32), box_to_object[:, :3, 3].astype(np.float32)
        reach = np.abs(axes) @ half_m.astype(np.float32)
        near: np.ndarray = np.ones((len(center), len(self._hulls)), dtype=bool)
        for axis in range(3):  # axis by axis, because NumPy is slow over a last axis of length three
            near &= (center[:, axis] + reach[:, axis])[:, None] >= self._low[:, axis]
            near &= (center[:, axis] - reach[:, axis])[:, None] <= self._high[:, axis]
        hit = np.zeros(len(center), dtype=bool)
        for number in np.flatnonzero(near.any(0)):
            vertices, equations = self._hulls[number]
            pairs = np.flatnonzero(near[:, number] & ~hit)
            for start in range(0, len(pairs), PAIRS_AT_ONCE):
                some = pairs[start : start + PAIRS_AT_ONCE]
                hit[some] = _overlap(axes[some], center[some], half_m.astype(np.float32), vertices, equations)
        return hit


def _overlap(
    axes: np.ndarray, center: np.ndarray, half_m: np.ndarray, vertices: np.ndarray, equations: np.ndarray
) -> np.ndarray:
    """Tell for which of P boxes no face normal of box or hull is a separating axis, ``(P,)`` bool."""
    normals, offsets = equations[:, :3], equations[:, 3]
    gap = center @ normals.T + offsets - np.abs(np.swapaxes(axes, 1, 2) @ normals.T).transpose(0, 2, 1) @ half_m
    apart = (gap > 0).any(1)
    rest = np.flatnonzero(~apart)
    local = (vertices - center[rest, None]) @ axes[rest]
    apart[rest] = ((local.min(1) > half_m) | (local.max(1) < -half_m)).any(1)
    return ~apart


class HandReach:
    """Distances between an object's hulls and a closing hand, for many poses."""

    def __init__(self, hulls: tuple[np.ndarray, ...]):
        """Take the vertices of convex hulls, each ``(V, 3)`` m in the object frame."""
        self._hulls, self._corners = hulls, np.concatenate(hulls)
        self._counts = np.array([len(hull) for hull in hulls])
        self._starts = np.cumsum(self._counts) - self._counts
        low, high = np.minimum.reduceat(self._corners, self._starts), np.maximum.reduceat(self._corners, self._starts)
        self._centers, self._radii_m = (low + high) / 2, np.linalg.norm(high - low, axis=1) / 2

    def subset(self, some: np.ndarray) -> HandReach:
        """Return the ``HandReach`` of a subset of the hulls, ``some (H,)`` bool."""
        return HandReach(tuple(self._hulls[index] for index in np.flatnonzero(some)))

    def gaps_m(self, gripper: ParallelGripper, object_to_gripper: np.ndarray) -> np.ndarray:
        """Return lower bounds ``(P, H)`` m on the distance of palm and closing fingers from each hull.

        ``object_to_gripper (P, 4, 4)`` are object poses. Measured along the gripper's axes, between bounding boxes of the
        hulls and of the volumes that the hand sweeps as it closes. Negative if these boxes overlap.
        """
        rotations, origins = object_to_gripper[:, :3, :3].transpose(0, 2, 1), object_to_gripper[:, None, :3, 3]
        corners = self._corners @ rotations + origins
        low, high = (reduce.reduceat(corners, self._starts, axis=1)[:, :, None] for reduce in (np.minimum, np.maximum))
        swept_low, swept_high = _swept_boxes(gripper)
        return np.maximum(low - swept_high, swept_low - high).max(3).min(2)

    def free_travel_m(
        self, gripper: ParallelGripper, object_to_gripper: np.ndarray, some: np.ndarray, clear_m: float
    ) -> float:
        """Return a lower bound on how far both fingers can close and stay ``clear_m`` from the hulls ``some (H,)``.

        ``object_to_gripper (4, 4)`` is the object's pose. A plane that bounds a hull limits how far the hull reaches towards
        a finger within the volume that the finger sweeps; the tightest of several planes is used. Hulls entirely behind a
        finger are ignored.
        """
        counts = self._counts[some]
        corners = self._corners[np.repeat(some, self._counts)] @ object_to_gripper[:3, :3].T + object_to_gripper[:3, 3]
        starts, travel_m = np.cumsum(counts) - counts, np.inf
        for mirror, (inner_m, back_m, least) in zip(_MIRRORS, _facing_fingers(gripper, clear_m), strict=True):
            behind = np.maximum.reduceat(corners @ (_FACING * mirror).T, starts)
            reached_m = (behind[:, None] - least).min(2)
            reached_m[np.minimum.reduceat(corners[:, :1] * mirror[0], starts) > back_m] = -np.inf
            reached_m = reached_m.max(0)
            travel_m = min(travel_m, float((inner_m - reached_m).min()))
        return travel_m

    def motions_m(self, object_to_gripper: np.ndarray) -> np.ndarray:
        """Return bounds ``(H,)`` on the motion of any vertex of each hull from the first to any of the poses ``(P, 4, 4)``.

        A bounding sphere moves by the displacement of its centre plus its radius times the norm of the change of rotation.
        The largest singular value of a difference of two rotations is its Frobenius norm divided by sqrt(2).
        """
        change = object_to_gripper - object_to_gripper[0]
        moved = self._centers @ change[:, :3, :3].transpose(0, 2, 1) + change[:, None, :3, 3]
        turned = np.linalg.norm(change[:, :3, :3], axis=(1, 2)) / np.sqrt(2)
        return np.asarray((np.linalg.norm(moved, axis=2) + turned[:, None] * self._radii_m).max(0))


# seen from the +X finger, and mirrored for the -X finger
_MIRRORS = (np.array([1.0, 1.0, 1.0]), np.array([-1.0, 1.0, 1.0]))


@lru_cache(maxsize=8)
def _facing_fingers(gripper: ParallelGripper, clear_m: float) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return, per finger of the open hand and seen from it, start and end of its boxes along X ``(B,)``, and plane offsets.

    The offsets ``(B, 25)`` are the minima of the Y and Z terms of ``_FACING`` over the volume that each box sweeps. All boxes
    are enlarged by ``clear_m``.
    """
    boxes, first, count = gripper.boxes(gripper.opening_m), len(gripper.palm_boxes), len(gripper.finger_boxes)
    fingers = []
    for side, mirror in enumerate(_MIRRORS):
        ends = np.array([_bounds(*box) for box in boxes[first + side * count : first + (side + 1) * count]])
        seen = np.sort(ends * mirror, axis=1) + np.array([[-clear_m], [clear_m]])
        least = np.minimum(seen[:, :1, 1:] * _FACING[:, 1:], seen[:, 1:, 1:] * _FACING[:, 1:]).sum(2)
        fingers.append((seen[:, 0, 0], seen[:, 1, 0], least))
    return fingers


@lru_cache(maxsize=8)
def _swept_boxes(gripper: ParallelGripper) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corners ``(B, 3)`` of the volumes that the hand's boxes sweep between open and closed."""
    ends = [[_bounds(*box) for box in gripper.boxes(opening_m)] for opening_m in (gripper.opening_m, 0.0)]
    low, high = np.moveaxis(np.array(ends), 2, 0)
    return low.min(0), high.max(0)


def _bounds(box_to_gripper: np.ndarray, half_extents_m: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    reach = np.abs(box_to_gripper[:3, :3]) @ half_extents_m
    return box_to_gripper[:3, 3] - reach, box_to_gripper[:3, 3] + reach
