"""Approximate convex decomposition by best-first plane cuts and greedy merging.

The part with the largest excess of convex hull volume over its own is cut by the plane that reduces the excess most, or
crosswise through its hole, until there are more parts than hulls. Then the pairs whose common hull costs least are merged. The
effort is limited by the number of parts, never by time, so that equal meshes give equal hulls.

Source: hull excess volume as the concavity (V-HACD, Mamou and Ghorbel 2009); cutting first and merging after (CoACD, Wei, Liu,
Ling and Su 2022).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh

from manitwin.geometry.cavity import Opening
from manitwin.geometry.hulls.cutting_planes import (
    CoarsePart,
    best_plane,
    normal_across,
    own_and_principal_axes,
    surface_of,
)
from manitwin.geometry.hulls.reduction import DECIMALS, convex_corners, hull_volume, reduced_hull

# Fraction of the longest side: detail irrelevant to collision; 2e-3 already opened the 4 mm wall of a mug
_SIMPLIFY_SHARE = 1e-3
_REDUCTION_TOLERANCE_M = 2e-4
_CRUMB_SHARE = 1e-6  # fraction of the mesh's volume: smaller pieces of a cut are dropped
_CONVEX_SHARE = 1e-3  # fraction of the mesh's volume: a part whose hull exceeds it by less is not cut further
# fraction of the mesh's volume: merges that add less are made even if there are few enough hulls
_FREE_MERGE_SHARE = 2.5e-4
_SECTORS = 8  # first cuts of a vessel through its axis; without them the search leaves it filled, 12 and 16 were worse
# Required gain of the three cuts crosswise through a hole, as a multiple of the best plane's gain.
_CROSS_GAIN = 4.5
_INNER_SHARE = 1 - 1e-9
"""Lower bound of a hull's volume as a share of manifold3d's hull, which may omit corners but adds none, up to rounding."""
_TOUCH_SHARE = 1e-3  # fraction of the longest side: parts farther apart are not merged


@dataclass(frozen=True)
class Decomposition:
    """Convex hulls as vertices ``(V, 3)`` m, largest first, with the method and remarks."""

    hulls: tuple[np.ndarray, ...]
    method: str
    notes: tuple[str, ...] = ()


def convex_decomposition(
    mesh: trimesh.Trimesh,
    *,
    max_hulls: int,
    max_vertices: int,
    oversplit: float,
    opening: Opening | None = None,
) -> Decomposition:
    """Cover a watertight mesh with at most ``max_hulls`` convex hulls of at most ``max_vertices`` vertices.

    ``opening`` is a cavity to preserve: the first cuts go through its axis. ``oversplit`` times ``max_hulls`` parts are cut
    before merging. A mesh that is not manifold gets one hull per connected component (method ``component_hulls``). Raises
    scipy's QhullError for a flat mesh.
    """
    longest = float(mesh.extents.max())
    solid, refusal = _solid(mesh, longest)
    notes: tuple[str, ...] = ()
    if solid is None:
        clouds = _component_points(mesh)
        method = "component_hulls"
        notes = (f"one hull a component: manifold3d refused the mesh ({refusal})",)
    else:
        clouds = _cut(solid, round(max_hulls * oversplit), opening)
        method = "plane_cuts"
    volume = sum(hull_volume(cloud) for cloud in clouds) if solid is None else solid.volume()
    clouds = _merged(clouds, max_hulls, _FREE_MERGE_SHARE * volume, _TOUCH_SHARE * longest)
    solid_clouds = [cloud for cloud in clouds if hull_volume(np.round(cloud, DECIMALS)) > 0]
    hulls = [reduced_hull(cloud, max_vertices, _REDUCTION_TOLERANCE_M) for cloud in solid_clouds or clouds]
    hulls.sort(key=lambda hull: (-hull_volume(hull), hull.tolist()))
    return Decomposition(tuple(hulls), method, notes)


def _solid(mesh: trimesh.Trimesh, longest: float) -> tuple[manifold3d.Manifold | None, str]:
    """Return the mesh as a simplified manifold, or None and the reason why it is not one."""
    vertices = np.array(mesh.vertices, dtype=np.float64, order="C")  # a copy, as manifold3d rejects read-only arrays
    solid = manifold3d.Manifold(manifold3d.Mesh64(vertices, np.array(mesh.faces, dtype=np.uint64, order="C")))
    if solid.status() != manifold3d.Error.NoError:
        return None, solid.status().name
    if solid.is_empty() or solid.volume() <= 0:
        return None, "no volume"
    simple = solid.simplify(_SIMPLIFY_SHARE * longest)
    kept = simple.status() == manifold3d.Error.NoError and not simple.is_empty()
    return (simple if kept and abs(simple.volume() / solid.volume() - 1) < 0.05 else solid), ""


def _component_points(mesh: trimesh.Trimesh) -> list[np.ndarray]:
    """Return the vertices of every connected component with volume, or of the whole mesh if none has."""
    groups = trimesh.graph.connected_components(mesh.face_adjacency, nodes=np.arange(len(mesh.faces)))
    clouds = [np.asarray(mesh.vertices[np.unique(mesh.faces[group])]) for group in groups]
    clouds = [cloud for cloud in clouds if hull_volume(cloud) > 0]
    return clouds or [np.asarray(mesh.vertices)]


class _Part:
    """A piece of the mesh: its solid, its hull vertices, and the excess of the hull's volume over its own."""

    def __init__(self, solid: manifold3d.Manifold):
        self.solid = solid
        self.hull_vertices, self.hull_volume = convex_corners(surface_of(solid)[0])
        self.excess = self.hull_volume - solid.volume()


def _cut(solid: manifold3d.Manifold, count: int, opening: Opening | None) -> list[np.ndarray]:
    """Return the hull vertices of about ``count`` parts of a solid, cut best first."""
    volume = solid.volume()
    parts = [_Part(piece) for piece in _pieces([solid], volume)]
    if opening is not None:
        for angle in np.arange(_SECTORS // 2) * (2 * np.pi / _SECTORS):
            normal = normal_across(opening.axis, angle)
            parts = [new for part in parts for new in _split(part, normal, float(normal @ opening.center_m), volume)]
    done: list[_Part] = []
    while parts and len(parts) + len(done) < count:
        parts.sort(key=lambda part: -part.excess)
        worst = parts.pop(0)
        if worst.excess < _CONVEX_SHARE * volume:
            done.append(worst)
            break
        total, normal, offset = best_plane(CoarsePart(worst.solid, np.ptp(worst.hull_vertices, axis=0)), opening)
        gain = worst.hull_volume - total
        helps = gain > worst.hull_volume * 1e-6
        across = None
        if worst.solid.genus() > 0 and not (helps and opening is not None):  # a vessel was already cut through its axis
            across = _through_hole(worst, max(_CROSS_GAIN * gain, _CONVEX_SHARE * volume))
        if across is not None:
            parts += [_Part(piece) for piece in _pieces(across, volume)]
        elif helps:
            parts += _split(worst, normal, offset, volume)
        else:
            done.append(worst)
    return [part.hull_vertices for part in parts + done]


def _split(part: _Part, normal: np.ndarray, offset: float, volume: float) -> list[_Part]:
    return [_Part(piece) for piece in _pieces(part.solid.split_by_plane(tuple(normal), offset), volume)]


def _pieces(solids: Sequence[manifold3d.Manifold], volume: float) -> list[manifold3d.Manifold]:
    """Return the connected pieces: one hull over two of them would bridge the gap."""
    return [piece for solid in solids for piece in solid.decompose() if piece.volume() > _CRUMB_SHARE * volume]


def _through_hole(part: _Part, least_gain: float) -> list[manifold3d.Manifold] | None:
    """Return a part cut crosswise through its hole if this reduces the summed hull volume by more than ``least_gain``; else None.

    A single plane gains nothing there: two half discs have the same hull volume as the disc.
    """
    solid, best = part.solid, part.hull_volume - least_gain
    found = None
    for axis in own_and_principal_axes(part.hull_vertices):
        middle = _hole_middle(solid, axis)
        if middle is None:
            continue
        quarters = [solid]
        for angle in (0.0, np.pi / 2):
            normal = normal_across(axis, angle)
            quarters = [
                half for each in quarters for half in each.split_by_plane(tuple(normal), float(normal @ middle))
            ]
        total = sum(piece.hull().volume() for quarter in quarters for piece in quarter.decompose())
        if total < best:
            best, found = total, quarters
    return found


def _hole_middle(solid: manifold3d.Manifold, axis: np.ndarray) -> np.ndarray | None:
    """Return the centre of the largest hole in the section half-way along an axis; None if there is none."""
    frame = np.stack([normal_across(axis, np.pi / 2), -normal_across(axis, 0.0), axis])
    turned = solid.transform(np.hstack([frame, np.zeros((3, 1))]))
    low, high = np.reshape(turned.bounding_box(), (2, 3))
    height = (low[2] + high[2]) / 2
    rings = [np.asarray(ring) for ring in turned.slice(height).to_polygons()]
    areas = [float(ring[:, 0] @ (np.roll(ring[:, 1], -1) - np.roll(ring[:, 1], 1))) for ring in rings]
    if not areas or min(areas) >= 0:  # the outline of a hole is clockwise
        return None
    hole = rings[int(np.argmin(areas))]
    return frame.T @ np.array([*((hole.min(0) + hole.max(0)) / 2), height])


def _merged(clouds: list[np.ndarray], max_hulls: int, free_m3: float, touch_m: float) -> list[np.ndarray]:
    """Merge pairs in order of added hull volume, down to ``max_hulls`` and further while a merge is nearly free."""
    clouds, volumes = list(clouds), [hull_volume(cloud) for cloud in clouds]
    alive = list(range(len(clouds)))

    def added(i: int, j: int) -> float:
        return hull_volume(np.vstack([clouds[i], clouds[j]])) - volumes[i] - volumes[j]

    def added_at_least(i: int, j: int) -> float:
        """Return a lower bound of ``added`` in a fifth of its time."""
        inner = float(manifold3d.Manifold.hull_points(np.vstack([clouds[i], clouds[j]])).volume())
        return inner * _INNER_SHARE - volumes[i] - volumes[j]

    def apart(i: int, j: int) -> bool:
        gap = np.maximum(clouds[i].min(0), clouds[j].min(0)) - np.minimum(clouds[i].max(0), clouds[j].max(0))
        return bool((gap > touch_m).any())

    def cheapest() -> tuple[int, int]:
        """Return the pair with the least added volume; for the other pairs only lower bounds are known."""
        while (pair := min(costs, key=lambda pair: (costs[pair], pair))) not in known:
            costs[pair] = added(*pair)
            known.add(pair)
        return pair

    known: set[tuple[int, int]] = set()
    costs = {(i, j): added_at_least(i, j) for i in alive for j in alive if i < j and not apart(i, j)}
    while len(alive) > 1:
        if not costs and len(alive) > max_hulls:  # no parts touch: merge the cheapest pair nevertheless
            costs = {(i, j): added_at_least(i, j) for i in alive for j in alive if i < j}
        if not costs:
            break
        i, j = cheapest()
        if len(alive) <= max_hulls and costs[i, j] > free_m3:
            break
        clouds[i], volumes[i] = convex_corners(np.vstack([clouds[i], clouds[j]]))
        alive.remove(j)
        costs = {pair: cost for pair, cost in costs.items() if i not in pair and j not in pair}
        known = {pair for pair in known if pair in costs}
        costs |= {(min(i, k), max(i, k)): added_at_least(i, k) for k in alive if k != i and not apart(i, k)}
    return [clouds[i] for i in alive]
