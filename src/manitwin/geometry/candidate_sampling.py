"""Candidate points for functional and grasp points: farthest point sampling, denser at edges, plus centres and extremities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from manitwin.geometry.cavity import Opening

_NEIGHBOURS = 16
_OTHER_SIDE = -0.5  # cosine of normals: a neighbour across a thin wall carries no information on curvature
_BEND = 0.06  # 1 minus the length of the mean normal; a right-angled edge has 0.29, a cylinder of 20 neighbour distances 0.003
_WEIGHT = 1.0  # relative increase of the sampling distance at an edge
_MIDDLES, _BUMPS, _ENDS = 7, 4, 6  # the largest number of each among the candidates
_FLAT = 0.985  # length of the mean normal; a quarter of a cylinder has 0.90, a dome of 20 degrees to each side 0.97
_SMALL_SHARE = 0.06  # fraction of the longest side: largest half width of a button
_APART_SHARE = 0.06  # fraction of the longest side: centres and extremities closer together are merged
_RESTING_SHARE, _RESTING_COSINE = 0.015, -0.8  # fraction of the longest side above the lowest point; a downward normal
_FLOOR_DEPTH, _FLOOR_COSINE = 0.5, 0.5  # fraction of the depth below the rim; normal along the opening's axis
_UPWARD = 0.9  # cosine; the hollow of a lid has no floor to place things on
_FLOOR_SHARE = 0.5  # fraction of the rim's radius; no view shows the very centre of a deep vessel
MOST_RESTING = 0.2
"""The largest share of candidates on the resting underside."""


@dataclass(frozen=True)
class _Bends:
    """Surface bending at samples ``(N,)`` in [0, 1], and distance to the nearest edge ``(N,)`` m (inf: no edge)."""

    weight: np.ndarray
    inner_m: np.ndarray


def sample_candidates(
    points_m: np.ndarray, normals: np.ndarray, count: int, opening: Opening | None = None
) -> np.ndarray:
    """Return the indices of ``count`` of the surface samples ``(N, 3)`` m with outward normals ``(N, 3)``.

    First come the centres of the floor and underside of a vessel (given its ``opening``), the centres of flat regions, the tops
    of bumps and the extremities. The rest is farthest point sampling (paper, eq. 1) with distances weighted up to twofold where
    the surface bends: rims, edges, tips. At most a fifth of the points lie on the resting underside. Returns all indices if
    there are no more than ``count``.
    """
    if len(points_m) <= count:
        return np.arange(len(points_m))
    size_m = float(np.ptp(points_m, axis=0).max())
    tree = cKDTree(points_m)
    bends = _bends(tree, points_m, normals)
    resting = _resting(points_m, normals, size_m)
    room = max(1, int(MOST_RESTING * count))
    chosen: list[int] = []
    floor = [] if opening is None else _floor(points_m, normals, opening)
    for index in _places(tree, points_m, normals, bends, size_m, floor):
        if len(chosen) < count and not (resting[index] and resting[chosen].sum() >= room):
            chosen.append(index)
    if not chosen:
        chosen = [int(((points_m - points_m.mean(0)) ** 2).sum(1).argmax())]
    far = np.min([np.linalg.norm(points_m - points_m[i], axis=1) for i in chosen], axis=0)
    free = np.ones(len(points_m), dtype=bool)
    while len(chosen) < count:
        if resting[chosen].sum() >= room and not resting.all():
            free &= ~resting
        index = int(np.where(free, far * (1 + _WEIGHT * bends.weight), -1.0).argmax())
        chosen.append(index)
        far = np.minimum(far, np.linalg.norm(points_m - points_m[index], axis=1))
    return np.array(chosen)


def _floor(points_m: np.ndarray, normals: np.ndarray, opening: Opening) -> list[int]:
    """Return the samples at the centre of a vessel's floor and underside; empty if it has no floor, such as a funnel."""
    if opening.axis[2] < _UPWARD:
        return []
    offset, up = points_m - opening.center_m, normals @ opening.axis
    above = offset @ opening.axis
    off_axis = np.linalg.norm(offset - above[:, None] * opening.axis, axis=1)
    floor = (above < -_FLOOR_DEPTH * opening.depth_m) & (up > _FLOOR_COSINE)
    underside = (above < -opening.depth_m) & (up < -_FLOOR_COSINE)
    middles = [int(np.where(side, off_axis, np.inf).argmin()) for side in (floor, underside) if side.any()]
    return [index for index in middles if off_axis[index] < _FLOOR_SHARE * opening.rim_radius_m] if floor.any() else []


def _bends(tree: cKDTree, points_m: np.ndarray, normals: np.ndarray) -> _Bends:
    around = tree.query(points_m, _NEIGHBOURS)[1]
    same = np.einsum("nkj,nj->nk", normals[around], normals) > _OTHER_SIDE
    mean = np.einsum("nk,nkj->nj", same, normals[around]) / same.sum(1, keepdims=True)
    bend = 1 - np.linalg.norm(mean, axis=1)
    edges = bend > _BEND
    inner = np.full(len(points_m), np.inf)
    if edges.any():
        inner = cKDTree(points_m[edges]).query(points_m)[0]
    return _Bends(np.clip(bend / 0.29, 0, 1), inner)


def _resting(points_m: np.ndarray, normals: np.ndarray, size_m: float) -> np.ndarray:
    lowest = points_m[:, 2] - points_m[:, 2].min()
    return np.asarray((lowest < _RESTING_SHARE * size_m) & (normals[:, 2] < _RESTING_COSINE))


def _places(
    tree: cKDTree, points_m: np.ndarray, normals: np.ndarray, bends: _Bends, size_m: float, floor: list[int]
) -> list[int]:
    """Return ``floor`` and samples at extremities, centres of flat regions and on bumps, with a minimum mutual distance."""
    spacing = float(np.median(tree.query(points_m[:500], 2)[0][:, 1]))
    middles, bumps = _middles(tree, points_m, normals, bends, size_m, 2.5 * spacing)
    found: list[int] = []
    for group in (floor, _ends(points_m, size_m), middles, bumps):
        for index in group:
            apart = np.linalg.norm(points_m[found] - points_m[index], axis=1) if found else np.array([np.inf])
            near = _APART_SHARE * size_m
            turned = normals[found] @ normals[index] < 0 if found else np.array([True])
            if (apart[~turned] > near).all():
                found.append(index)
    return found


def _middles(
    tree: cKDTree, points_m: np.ndarray, normals: np.ndarray, bends: _Bends, size_m: float, least_m: float
) -> tuple[list[int], list[int]]:
    """Return the samples at the centres of regions enclosed by edges, widest first, and separately those of small raised
    regions.
    """
    middles: list[int] = []
    bumps: list[int] = []
    left = np.isfinite(bends.inner_m) & (bends.inner_m > least_m)
    for _ in range(60):
        if not left.any() or (len(middles) >= _MIDDLES and len(bumps) >= _BUMPS):
            break
        top = int(np.where(left, bends.inner_m, -1.0).argmax())
        half = float(bends.inner_m[top])
        around = np.array(tree.query_ball_point(points_m[top], max(3.0 * half, least_m)))
        alike = around[normals[around] @ normals[top] > 0.8]
        plateau = alike[bends.inner_m[alike] > 0.85 * half]  # for an elongated region, the middle of its medial ridge
        middle = points_m[plateau].mean(0)
        index = int(plateau[np.linalg.norm(points_m[plateau] - middle, axis=1).argmin()])
        if np.linalg.norm(normals[alike].mean(0)) < _FLAT:
            pass  # the side of a round object has no centre
        elif half > _SMALL_SHARE * size_m:
            middles += [index] if len(middles) < _MIDDLES else []
        elif len(bumps) < _BUMPS and _is_raised(points_m[around], points_m[top], normals[top], half):
            bumps.append(index)
        left[alike] = False
        left[top] = False
    return middles, bumps


def _is_raised(around_m: np.ndarray, top_m: np.ndarray, normal: np.ndarray, half_m: float) -> bool:
    offset = around_m - top_m
    height = offset @ normal
    across = np.linalg.norm(offset - height[:, None] * normal, axis=1)
    ring = (across > 1.5 * half_m) & (height > -4 * half_m)
    return ring.sum() > 5 and bool(np.mean(height[ring] < -0.1 * half_m) > 0.8)


def _ends(points_m: np.ndarray, size_m: float) -> list[int]:
    """Return the samples farthest from the box centre within a radius of a fifth of the longest side, farthest first."""
    away = np.linalg.norm(points_m - (points_m.min(0) + points_m.max(0)) / 2, axis=1)
    left, found = away > 0.35 * size_m, list[int]()
    while left.any() and len(found) < _ENDS:
        index = int(np.where(left, away, -1.0).argmax())
        near = np.linalg.norm(points_m - points_m[index], axis=1) < 0.2 * size_m
        found.append(index)
        left &= ~near
    return found
