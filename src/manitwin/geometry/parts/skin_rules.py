"""Rules of what is on a surface alone: the inside and rim of an open vessel, the lid and base of a closed one.

Unlike handle or head these are zones of a skin, told by where they look and not by where they are: both sides of a wall are at
one place. What a form does not show is not told.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.cavity import Opening
from manitwin.geometry.parts.part_rules import Membership, PartRule
from manitwin.geometry.parts.shape import Shape
from manitwin.geometry.parts.surface_graph import SurfaceGraph
from manitwin.geometry.ray_caster import RayCaster

_BAND = 0.01  # of the longest side: these borders are known to about a piece of the surface


def skin_membership(rule: PartRule, shape: Shape, graph: SurfaceGraph, mesh: trimesh.Trimesh) -> Membership | None:
    """Return the zone of each piece of a closed mesh's surface; None where the rule is of parts with matter, or not shown."""
    told = _RULES.get(rule)
    return None if told is None else told(shape, graph, mesh)


_RIM_M, _RIM_SHARE = (
    0.018,
    0.4,
)  # m: a finger pad of a common gripper; at most so much of the larger of depth and radius
_UP = 0.9  # cosine: an opening that looks up
_SECTORS = 72
_LEAST_SECTORS = 0.6  # of the sectors: a rim that goes less far around is none
_CREST_M = 0.0015  # what is as near to the highest of its sector is its crest too
_LOOKOUTS = 6  # places on the opening's axis from which the inside is looked at
_LEAST_INSIDE = 0.05  # of the area
_DOWN, _LOW, _LOW_M = -0.6, 0.1, 0.003  # z of the normal, share of the height, m: what a vessel stands on


def _open(shape: Shape, graph: SurfaceGraph, mesh: trimesh.Trimesh) -> Membership | None:
    """Outer wall, inside, rim and base of what opens upward.

    The inside is what can be seen from places in the hollow, the rim what is within a finger pad of the crest on either side.
    """
    opening = shape.opening
    if opening is None or opening.axis[2] < _UP:
        return None
    centers, normals = graph.centers_m, graph.normals
    inside = _seen_from_within(opening, RayCaster(mesh), centers, normals)
    if graph.areas_m2[inside].sum() < _LEAST_INSIDE * graph.areas_m2.sum():
        return None
    low, high = shape.bounds_m[:, 2]
    base = ~inside & (normals[:, 2] < _DOWN) & (centers[:, 2] < low + max(_LOW * (high - low), _LOW_M))
    index = np.where(inside, 1, np.where(base, 3, 0))
    crest, around = _crest(opening, graph.corners_m)
    if around >= _LEAST_SECTORS:
        reach_m = min(_RIM_M, _RIM_SHARE * max(opening.depth_m, opening.rim_radius_m))
        rim = cKDTree(crest).query(centers, distance_upper_bound=reach_m)[0] <= reach_m
        rim &= ~base
        index = np.where(rim & _shown_by_faces(rim, graph), 2, index)
    return Membership(("body", "inside", "rim", "base"), index, 0.8, _BAND)


def _seen_from_within(opening: Opening, caster: RayCaster, centers_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Tell of pieces ``(P,)`` whether some place on the axis of the hollow sees them."""
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
    """Return the highest places of a vessel's wall around its opening ``(K, 3)``, and the share of directions that have one.

    What rises above the brim by more than a rim is wide is a handle: in its directions no crest is told.
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


def _shown_by_faces(rim: np.ndarray, graph: SurfaceGraph) -> bool:
    """Tell whether the mesh's own faces are small enough to show a rim: a wall of one face from top to bottom is not."""
    by_face = graph.of_pieces(graph.of_faces(rim))
    both, either = (graph.areas_m2[which].sum() for which in (by_face & rim, by_face | rim))
    return bool(both > 0.5 * either)


_FLAT, _ROUNDED = 0.8, 0.35  # z of a normal: what looks up or down, what looks sideways
_MOST_ROUNDED = 0.2  # of the area, in between: with more it has no faces that end somewhere
_LEAST_FACE = 0.03  # of the area
_UPPER, _LOWER = 0.6, 0.4  # shares of the height


def _closed(shape: Shape, graph: SurfaceGraph, mesh: trimesh.Trimesh) -> Membership | None:
    """Side wall, top and base of a thing whose top and base end at edges: a can, a box."""
    low, high = shape.bounds_m[:, 2]
    height, up = (graph.centers_m[:, 2] - low) / max(high - low, 1e-9), graph.normals[:, 2]
    share = graph.areas_m2 / graph.areas_m2.sum()
    rounded = float(share[(np.abs(up) > _ROUNDED) & (np.abs(up) < _FLAT)].sum())
    middle = (_FLAT + _ROUNDED) / 2
    top, base = (up > middle) & (height > _UPPER), (up < -middle) & (height < _LOWER)
    if rounded > _MOST_ROUNDED or min(share[top].sum(), share[base].sum(), share[~top & ~base].sum()) < _LEAST_FACE:
        return None
    confidence = float(np.clip(0.9 - 2 * rounded, 0.5, 0.9))
    return Membership(("body", "top", "base"), np.where(top, 1, np.where(base, 2, 0)), confidence, _BAND)


_RULES: dict[PartRule, Callable[[Shape, SurfaceGraph, trimesh.Trimesh], Membership | None]] = {
    "open": _open,
    "closed": _closed,
}
