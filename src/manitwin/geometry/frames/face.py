"""Frames of flat faces, buttons and general surface points."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.distance import closest_points_on_triangles
from manitwin.geometry.frames.feature import UP, FeatureFrame, Found, FramedMesh, NoFrame, rotation_of
from manitwin.geometry.frames.feature_deviation import ON_FEATURE_M
from manitwin.geometry.frames.patch import Patch, flat_patch

# deviation from the patch's normal; the face of a scanned mallet, flat to 0.9 mm, stays within it
_ANGLE_RAD = np.radians(20.0)
# fraction of the longest side: half the thickness of the slab that contains a patch
_SLAB_SHARE, _LEAST_SLAB_M = 0.012, 0.0008
_SEARCH_SHARE = 0.12  # fraction of the longest side: a candidate may lie next to the face, at its border
_WIDE_SHARE = 0.35  # fraction of the longest side, for labels that state the side of the face
_RECESS = 0.12  # fraction of the extent in the label's direction: deeper patches are interior, not a base or top
_ROUGH_SHARE = 0.12  # RMS distance from the plane over the patch's radius; the cap of a ball is rounder
_LEAST_RADIUS_SHARE = 0.012  # fraction of the longest side: a smaller flat patch is a facet of a round object
_OBLONG = 1.15  # aspect ratio from which a face's roll is determined
_RAISED_M = 0.0002  # least height or depth of a button relative to its surroundings
_END_ON = 1.1  # least ratio of material depth behind an end face to its width
_BUTTON_SEARCH = 0.05  # fraction of the longest side: search radius
_FACING_COSINE = 0.85  # cosine between a button's top and the normal at the point; excludes the bevel beside it
_ON_BUTTON = 0.012  # fraction of the longest side: largest distance from the point to the patch
_BUTTON_SHARE = 0.1
"""Fraction of the longest side: patches with a larger radius are faces (at most 0.057 among the templates of the tuning half)."""
_BUTTON_ROUGH = 0.05
"""RMS distance from the plane over the radius: rounder patches are bumps without a defined centre (0.005)."""


def face_frame(
    surface: FramedMesh,
    point_m: np.ndarray,
    normal: np.ndarray,
    towards: np.ndarray | None = None,
    end_on: bool = False,
) -> Found:
    """Return the frame of the flat face at or next to a surface point with normal ``(3,)``: centre, Z outward; ``size_m`` is its
    radius.

    ``towards (3,)``: the direction that the face must look in (within 45 degrees), if the label states one. ``end_on``: the
    face must be an end, with more material behind it than it is wide; this holds for a hammer's face but not for its cheeks.
    """
    share = _SEARCH_SHARE if towards is None else _WIDE_SHARE
    found = [p for p in _patches(surface, point_m, normal, towards, share) if _is_face(surface, p)]
    if towards is not None:
        found = [patch for patch in found if _recess_share(surface, patch, towards) < _RECESS]
    if end_on:
        found = [patch for patch in found if _depth(surface, patch) > _END_ON]
    if not found:
        return NoFrame("no flat end is where the point is" if end_on else "nothing flat is where the point is")
    if end_on:
        best = max(found, key=lambda patch: _depth(surface, patch) - _away(patch, surface, point_m) / _radius(patch))
    elif towards is not None:  # the label states the side: take its largest face, not the ring around a recess
        best = max(found, key=lambda patch: patch.area_m2 * max(float(patch.normal @ towards), 0.0) ** 4)
    else:
        best = max(found, key=lambda patch: _fit(surface, patch, point_m, normal))
    oblong = best.elongation > _OBLONG
    x = best.long_axis * (1 if best.long_axis @ np.array([1.0, 0.1, 0.01]) > 0 else -1) if oblong else UP
    return FeatureFrame("face", best.center_m, rotation_of(best.normal, x), _radius(best), not oblong)


def button_frame(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray) -> Found:
    """Return the frame of the button at a surface point: a small flat patch that is raised from its surroundings."""
    found = [
        patch
        for patch in _patches(surface, point_m, normal, None, _BUTTON_SEARCH)
        if patch.normal @ normal > _FACING_COSINE
        and _is_button(surface, patch)
        and _away(patch, surface, point_m) < _ON_BUTTON * surface.size_m
    ]
    if not found:
        return NoFrame("no small patch stands out of what is around it")
    best = max(found, key=lambda patch: _fit(surface, patch, point_m, normal))
    x = best.long_axis if best.elongation > _OBLONG else UP
    return FeatureFrame("button", best.center_m, rotation_of(best.normal, x), _radius(best), best.elongation <= _OBLONG)


_NEARER = (1.0, 0.5, 0.25)  # fractions of the search radius: neighbourhoods in which a uniform normal is sought
# least length of the mean unit normal, and least cosine with the point's own normal
_STEADY, _STEADY_COSINE = 0.85, 0.7


def _is_steady(mean: np.ndarray, normal: np.ndarray) -> bool:
    length = float(np.linalg.norm(mean))
    return length >= _STEADY and float(mean @ normal) >= _STEADY_COSINE * length


def _steady_normal(surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, reach_m: float) -> np.ndarray | None:
    means = (surface.mean_normal(point_m, normal, share * reach_m) for share in _NEARER)
    return next((mean for mean in means if _is_steady(mean, normal)), None)


_MOST_BESIDE = 8  # number of samples beside an edge that are tried


def _find_steady_sample(
    surface: FramedMesh, point_m: np.ndarray, normal: np.ndarray, reach_m: float
) -> tuple[np.ndarray, np.ndarray | None]:
    """Return the nearest sample beside a point on an edge with a uniform normal close to the point's own, and that mean
    normal.
    """
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
    """Return the frame of a surface point: the point itself, Z the mean normal around it; ``size_m`` is the radius of its flat
    region.

    On a thin or curved part, the neighbourhood for the mean normal is halved up to twice. For a point on an edge, the frame is
    moved to a sample beside the edge.
    """
    positions, normals = surface.samples
    reach = max(0.02 * surface.size_m, 2.5 * surface.spacing_m)
    mean = _steady_normal(surface, point_m, normal, reach)
    if mean is None:
        point_m, mean = _find_steady_sample(surface, point_m, normal, reach)
    if mean is None:
        return NoFrame("the surface turns too sharply where the point is")
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
    """Return the flat patches grown from samples around a point, one seed per direction."""
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
    """Return a seed position and normal at each height, along a direction, at which much of the surface faces that way."""
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
    return small and _rough(patch) < _BUTTON_ROUGH and _is_raised(surface, patch)


def _recess_share(surface: FramedMesh, patch: Patch, towards: np.ndarray) -> float:
    """Return how far a patch lies behind the outermost vertex in a direction, as a share of the extent."""
    along = surface.mesh.vertices @ towards
    return float((along.max() - patch.center_m @ towards) / max(np.ptp(along), 1e-9))


def _depth(surface: FramedMesh, patch: Patch) -> float:
    """Return the depth of material behind a patch relative to its width."""
    deep, _ = surface.caster.first_hits((patch.center_m - 1e-5 * patch.normal)[None], -patch.normal[None])
    return float(deep[0]) / (2 * _radius(patch)) if np.isfinite(deep[0]) else 0.0


def _away(patch: Patch, surface: FramedMesh, point_m: np.ndarray) -> float:
    corners = surface.mesh.triangles[patch.faces]
    nearest, _ = closest_points_on_triangles(np.repeat(point_m[None], len(corners), 0), corners)
    return float(np.linalg.norm(nearest - point_m, axis=1).min())


def _fit(surface: FramedMesh, patch: Patch, point_m: np.ndarray, wanted: np.ndarray) -> float:
    """Score a patch by alignment with the wanted normal, flatness and proximity."""
    away = _away(patch, surface, point_m) / (0.5 * _SEARCH_SHARE * surface.size_m)
    return float(patch.normal @ wanted) - away - 2 * _rough(patch)


def _is_raised(surface: FramedMesh, patch: Patch) -> bool:
    """Return whether most of the surface just around a patch lies below its plane."""
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
