"""Maps on surface points: where fingers touch, and how near a point is along the surface."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from manitwin.geometry.ray_caster import RayCaster

LEAST_SPREAD_M, SPREAD_SHARE = 0.008, 0.04
"""The standard deviation of a contact: a fingertip's half width, or this share of the diagonal of a large object."""
MOST_OFF_M = 0.008
"""A contact that a ray finds farther from where the fingers closed is another surface's."""
FUNCTION_SHARE = 0.15
"""A functional map falls by ``exp(-1/2)`` in this share of the diagonal, along the surface."""
RIM_SHARE = 0.05
"""The same of an opening, whose map lies all around it: a third as wide, or most of a plate would be its rim."""
NEIGHBOURS, LOOKED_AT = 8, 32
"""So many neighbours, of so many that are nearest: of a thin plate half of these are on its other side."""
POSITIVE = 0.5
"""A point is one of an affordance from this value of its map on, as 3D AffordanceNet takes it for its AUC."""
LEAST_COSINE = -0.2
"""Of the normals of two neighbours: less, and they are on opposite sides of a thin wall."""


def contact_points(
    caster: RayCaster, gripper_to_object: np.ndarray, width_m: np.ndarray, depth_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return where both fingers of grasps touch ``(C, 3)``, and the grasp ``(C,)`` of each; m, object frame.

    ``gripper_to_object (N, 4, 4)`` in the grasp frame (+Z approach, X closing), ``width_m (N,)`` between the contacts,
    ``depth_m (N,)`` of the fingertips along +Z. From outside of each contact a ray goes inward along X; a contact whose ray
    meets nothing within ``MOST_OFF_M`` of it is left out.
    """
    middles = gripper_to_object[:, :3, 3] + depth_m[:, None] * gripper_to_object[:, :3, 2]
    points, grasps = [], []
    for side in (1.0, -1.0):
        outward = side * gripper_to_object[:, :3, 0]
        expected = middles + width_m[:, None] / 2 * outward
        distance_m, face = caster.first_hits(expected + MOST_OFF_M * outward, -outward)
        near = (face >= 0) & (np.abs(distance_m - MOST_OFF_M) <= MOST_OFF_M)
        points.append((expected + (MOST_OFF_M - np.where(near, distance_m, 0.0))[:, None] * outward)[near])
        grasps.append(np.flatnonzero(near))
    return np.concatenate(points), np.concatenate(grasps)


def contact_spread_m(extents_m: np.ndarray) -> float:
    """Return the standard deviation of a contact on an object of extents ``(3,)``."""
    return max(LEAST_SPREAD_M, SPREAD_SHARE * float(np.linalg.norm(extents_m)))


def contact_density(points_m: np.ndarray, contacts_m: np.ndarray, spread_m: float) -> np.ndarray:
    """Return the density ``(N,)`` of contacts ``(C, 3)`` at points ``(N, 3)``, Gaussian, the largest being 1; 0 without any."""
    density = np.zeros(len(points_m))
    for contact in contacts_m:
        density += np.exp(-0.5 * ((points_m - contact) ** 2).sum(1) / spread_m**2)
    return density / density.max() if len(contacts_m) else density


def surface_distances(points_m: np.ndarray, normals: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Return how far ``(S, N)`` points ``(N, 3)`` are from some of them (indices ``(S,)``), along the surface; inf: not joined.

    Shortest ways over a graph of the eight nearest whose normals do not oppose: those would be through a thin wall.
    """
    asked = min(LOOKED_AT, len(points_m) - 1)
    distance_m, index = cKDTree(points_m).query(points_m, asked + 1)
    distance_m, index = distance_m[:, 1:], index[:, 1:]
    joined = (normals[:, None] * normals[index]).sum(2) > LEAST_COSINE
    joined &= np.cumsum(joined, axis=1) <= NEIGHBOURS
    one, place = np.nonzero(joined)
    graph = coo_matrix((distance_m[one, place], (one, index[one, place])), shape=(len(points_m),) * 2)
    return np.asarray(dijkstra(graph.tocsr(), directed=False, indices=seeds))


def function_map(distance_m: np.ndarray, extents_m: np.ndarray, share: float = FUNCTION_SHARE) -> np.ndarray:
    """Return a functional map from distances along the surface: 1 at the point, 0 where it cannot be reached."""
    spread_m = share * float(np.linalg.norm(extents_m))
    return np.where(np.isfinite(distance_m), np.exp(-0.5 * (np.minimum(distance_m, 1e3) / spread_m) ** 2), 0.0)


def similarity(one: np.ndarray, other: np.ndarray) -> float:
    """Return SIM of two maps ``(N,)``: the overlap of both as distributions (Bylinskii et al. 2019); 0 where one is empty."""
    if not one.sum() or not other.sum():
        return 0.0
    return float(np.minimum(one / one.sum(), other / other.sum()).sum())


def halves_agreement(points_m: np.ndarray, one: np.ndarray, other: np.ndarray, spread_m: float) -> tuple[float, float]:
    """Return SIM of the maps of two halves of contacts, and the AUC of the first for the points of the second's (``POSITIVE``).

    ``points_m (N, 3)``, contacts ``(C, 3)`` each.
    """
    first, second = (contact_density(points_m, contacts, spread_m) for contacts in (one, other))
    return similarity(first, second), area_under_curve(first, second >= POSITIVE)


def area_under_curve(scores: np.ndarray, positive: np.ndarray) -> float:
    """Return the area under the ROC curve of scores ``(N,)`` for the points ``(N,) bool`` that are positive; ties count half."""
    count = int(positive.sum())
    others = len(positive) - count
    if not count or not others:
        return float("nan")
    _, inverse, counts = np.unique(scores, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2)[inverse]
    return float((ranks[positive].sum() - count * (count + 1) / 2) / (count * others))
