"""Heat maps on surface points: density of finger contacts, and geodesic proximity to functional points."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra
from scipy.spatial import cKDTree

from manitwin.geometry.ray_caster import RayCaster

LEAST_SPREAD_M, SPREAD_SHARE = 0.008, 0.04
"""Standard deviation of a contact: half the width of a fingertip, or this share of the diagonal of a large object."""
MOST_OFF_M = 0.008
"""Maximum distance of a ray hit from the recorded fingertip; hits farther away are on another surface."""
FUNCTION_SHARE = 0.15
"""Standard deviation of a functional map, as a share of the diagonal, measured along the surface."""
RIM_SHARE = 0.05
"""The same for an opening, whose map extends around its whole rim: a third as wide, else most of a plate would be rim."""
NEIGHBOURS, LOOKED_AT = 8, 32
"""Number of graph neighbours, and of nearest points they are chosen from: on a thin plate half of those are on its other side."""
POSITIVE = 0.5
"""Map value from which a point counts as positive, as 3D AffordanceNet does for its AUC."""
LEAST_COSINE = -0.2
"""Minimum cosine of the normals of two neighbours; below it, they lie on opposite sides of a thin wall."""


def contact_points(
    caster: RayCaster, gripper_to_object: np.ndarray, width_m: np.ndarray, depth_m: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the contact points ``(C, 3)`` of both fingers of grasps in metres, object frame, and the grasp index ``(C,)`` of
    each.

    ``gripper_to_object (N, 4, 4)`` in the grasp frame (+Z approach, X closing), ``width_m (N,)`` between the contacts, ``depth_m
    (N,)`` of the fingertips along +Z. A ray is cast inward along X from outside each expected contact. Contacts whose ray hits
    nothing within ``MOST_OFF_M`` of them are left out.
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
    """Return the standard deviation in metres of a contact on an object of extents ``(3,)``."""
    return max(LEAST_SPREAD_M, SPREAD_SHARE * float(np.linalg.norm(extents_m)))


def contact_density(points_m: np.ndarray, contacts_m: np.ndarray, spread_m: float) -> np.ndarray:
    """Return the Gaussian density ``(N,)`` of contacts ``(C, 3)`` at points ``(N, 3)``, scaled to a maximum of 1; 0 without
    contacts.
    """
    density = np.zeros(len(points_m))
    for contact in contacts_m:
        density += np.exp(-0.5 * ((points_m - contact) ** 2).sum(1) / spread_m**2)
    return density / density.max() if len(contacts_m) else density


def surface_distances(points_m: np.ndarray, normals: np.ndarray, seeds: np.ndarray) -> np.ndarray:
    """Return geodesic distances ``(S, N)`` from the points with indices ``(S,)`` to all points ``(N, 3)``; inf if not connected.

    Shortest paths (Dijkstra) in a graph of the eight nearest neighbours with compatible normals. Neighbours with opposing normals
    would connect the two sides of a thin wall.
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
    """Return a functional map from geodesic distances: 1 at the point, falling off as a Gaussian, 0 where unreachable."""
    spread_m = share * float(np.linalg.norm(extents_m))
    return np.where(np.isfinite(distance_m), np.exp(-0.5 * (np.minimum(distance_m, 1e3) / spread_m) ** 2), 0.0)


def similarity(one: np.ndarray, other: np.ndarray) -> float:
    """Return SIM of two maps ``(N,)``, their overlap as distributions (Bylinskii et al. 2019); 0 if one is empty."""
    if not one.sum() or not other.sum():
        return 0.0
    return float(np.minimum(one / one.sum(), other / other.sum()).sum())


def split_half_agreement(
    points_m: np.ndarray, one: np.ndarray, other: np.ndarray, spread_m: float
) -> tuple[float, float]:
    """Return SIM of the maps of two halves of the contacts, and the AUC of the first for the positive points of the second.

    ``points_m (N, 3)``, contacts ``(C, 3)`` each; positive points are those from ``POSITIVE``.
    """
    first, second = (contact_density(points_m, contacts, spread_m) for contacts in (one, other))
    return similarity(first, second), area_under_curve(first, second >= POSITIVE)


def area_under_curve(scores: np.ndarray, positive: np.ndarray) -> float:
    """Return the area under the ROC curve of scores ``(N,)`` for positives ``(N,) bool``; ties count half, NaN if undefined."""
    count = int(positive.sum())
    others = len(positive) - count
    if not count or not others:
        return float("nan")
    _, inverse, counts = np.unique(scores, return_inverse=True, return_counts=True)
    ranks = (np.cumsum(counts) - (counts - 1) / 2)[inverse]
    return float((ranks[positive].sum() - count * (count + 1) / 2) / (count * others))
