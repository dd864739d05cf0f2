"""How far bodies of convex hulls are apart, and how deep they overlap."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from manitwin.geometry.convex_distance import convex_distances
from manitwin.geometry.placed_object import StaticBox
from manitwin.geometry.poses import transform_points

_AT_ONCE = 4096  # pairs in one go: bounds the memory
_FIRST_PAIRS = 16  # where two bodies meet, the nearest boxes mostly say so
SAME_NORMAL = 1e-4


@dataclass(frozen=True)
class ConvexParts:
    """A body's convex parts in its own frame.

    ``whole (V, 3)`` are the corners of their common convex hull, ``parts (H, M, 3)`` those of each part, the first one
    repeated to equal numbers, ``normals`` the directions ``(K, 3)`` of each part's faces.
    """

    whole: np.ndarray
    parts: np.ndarray
    normals: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, hulls: Sequence[np.ndarray]) -> ConvexParts:
        """Take hulls, each ``(V, 3)`` m."""
        found = [ConvexHull(hull) for hull in hulls]
        corners = [hull.points[hull.vertices] for hull in found]
        most = max(len(each) for each in corners)
        padded = np.array([np.vstack([each, np.repeat(each[:1], most - len(each), 0)]) for each in corners])
        everything = np.vstack(corners)
        whole = everything[ConvexHull(everything).vertices]
        normals = tuple(_distinct(hull.equations[:, :3]) for hull in found)
        return cls(whole, padded, normals)

    @classmethod
    def of_box(cls, box: StaticBox) -> ConvexParts:
        """Take a piece of furniture."""
        corners = np.array(trimesh.creation.box(extents=2 * box.half_extents_m).vertices)
        return cls(corners, corners[None], (np.vstack([np.eye(3), -np.eye(3)]),))

    def at(self, pose: np.ndarray) -> PlacedParts:
        """Return the parts at a pose ``(4, 4)`` of their frame in the world."""
        return PlacedParts(self, pose)


@dataclass(frozen=True)
class PlacedParts:
    """Convex parts at a pose in the world."""

    body: ConvexParts
    pose: np.ndarray

    @cached_property
    def whole(self) -> np.ndarray:
        """The corners of the common convex hull ``(V, 3)``."""
        return transform_points(self.pose, self.body.whole)

    @cached_property
    def parts(self) -> np.ndarray:
        """The corners of each part ``(H, M, 3)``."""
        return self.body.parts @ self.pose[:3, :3].T + self.pose[:3, 3]

    @cached_property
    def part_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest coordinates of each part, ``(H, 3)`` each."""
        return self.parts.min(1), self.parts.max(1)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The least and the largest coordinates of all, ``(3,)`` each."""
        return self.whole.min(0), self.whole.max(0)


def distance(first: PlacedParts, second: PlacedParts, *, beyond_m: float = np.inf) -> float:
    """Return the distance (m) of two bodies, 0 where they overlap; above ``beyond_m`` it is only a lower bound."""
    apart = _box_gap(*first.bounds, *second.bounds)
    if apart > beyond_m:
        return float(apart)
    common = float(convex_distances(first.whole[None], second.whole[None], beyond_m=beyond_m)[0])
    if common > beyond_m or (len(first.parts) == 1 and len(second.parts) == 1):
        return common
    gaps = _part_gaps(first, second).ravel()
    least = np.inf
    order = np.argsort(gaps, kind="stable")
    for start in range(0, len(order), _AT_ONCE):
        chosen = order[start : start + _AT_ONCE]
        chosen = chosen[gaps[chosen] <= min(least, beyond_m)]
        if not len(chosen):
            break
        rows, columns = np.divmod(chosen, len(second.parts))
        found = convex_distances(first.parts[rows], second.parts[columns], beyond_m=min(least, beyond_m))
        least = min(least, float(found.min()))
    return least if np.isfinite(least) else float(max(common, gaps.min()))


def is_clear_of(body: PlacedParts, others: Sequence[PlacedParts], gap_m: float) -> bool:
    """Tell whether no other body is nearer than a gap: by boxes, then by common convex hulls at once, then by parts."""
    near = [other for other in others if _box_gap(*body.bounds, *other.bounds) <= gap_m]
    if not near:
        return True
    most = max(len(other.whole) for other in near)
    wholes = np.array([np.vstack([o.whole, np.repeat(o.whole[:1], most - len(o.whole), 0)]) for o in near])
    apart = convex_distances(np.broadcast_to(body.whole, (len(near), *body.whole.shape)), wholes, beyond_m=gap_m)
    in_doubt = sorted((common, i) for i, common in enumerate(apart.tolist()) if common <= gap_m)
    return not any(_parts_within(body, near[i], gap_m) for _, i in in_doubt)


def _parts_within(first: PlacedParts, second: PlacedParts, gap_m: float) -> bool:
    """Tell whether a part of one is no farther than a gap from a part of the other; the likeliest pairs first."""
    gaps = _part_gaps(first, second).ravel()
    order = np.argsort(gaps, kind="stable")
    order = order[gaps[order] <= gap_m]
    start, size = 0, _FIRST_PAIRS
    while start < len(order):
        rows, columns = np.divmod(order[start : start + size], len(second.parts))
        if (convex_distances(first.parts[rows], second.parts[columns], beyond_m=gap_m) <= gap_m).any():
            return True
        start, size = start + size, min(4 * size, _AT_ONCE)
    return False


def least_distance(pairs: Sequence[tuple[PlacedParts, PlacedParts]]) -> float:
    """Return the distance (m) of the pair that is nearest to each other; infinite without pairs."""
    gaps = [float(_box_gap(*first.bounds, *second.bounds)) for first, second in pairs]
    least = np.inf
    for index in np.argsort(gaps, kind="stable"):
        if gaps[index] >= least:
            break
        least = min(least, distance(*pairs[index], beyond_m=least))
    return float(least)


def overlap_depth(first: PlacedParts, second: PlacedParts) -> float:
    """Return how deep (m) two bodies overlap, 0 where they do not: the deepest pair of their parts.

    The depth of a pair is the shortest way out along a face normal of either. Where two edges cross, a shorter way can be
    along the normal of both; so the answer is never too small.
    """
    if (_box_gap(*first.bounds, *second.bounds) > 0).any():
        return 0.0
    gaps = _part_gaps(first, second)
    deepest = 0.0
    for row, column in np.argwhere(gaps <= 0):
        deepest = max(deepest, _pair_depth(first, int(row), second, int(column)))
    return deepest


def _pair_depth(first: PlacedParts, row: int, second: PlacedParts, column: int) -> float:
    normals = np.vstack(
        [first.body.normals[row] @ first.pose[:3, :3].T, -second.body.normals[column] @ second.pose[:3, :3].T]
    )
    reach = (first.parts[row] @ normals.T).max(0) - (second.parts[column] @ normals.T).min(0)
    return max(0.0, float(reach.min()))


def _part_gaps(first: PlacedParts, second: PlacedParts) -> np.ndarray:
    """Return the distances ``(H1, H2)`` of the parts' boxes: no pair of parts is nearer."""
    return _box_gap(*(bound[:, None] for bound in first.part_bounds), *(bound[None] for bound in second.part_bounds))


def _box_gap(low_a: np.ndarray, high_a: np.ndarray, low_b: np.ndarray, high_b: np.ndarray) -> np.ndarray:
    """Return the distance of axis-aligned boxes; 0 where they overlap."""
    apart = np.maximum(np.maximum(low_a - high_b, low_b - high_a), 0.0)
    return np.sqrt(np.square(apart).sum(-1))


def _distinct(normals: np.ndarray) -> np.ndarray:
    """Return the normals without those of other triangles of the same face."""
    cells = np.round(normals / SAME_NORMAL)
    return normals[np.sort(np.unique(cells, axis=0, return_index=True)[1])]
