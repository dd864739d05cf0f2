"""Distance and overlap of bodies composed of convex hulls, and batched distances of pairs of convex point sets.

Source: Gilbert, Johnson and Keerthi 1988, "A fast procedure for computing the distance between complex objects". The point of a
simplex nearest to the origin is found by testing all of its faces, which is as exact as their recursion and can be vectorized
over all pairs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from manitwin.geometry.poses import transform_points
from manitwin.geometry.rigid_body import StaticBox

_AT_ONCE = 4096  # pairs of parts per call, to bound the memory
_FIRST_PAIRS = 16  # tried first: bodies that touch mostly do so in one of the pairs with the nearest boxes
SAME_NORMAL = 1e-4  # normals that differ by less in each coordinate belong to one flat face

MAX_ITERATIONS = 60
TOLERANCE_M = 1e-7  # error of the distance, far below all gaps and overlaps of interest
_EDGES = np.array([(0, 1), (0, 2), (0, 3), (1, 2), (1, 3), (2, 3)])
_FACES = np.array([(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)])
_OPPOSITE = np.array([3, 2, 1, 0])  # the corner opposite to each face
_FLAT = 1e-18  # squared volume or area relative to that of the edges, below which it is rounding error


@dataclass(frozen=True)
class ConvexParts:
    """The convex parts of a body in its own frame.

    ``whole (V, 3)`` are the vertices of their common convex hull; ``parts (H, M, 3)`` those of each part, padded to equal
    length with its first vertex; ``normals`` the distinct face normals ``(K, 3)`` of each part.
    """

    whole: np.ndarray
    parts: np.ndarray
    normals: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, hulls: Sequence[np.ndarray]) -> ConvexParts:
        """Build the parts from hulls, each ``(V, 3)`` m."""
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
        """Build a single part from a static box."""
        corners = np.array(trimesh.creation.box(extents=2 * box.half_extents_m).vertices)
        return cls(corners, corners[None], (np.vstack([np.eye(3), -np.eye(3)]),))

    def at(self, pose: np.ndarray) -> PlacedParts:
        """Return the parts at a pose ``(4, 4)`` in the world."""
        return PlacedParts(self, pose)


@dataclass(frozen=True)
class PlacedParts:
    """Convex parts at a pose in the world."""

    body: ConvexParts
    pose: np.ndarray

    @cached_property
    def whole(self) -> np.ndarray:
        """The vertices of the common convex hull ``(V, 3)``."""
        return transform_points(self.pose, self.body.whole)

    @cached_property
    def parts(self) -> np.ndarray:
        """The vertices of each part ``(H, M, 3)``."""
        return self.body.parts @ self.pose[:3, :3].T + self.pose[:3, 3]

    @cached_property
    def part_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The lower and upper bounds of each part, ``(H, 3)`` each."""
        return self.parts.min(1), self.parts.max(1)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """The lower and upper bounds of the body, ``(3,)`` each."""
        return self.whole.min(0), self.whole.max(0)


def distance(first: PlacedParts, second: PlacedParts, *, beyond_m: float = np.inf) -> float:
    """Return the distance (m) between two bodies, 0 if they overlap; a result above ``beyond_m`` is only a lower bound."""
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
    """Return whether no other body is closer than ``gap_m``; tested by boxes, then common convex hulls (batched), then parts."""
    near = [other for other in others if _box_gap(*body.bounds, *other.bounds) <= gap_m]
    if not near:
        return True
    most = max(len(other.whole) for other in near)
    wholes = np.array([np.vstack([o.whole, np.repeat(o.whole[:1], most - len(o.whole), 0)]) for o in near])
    apart = convex_distances(np.broadcast_to(body.whole, (len(near), *body.whole.shape)), wholes, beyond_m=gap_m)
    in_doubt = sorted((common, i) for i, common in enumerate(apart.tolist()) if common <= gap_m)
    return not any(_parts_within(body, near[i], gap_m) for _, i in in_doubt)


def _parts_within(first: PlacedParts, second: PlacedParts, gap_m: float) -> bool:
    """Return whether any two parts are within ``gap_m``; pairs with the nearest boxes are tested first."""
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
    """Return the distance (m) of the closest pair; infinite without pairs."""
    gaps = [float(_box_gap(*first.bounds, *second.bounds)) for first, second in pairs]
    least = np.inf
    for index in np.argsort(gaps, kind="stable"):
        if gaps[index] >= least:
            break
        least = min(least, distance(*pairs[index], beyond_m=least))
    return float(least)


def overlap_depth(first: PlacedParts, second: PlacedParts) -> float:
    """Return the overlap depth (m) of two bodies, 0 if they are disjoint: that of their deepest pair of parts.

    The depth of a pair is the shortest separating translation along a face normal of either part. For crossing edges, a shorter
    one may exist along their common normal, so the depth is never underestimated.
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
    """Return the distances ``(H1, H2)`` m between the parts' bounding boxes, which are lower bounds for the parts."""
    return _box_gap(*(bound[:, None] for bound in first.part_bounds), *(bound[None] for bound in second.part_bounds))


def _box_gap(low_a: np.ndarray, high_a: np.ndarray, low_b: np.ndarray, high_b: np.ndarray) -> np.ndarray:
    """Return the distance between axis-aligned boxes; 0 if they overlap."""
    apart = np.maximum(np.maximum(low_a - high_b, low_b - high_a), 0.0)
    return np.sqrt(np.square(apart).sum(-1))


def _distinct(normals: np.ndarray) -> np.ndarray:
    """Return one normal for each flat face, however many triangles it has: ``(K, 3)``."""
    cells = np.round(normals / SAME_NORMAL)
    return normals[np.sort(np.unique(cells, axis=0, return_index=True)[1])]


def convex_distances(first: np.ndarray, second: np.ndarray, *, beyond_m: float = np.inf) -> np.ndarray:
    """Return the distances ``(P,)`` between the convex hulls of points ``(P, A, 3)`` and ``(P, B, 3)``; 0 if they overlap.

    For a distance above ``beyond_m``, the result may be a lower bound that is itself above ``beyond_m``.
    """
    pairs = len(first)
    result = np.zeros(pairs)
    direction = second[:, 0] - first[:, 0]
    corners = np.repeat(support(first, second, direction)[:, None], 4, axis=1)
    active = np.arange(pairs)
    for _ in range(MAX_ITERATIONS):
        if not len(active):
            break
        nearest, used, inside = nearest_on_simplex(corners)
        squared = np.einsum("pi,pi->p", nearest, nearest)
        length = np.sqrt(squared)
        farthest = support(first[active], second[active], -nearest)
        bound = np.einsum("pi,pi->p", nearest, farthest) / np.maximum(length, 1e-300)
        inside |= length < TOLERANCE_M
        result[active] = np.where(inside, 0.0, np.where(bound > beyond_m, bound, length))
        going = ~(inside | (length - bound < TOLERANCE_M) | (bound > beyond_m))
        corners = np.where(used[..., None], corners, farthest[:, None])[going]
        active = active[going]
    return result


def support(first: np.ndarray, second: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """Return the support point of the Minkowski difference ``first - second`` along each direction, ``(P, 3)``."""
    rows = np.arange(len(first))
    ahead = first[rows, np.matmul(first, direction[..., None])[..., 0].argmax(1)]
    behind = second[rows, np.matmul(second, direction[..., None])[..., 0].argmin(1)]
    difference: np.ndarray = ahead - behind
    return difference


def nearest_on_simplex(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the point of each simplex nearest to the origin ``(P, 3)``, a mask of the corners spanning it ``(P, 4)``, and
    containment.

    ``corners (P, 4, 3)`` may contain duplicates: a simplex of lower dimension repeats some. Containment ``(P,) bool`` states
    whether the tetrahedron contains the origin.
    """
    rows = np.arange(len(corners))
    on_edges, along = _nearest_on_edges(corners)
    on_faces, within = _nearest_on_faces(corners)
    points = np.concatenate([on_edges, on_faces], axis=1)
    squared = np.einsum("pki,pki->pk", points, points)
    squared[:, 6:][~within] = np.inf
    best = squared.argmin(1)
    used = np.zeros((len(corners), 4), dtype=bool)
    edge, face = best < 6, best >= 6
    for side, share in ((0, 1 - along), (1, along)):
        of_edge = _EDGES[best[edge], side]
        used[rows[edge], of_edge] = share[rows[edge], best[edge]] > 0
    for side in range(3):
        used[rows[face], _FACES[best[face] - 6, side]] = True
    return points[rows, best], used, _holds_origin(corners)


def _nearest_on_edges(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    start, end = corners[:, _EDGES[:, 0]], corners[:, _EDGES[:, 1]]
    edge = end - start
    length2 = np.einsum("pki,pki->pk", edge, edge)
    along = -np.einsum("pki,pki->pk", start, edge) / np.where(length2 > 0, length2, 1.0)
    along = np.clip(along, 0.0, 1.0)
    return start + along[..., None] * edge, along


def _nearest_on_faces(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the projections of the origin onto the planes of the four faces, and whether each lies inside its face."""
    a, b, c = (corners[:, _FACES[:, k]] for k in range(3))
    normal = _cross(b - a, c - a)
    area2 = np.einsum("pki,pki->pk", normal, normal)
    size = np.einsum("pki,pki->pk", b - a, b - a) + np.einsum("pki,pki->pk", c - a, c - a)
    solid = area2 > _FLAT * size**2
    foot = normal * (np.einsum("pki,pki->pk", a, normal) / np.where(solid, area2, 1.0))[..., None]
    within = solid
    for p, q in ((a, b), (b, c), (c, a)):
        within = within & (np.einsum("pki,pki->pk", _cross(p - foot, q - foot), normal) >= 0)
    return foot, within


def _holds_origin(corners: np.ndarray) -> np.ndarray:
    a, b, c = (corners[:, _FACES[:, k]] for k in range(3))
    normal = _cross(b - a, c - a)
    opposite = np.einsum("pki,pki->pk", corners[:, _OPPOSITE] - a, normal)
    origin = -np.einsum("pki,pki->pk", a, normal)
    edges = corners[:, 1:] - corners[:, :1]
    size = np.einsum("pki,pki->pk", edges, edges).max(1)
    solid = opposite[:, 0] ** 2 > _FLAT * size**3
    return solid & ((opposite * origin) >= 0).all(1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    # four times as fast as numpy.cross for small arrays
    result = np.empty(a.shape)
    ax, ay, az, bx, by, bz = a[..., 0], a[..., 1], a[..., 2], b[..., 0], b[..., 1], b[..., 2]
    result[..., 0] = ay * bz - az * by
    result[..., 1] = az * bx - ax * bz
    result[..., 2] = ax * by - ay * bx
    return result
