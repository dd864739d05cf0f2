"""Part rules for surface zones: inside and rim of an open vessel, top and base of a closed one, faces of a flat object.

Unlike handle or head, these are zones of the surface, distinguished by normal and visibility rather than position, as both
sides of a wall are at the same place. Zones that the shape does not show are omitted.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, cKDTree

from manitwin.geometry.cavity import Opening
from manitwin.geometry.parts.membership import Membership, PartRule
from manitwin.geometry.parts.shape import Shape
from manitwin.geometry.parts.surface_graph import SurfaceGraph
from manitwin.geometry.ray_caster import RayCaster

_BAND = 0.01  # fraction of the longest side: precision of these borders, about one piece of the surface


def skin_membership(rule: PartRule, shape: Shape, graph: SurfaceGraph, mesh: trimesh.Trimesh) -> Membership | None:
    """Return the zone of each piece of a closed mesh's surface; None for volumetric rules, or if the zones are not shown."""
    told = _RULES.get(rule)
    return None if told is None else told(shape, graph, mesh)


_RIM_M = 0.018  # the width of a finger pad of a common gripper
_RIM_SHARE = 0.4  # fraction of the larger of depth and radius: largest width of a rim
_UP = 0.9  # cosine, for an opening that faces up
_SECTORS = 72
_LEAST_SECTORS = 0.6  # fraction of the sectors that a rim must cover
_CREST_M = 0.0015  # points this close to the highest in their sector belong to the crest
_LOOKOUTS = 6  # viewpoints on the opening's axis for the visibility of the inside
_LEAST_INSIDE = 0.05  # fraction of the area
_DOWN, _LOW, _LOW_M = -0.6, 0.1, 0.003  # z of the normal, share of the height, m: criteria of the supporting base
_FOOT_SHARE, _FOOT_M = 0.02, 0.001  # fraction of the height, m: points this close to the ground touch it
_FOOT_MARGIN = 1.05  # margin for the fillet at the bottom's edge
# z of the normal: a vault between the feet belongs to the base, however steep, where it faces the object itself
_VAULT = -0.1
_OFF_M = 1e-5  # offset of ray origins from the surface


def _open(shape: Shape, graph: SurfaceGraph, mesh: trimesh.Trimesh) -> Membership | None:
    """Outer wall, inside, rim and base of an object that opens upward.

    The inside is visible from points in the cavity; the rim is within a finger pad's width of the crest on either side.
    """
    opening = shape.opening
    if opening is None or opening.axis[2] < _UP:
        return None
    centers, normals = graph.centers_m, graph.normals
    caster = RayCaster(mesh)
    inside = _visible_from_cavity(opening, caster, centers, normals)
    if graph.areas_m2[inside].sum() < _LEAST_INSIDE * graph.areas_m2.sum():
        return None
    low, high = shape.bounds_m[:, 2]
    flat = (normals[:, 2] < _DOWN) & (centers[:, 2] < low + max(_LOW * (high - low), _LOW_M))
    base = flat & _over_footprint(centers, graph.corners_m, _FOOT_MARGIN)
    vault = (normals[:, 2] < _VAULT) & _over_footprint(centers, graph.corners_m, 1.0)
    base |= vault & ((normals[:, 2] < _DOWN) | _facing_own_surface(caster, centers, normals, asked=vault))
    base &= ~inside & _visible_from_below(caster, centers, normals, asked=base & ~inside)
    index = np.where(inside, 1, np.where(base, 3, 0))
    crest, around = _crest(opening, graph.corners_m)
    if around >= _LEAST_SECTORS:
        reach_m = min(_RIM_M, _RIM_SHARE * max(opening.depth_m, opening.rim_radius_m))
        rim = cKDTree(crest).query(centers, distance_upper_bound=reach_m)[0] <= reach_m
        index = np.where(rim & ~base, 2, index)
    return Membership(("body", "inside", "rim", "base"), index, 0.8, _BAND)


def _over_footprint(centers_m: np.ndarray, corners_m: np.ndarray, margin: float) -> np.ndarray:
    """Return which pieces ``(P,)`` are above the footprint: the hull of the lowest vertices, scaled by ``margin``."""
    low, high = corners_m[:, 2].min(), corners_m[:, 2].max()
    feet = corners_m[corners_m[:, 2] < low + max(_FOOT_SHARE * (high - low), _FOOT_M), :2]
    if len(feet) < 3 or np.linalg.matrix_rank(feet - feet.mean(0), tol=1e-6) < 2:
        return np.zeros(len(centers_m), bool)
    hull = ConvexHull(feet)
    middle = (feet.min(0) + feet.max(0)) / 2
    planes, offsets = hull.equations[:, :2], hull.equations[:, 2]
    widened = (centers_m[:, :2] - middle) / margin + middle
    return np.asarray((widened @ planes.T + offsets <= 0).all(1))


def _visible_from_below(caster: RayCaster, centers_m: np.ndarray, normals: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Return, for the pieces ``asked (P,)``, whether nothing lies between them and the ground; False for all others."""
    seen, which = np.zeros(len(centers_m), bool), np.flatnonzero(asked)
    if len(which):
        start = centers_m[which] + _OFF_M * normals[which]
        seen[which] = caster.first_hits(start, np.broadcast_to([0.0, 0.0, -1.0], start.shape))[1] < 0
    return seen


def _facing_own_surface(caster: RayCaster, centers_m: np.ndarray, normals: np.ndarray, asked: np.ndarray) -> np.ndarray:
    """Return, for the pieces ``asked (P,)``, whether a horizontal ray along their normal hits the object; False for all
    others.
    """
    seen, which = np.zeros(len(centers_m), bool), np.flatnonzero(asked)
    if len(which):
        sideways = normals[which] * [1.0, 1.0, 0.0]
        length = np.linalg.norm(sideways, axis=1, keepdims=True)
        rays = np.where(length > 1e-9, sideways / np.maximum(length, 1e-9), [1.0, 0.0, 0.0])
        seen[which] = caster.first_hits(centers_m[which] + _OFF_M * normals[which], rays)[1] >= 0
    return seen


def _visible_from_cavity(opening: Opening, caster: RayCaster, centers_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return which pieces ``(P,)`` are visible from a point on the axis of the cavity."""
    start = opening.center_m - 1e-4 * opening.axis
    floor_m = float(caster.first_hits(start[None], -opening.axis[None])[0][0])
    deep_m = min(floor_m, opening.depth_m)
    places = start - 0.95 * np.linspace(0, 1, _LOOKOUTS)[:, None] * deep_m * opening.axis
    seen = np.zeros(len(centers_m), bool)
    below = (centers_m - opening.center_m) @ opening.axis < _CREST_M
    for place in places:
        toward = centers_m - place
        away_m = np.linalg.norm(toward, axis=1)
        asked = np.flatnonzero(below & ~seen & (np.einsum("ij,ij->i", normals, toward) < 0) & (away_m > 1e-9))
        hit_m, _ = caster.first_hits(np.repeat(place[None], len(asked), 0), toward[asked] / away_m[asked, None])
        seen[asked[hit_m > (1 - 1e-3) * away_m[asked]]] = True
    return seen


def _crest(opening: Opening, corners_m: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the highest points of a vessel's wall around its opening ``(K, 3)``, and the share of directions that have one.

    Directions in which the wall rises above the brim by more than a rim's width contain a handle and are excluded.
    """
    offset = corners_m - opening.center_m
    above = offset @ opening.axis
    azimuth = np.arctan2(offset[:, 1], offset[:, 0])
    sector = ((azimuth + np.pi) / (2 * np.pi) * _SECTORS).astype(int) % _SECTORS
    highest = np.full(_SECTORS, -np.inf)
    np.maximum.at(highest, sector, above)
    level = np.abs(highest) <= _RIM_M
    mine = level[sector] & (above >= highest[sector] - _CREST_M)
    return corners_m[mine], float(level.mean())


_FLAT, _ROUNDED = 0.8, 0.35  # component of a normal along the axis: limits for vertical and sideways faces
_MOST_ROUNDED = 0.2  # fraction of the area, in between; with more, the object has no faces bounded by edges
_LEAST_FACE = 0.03  # fraction of the area
_UPPER, _LOWER = 0.6, 0.4  # shares of the height
_LID_SHARE, _LID_LEVELS, _LID_WINDOW = 0.12, 48, 8
"""Fraction of the height at either end; number of levels there; levels on either side of a concavity."""
_LID_DIRECTIONS = 24
_LID_HOLLOW = 0.012  # fraction of the radius, below the chord over the concavity
_INWARD = -0.5  # radial component of a normal; the wall of a sunken lid faces the axis


def _closed(shape: Shape, graph: SurfaceGraph, mesh: trimesh.Trimesh) -> Membership | None:
    """Side wall, top and base of an object whose top and base end at edges, such as a can or box."""
    low, high = shape.bounds_m[:, 2]
    height, up = (graph.centers_m[:, 2] - low) / max(high - low, 1e-9), graph.normals[:, 2]
    share = graph.areas_m2 / graph.areas_m2.sum()
    rounded = float(share[(np.abs(up) > _ROUNDED) & (np.abs(up) < _FLAT)].sum())
    middle = (_FLAT + _ROUNDED) / 2
    top, base = (up > middle) & (height > _UPPER), (up < -middle) & (height < _LOWER)
    if rounded > _MOST_ROUNDED or min(share[top].sum(), share[base].sum(), share[~top & ~base].sum()) < _LEAST_FACE:
        return None
    first, last = _lids(RayCaster(mesh), shape)
    inward = _outward(graph.centers_m, graph.normals, shape) < _INWARD
    top |= (height > last) | (inward & (height > 1 - _LID_SHARE))
    base |= (height < first) | (inward & (height < _LID_SHARE))
    confidence = float(np.clip(0.9 - 2 * rounded, 0.5, 0.9))
    return Membership(("body", "top", "base"), np.where(top, 1, np.where(base, 2, 0)), confidence, _BAND)


_LEAST_LARGE_FACE = 0.15  # fraction of the area, for each of the two
_OUTER = 0.25  # fraction of the thickness, from the outermost point; deeper grooves do not belong to the face


def _faced(shape: Shape, graph: SurfaceGraph, mesh: trimesh.Trimesh) -> Membership | None:
    """Front, back and narrow side of a flat object, such as a book, phone or sponge."""
    looks = graph.normals @ shape.front
    along = graph.centers_m @ shape.front
    thick_m = float(np.ptp(along))
    middle = (_FLAT + _ROUNDED) / 2
    front = (looks > middle) & (along > along.max() - _OUTER * thick_m)
    back = (looks < -middle) & (along < along.min() + _OUTER * thick_m)
    share = graph.areas_m2 / graph.areas_m2.sum()
    if share[(np.abs(looks) > _ROUNDED) & (np.abs(looks) < _FLAT)].sum() > _MOST_ROUNDED:
        return None
    if min(share[front].sum(), share[back].sum()) < _LEAST_LARGE_FACE or share[~front & ~back].sum() < _LEAST_FACE:
        return None
    return Membership(("side", "front", "back"), np.where(front, 1, np.where(back, 2, 0)), 0.8, _BAND)


def _lids(caster: RayCaster, shape: Shape) -> tuple[float, float]:
    """Return the relative heights below which everything is base and above which everything is top, including beads, seams and
    necks.

    They are at the deepest concavity of the outline near each end; without one, only the face itself counts (0 and 1).
    """
    (low, high), middle = shape.bounds_m[:, 2], shape.bounds_m[:, :2].mean(0)
    reach_m = float(np.ptp(shape.bounds_m[:, :2], axis=0).max())
    turn = (np.arange(_LID_DIRECTIONS) + 0.5) / _LID_DIRECTIONS * 2 * np.pi
    inward = -np.stack([np.cos(turn), np.sin(turn), np.zeros(_LID_DIRECTIONS)], axis=1)
    depth = (np.arange(_LID_LEVELS) + 0.5) / _LID_LEVELS * _LID_SHARE
    found = []
    for share in (depth, 1 - depth):
        heights = np.repeat(low + share * (high - low), _LID_DIRECTIONS)
        rays = np.tile(inward, (_LID_LEVELS, 1))
        start = -reach_m * rays + np.column_stack([np.tile(middle, (len(heights), 1)), heights])
        away_m = caster.first_hits(start, rays)[0]
        radius = np.where(np.isfinite(away_m), reach_m - away_m, 0.0).reshape(_LID_LEVELS, -1).mean(1)
        chord = (radius[: -2 * _LID_WINDOW] + radius[2 * _LID_WINDOW :]) / 2
        hollow = (chord - radius[_LID_WINDOW:-_LID_WINDOW]) / max(float(radius.max()), 1e-9)
        deepest = int(hollow.argmax())
        found.append(float(share[deepest + _LID_WINDOW]) if hollow[deepest] > _LID_HOLLOW else float(share[0] > 0.5))
    return found[0], found[1]


def _outward(centers_m: np.ndarray, normals: np.ndarray, shape: Shape) -> np.ndarray:
    """Return the radial component of normals ``(P, 3)`` about the vertical axis through the box centre: 1 outward, -1 towards
    it.
    """
    radial = centers_m[:, :2] - shape.bounds_m[:, :2].mean(0)
    return np.asarray(np.einsum("ij,ij->i", normals[:, :2], radial) / np.maximum(np.linalg.norm(radial, axis=1), 1e-9))


_RULES: dict[PartRule, Callable[[Shape, SurfaceGraph, trimesh.Trimesh], Membership | None]] = {
    "open": _open,
    "closed": _closed,
    "faced": _faced,
}
