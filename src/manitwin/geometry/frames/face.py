"""Faces, buttons and places of the surface as frames."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.distance import closest_points_on_triangles
from manitwin.geometry.frames.feature import UP, FeatureFrame, Found, FramedMesh, Unclear, rotation_of
from manitwin.geometry.frames.on_feature import ON_FEATURE_M
from manitwin.geometry.frames.patch import Patch, flat_patch

_ANGLE_RAD = np.radians(20.0)  # of the patch's normal: a scanned mallet's face, flat to 0.9 mm, is within that
_SLAB_SHARE, _LEAST_SLAB_M = 0.012, 0.0008  # of the longest side: half of a patch's thickness
_SEARCH_SHARE = 0.12  # of the longest side: a candidate for a face may lie on the side next to it, at its border
_WIDE_SHARE = 0.35  # of the longest side, where the word says which side the face is on
_RECESS = 0.12  # of the extent in the direction of the word: what lies deeper is an inside, no base or top
_ROUGH_SHARE = 0.12  # RMS distance from the plane by the patch's radius: a ball's cap is rounder
_LEAST_RADIUS_SHARE = 0.012  # of the longest side: a smaller flat is a facet of something round
_OBLONG = 1.15  # longer by shorter side from which a face's roll is not free
_RAISED_M = 0.0002  # a button stands out, or lies deeper, by more
_END_ON = 1.1  # matter behind an end by the end's width
_BUTTON_SEARCH = 0.05  # of the longest side
_FACING_COSINE = 0.85  # of a button's top and the point: a bevel beside it is not pressed
_ON_BUTTON = 0.012  # of the longest side: how far the point may be from the patch
_BUTTON_SHARE = 0.1
"""Of the longest side: a larger radius is a face (0.057 at most among the templates of the tuning half)."""
_BUTTON_ROUGH = 0.05
"""RMS distance from the plane by the radius: what is rounder is a bump whose middle is not known (0.005)."""


def face_frame(
    surface: FramedMesh,
    point_m: np.ndarray,
    normal: np.ndarray,
    towards: np.ndarray | None = None,
    end_on: bool = False,
) -> Found:
    """Return the flat face that a surface point with a normal ``(3,)`` is on or beside: centre, Z out, radius.

    ``towards (3,)`` is the direction that the face must look in (within 45 degrees) where the word for it says so. ``end_on``:
    it is the end of something, with more matter behind it than it is wide, as a hammer's face is and its cheeks are not.
    """
    share = _SEARCH_SHARE if towards is None else _WIDE_SHARE
    found = [p for p in _patches(surface, point_m, normal, towards, share) if _is_face(surface, p)]
    if towards is not None:
        found = [patch for patch in found if _recess_share(surface, patch, towards) < _RECESS]
    if end_on:
        found = [patch for patch in found if _depth(surface, patch) > _END_ON]
    if not found:
        return Unclear("no flat end is where the point is" if end_on else "nothing flat is where the point is")
    if end_on:
        best = max(found, key=lambda patch: _depth(surface, patch) - _away(patch, surface, point_m) / _radius(patch))
    elif towards is not None:  # the word says which side: there it is the largest, not the ring around a recess
        best = max(found, key=lambda patch: patch.area_m2 * max(float(patch.normal @ towards), 0.0) ** 4)
    else:
        best = max(found, key=lambda patch: _fit(surface, patch, point_m, normal))
    oblong = best.elongation > _OBLONG
    x = best.long_axis * (1 if best.long_axis @ np.array([1.0, 0.1, 0.01]) > 0 else -1) if oblong else UP
    return FeatureFrame("face", best.center_m, rotation_of(best.normal, x), _radius(best), not oblong)


def button_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray) -> Found:
    """Return the top of the button that a surface point is on: a small patch that stands out of what is around it."""
    found = [
        patch
        for patch in _patches(surface, point_m, normal, None, _BUTTON_SEARCH)
        if patch.normal @ normal > _FACING_COSINE
        and _is_button(surface, patch)
        and _away(patch, surface, point_m) < _ON_BUTTON * surface.size_m
    ]
    if not found:
        return Unclear("no small patch stands out of what is around it")
    best = max(found, key=lambda patch: _fit(surface, patch, point_m, normal))
    x = best.long_axis if best.elongation > _OBLONG else UP
    return FeatureFrame("button", best.center_m, rotation_of(best.normal, x), _radius(best), best.elongation <= _OBLONG)


_NEARER = (1.0, 0.5, 0.25)  # of the reach: within which one normal is looked for
_STEADY, _STEADY_COSINE = 0.85, 0.7  # length of the mean of unit normals, and its cosine with the point's own


def _is_steady(mean: np.ndarray, normal: np.ndarray) -> bool:
    length = float(np.linalg.norm(mean))
    return length >= _STEADY and float(mean @ normal) >= _STEADY_COSINE * length


def _steady_normal(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, reach_m: float) -> np.ndarray | None:
    means = (surface.mean_normal(point_m, normal, share * reach_m) for share in _NEARER)
    return next((mean for mean in means if _is_steady(mean, normal)), None)


_MOST_BESIDE = 8  # places beside an edge that are looked at


def _beside(
    surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, reach_m: float
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the nearest place beside a point on an edge with one normal, not far from its own, and that."""
    positions, normals = surface.samples
    near = surface.near(point_m, min(reach_m, ON_FEATURE_M))
    near = near[normals[near] @ normal > 0]
    near = near[np.linalg.norm(positions[near] - point_m, axis=1).argsort(kind="stable")]
    for index in near[:_MOST_BESIDE]:
        mean = _steady_normal(surface, positions[index], normals[index], reach_m)
        if mean is not None and _is_steady(mean, normal):
            return positions[index], mean
    return point_m, None


def surface_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray) -> Found:
    """Return a place of the surface: the point itself, Z the mean normal around it, the radius of what is flat there.

    On a thin or bent part what is near enough to have one normal is less: it is looked for twice nearer. Of a point on an edge
    the place is on a side beside it.
    """
    positions, normals = surface.samples
    reach = max(0.02 * surface.size_m, 2.5 * surface.spacing_m)
    mean = _steady_normal(surface, point_m, normal, reach)
    if mean is None:
        point_m, mean = _beside(surface, point_m, normal, reach)
    if mean is None:
        return Unclear("the surface turns too sharply where the point is")
    z = mean / np.linalg.norm(mean)
    near = surface.near(point_m, 0.25 * surface.size_m)
    near = near[np.argsort(np.linalg.norm(positions[near] - point_m, axis=1), kind="stable")]
    side = near[normals[near] @ z > 0]
    off = np.abs((positions[side] - point_m) @ z) > max(_LEAST_SLAB_M, 0.1 * reach)
    turned = normals[side] @ z < np.cos(_ANGLE_RAD)
    bent = np.flatnonzero(off | turned)
    last = side[bent[0]] if len(bent) else (side[-1] if len(side) else None)
    radius = reach if last is None else float(np.linalg.norm(positions[last] - point_m))
    return FeatureFrame("surface", point_m, rotation_of(z), max(radius, 0.002 * surface.size_m), True)


def _patches(
    surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, towards: np.ndarray | None, share: float
) -> list[Patch]:
    """Return the flat patches that begin at samples around a point, one a direction."""
    positions, normals = surface.samples
    thick = max(_LEAST_SLAB_M, _SLAB_SHARE * surface.size_m)
    seeds: list[tuple[np.ndarray, np.ndarray]] = [(point_m, normal)]
    around = surface.near(point_m, share * surface.size_m)
    around = around[np.argsort(np.linalg.norm(positions[around] - point_m, axis=1), kind="stable")]
    while len(around):
        seeds.append((positions[around[0]], normals[around[0]]))
        around = around[normals[around] @ normals[around[0]] < np.cos(2 * _ANGLE_RAD)]
    if towards is not None:
        seeds = _at_heights(surface, surface.near(point_m, share * surface.size_m), towards)
    grown = (flat_patch(surface, p, n, angle_rad=_ANGLE_RAD, thick_m=thick) for p, n in seeds[:9])
    return [patch for patch in grown if patch is not None]


def _at_heights(surface: FramedMesh, around: np.ndarray, towards: np.ndarray) -> list[tuple[np.ndarray, np.ndarray]]:
    """Return a place and normal at each height, along a direction, at which much of the surface looks that way."""
    positions, normals = surface.samples
    around = around[normals[around] @ towards > np.cos(np.pi / 4)]
    height = positions[around] @ towards
    step = max(_LEAST_SLAB_M, _SLAB_SHARE * surface.size_m)
    level = np.round((height.max() - height) / step).astype(int) if len(around) else np.zeros(0, dtype=int)
    seeds = []
    for number in np.argsort(-np.bincount(level), kind="stable")[:4] if len(level) else []:
        mine = around[level == number]
        if len(mine):
            inner = mine[
                np.linalg.norm(positions[mine] - positions[mine].mean(0), axis=1).argsort()[: len(mine) // 2 + 1]
            ]
            seeds.append((positions[inner[0]], normals[inner].mean(0) / np.linalg.norm(normals[inner].mean(0))))
    return seeds


def _is_face(surface: FramedMesh, patch: Patch) -> bool:
    return _radius(patch) > _LEAST_RADIUS_SHARE * surface.size_m and _rough(patch) < _ROUGH_SHARE


def _radius(patch: Patch) -> float:
    return float(np.sqrt(patch.area_m2 / np.pi))


def _rough(patch: Patch) -> float:
    return patch.rough_m / max(_radius(patch), 1e-9)


def _is_button(surface: FramedMesh, patch: Patch) -> bool:
    small = _LEAST_RADIUS_SHARE / 3 * surface.size_m < _radius(patch) < _BUTTON_SHARE * surface.size_m
    return small and _rough(patch) < _BUTTON_ROUGH and _stands_out(surface, patch)


def _recess_share(surface: FramedMesh, patch: Patch, towards: np.ndarray) -> float:
    """Return how far a patch lies behind the outermost place in a direction, as a share of the extent in it."""
    along = surface.mesh.vertices @ towards
    return float((along.max() - patch.center_m @ towards) / max(np.ptp(along), 1e-9))


def _depth(surface: FramedMesh, patch: Patch) -> float:
    """Return how much matter is behind a patch by its width."""
    deep, _ = surface.caster.first_hits((patch.center_m - 1e-5 * patch.normal)[None], -patch.normal[None])
    return float(deep[0]) / (2 * _radius(patch)) if np.isfinite(deep[0]) else 0.0


def _away(patch: Patch, surface: FramedMesh, point_m: np.ndarray) -> float:
    corners = surface.mesh.triangles[patch.faces]
    nearest, _ = closest_points_on_triangles(np.repeat(point_m[None], len(corners), 0), corners)
    return float(np.linalg.norm(nearest - point_m, axis=1).min())


def _fit(surface: FramedMesh, patch: Patch, point_m: np.ndarray, wanted: np.ndarray) -> float:
    """Score a patch: it looks where it should, is flat, and is near."""
    away = _away(patch, surface, point_m) / (0.5 * _SEARCH_SHARE * surface.size_m)
    return float(patch.normal @ wanted) - away - 2 * _rough(patch)


def _stands_out(surface: FramedMesh, patch: Patch) -> bool:
    """Tell whether the surface just around a patch lies below its plane, on most sides."""
    positions, _ = surface.samples
    radius = _radius(patch)
    around = surface.near(patch.center_m, 2.2 * radius + 2 * surface.spacing_m)
    offset = positions[around] - patch.center_m
    height = offset @ patch.normal
    across = np.linalg.norm(offset - height[:, None] * patch.normal, axis=1)
    ring = (across > 1.05 * radius * max(1.0, np.sqrt(patch.elongation))) & (height > -2 * radius)
    if ring.sum() < 6:
        return True
    return bool(np.mean(height[ring] < -_RAISED_M) > 0.8)
