"""Mesh repair: turn a triangle soup into a watertight, outward-oriented solid, and describe each step.

Steps: weld vertices, drop degenerate and duplicate faces, drop fins, glue faces along edges, make winding consistent, drop
stray pieces, close holes, thicken open sheets, orient outward, split non-manifold vertices. A mesh that is already a solid is
returned unchanged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import trimesh

from manitwin.errors import ManiTwinError
from manitwin.geometry.repair import halfedges, nonmanifold, welding
from manitwin.geometry.repair.hole_filling import boundary_loops, fill_loops, loop_lengths
from manitwin.geometry.repair.orientation import face_outward, wind_consistently
from manitwin.geometry.repair.surface import Surface, face_cross_products, signed_volumes
from manitwin.geometry.repair.thickening import lids_of_openings, thicken

_STRAY_AREA_SHARE = 2e-3  # open pieces below this share of the area are debris
_HANGING_AREA_SHARE = 0.05  # the same for open pieces attached at an edge with more than two faces
# fraction of a piece's area: vector area needed to close it, below which it is a body and not a membrane
_MEMBRANE_SHARE = 0.2
_FLAT_SHARE = 1e-5  # mean thickness over the square root of the area; a sheet of A4 paper has 3e-4
_MOST_ROUNDS = 20  # of dropping fins or strays, as each round may expose others


@dataclass(frozen=True)
class RepairResult:
    """A repaired mesh, and the repairs made.

    ``source_face (F,) int64`` is the input face of each face, -1 for new ones; ``flipped (F,) bool`` marks faces with reversed
    winding. ``thickness_m`` is the wall thickness given to open sheets; None if there were none.
    """

    mesh: trimesh.Trimesh
    source_face: np.ndarray
    flipped: np.ndarray
    actions: list[str]
    watertight: bool
    thickness_m: float | None


def repair(
    mesh: trimesh.Trimesh,
    *,
    weld_tolerance: float = 1e-4,
    lid_length: float = 0.15,
    lid_area_share: float = 0.02,
    wall_share: float = 0.01,
    min_wall_m: float = 1e-3,
) -> RepairResult:
    """Repair a mesh to a watertight solid with outward winding.

    ``weld_tolerance``, ``lid_length`` and ``wall_share`` are shares of the bounding box's diagonal. A hole is the mouth of an
    open sheet if its rim is longer than ``lid_length``, and its closing surface has more than ``lid_area_share`` of the
    component's area, is visible from outside, and does not continue the surrounding surface. Such a sheet gets a wall of
    ``wall_share`` (at least ``min_wall_m``) inward and keeps its mouth. All other holes are closed. If the result is not a
    solid, ``watertight`` is False and ``actions`` says why. Raises ManiTwinError for meshes without faces or with non-finite
    coordinates.
    """
    vertices, faces = np.asarray(mesh.vertices, dtype=float), np.asarray(mesh.faces, dtype=np.int64)
    if not len(faces):
        raise ManiTwinError("a mesh without faces cannot be repaired; give one with at least four faces")
    if not np.isfinite(vertices[np.unique(faces)]).all():
        raise ManiTwinError("a mesh with vertices that are not finite cannot be repaired; drop their faces first")
    if (solid := _as_it_is(mesh, [])) is not None:
        return solid
    welded_vertices, welded_faces = welding.weld_equal(vertices, faces)
    actions = (
        [f"welded {len(vertices)} vertices to {len(welded_vertices)}"] if len(welded_vertices) < len(vertices) else []
    )
    welded = trimesh.Trimesh(welded_vertices, welded_faces, process=False)
    if (solid := _as_it_is(welded, actions)) is not None:
        return solid
    diagonal_m = float(np.linalg.norm(np.ptp(welded_vertices[np.unique(welded_faces)], axis=0)))
    surface = _welded_surface(welded_vertices, welded_faces, weld_tolerance * diagonal_m, actions)
    if not len(surface.faces):
        return _finished(surface, actions, None)
    surface = _glued_surface(surface, actions)
    surface, thickness_m = _closed_surface(
        surface, lid_length * diagonal_m, lid_area_share, max(wall_share * diagonal_m, min_wall_m), actions
    )
    return _finished(surface, actions, thickness_m)


def is_solid(vertices: np.ndarray, faces: np.ndarray) -> bool:
    """Return whether faces ``(F, 3)`` are closed and consistently wound, and every component encloses a positive volume.

    False for coincident shells and for cavities, which ``orientation.face_outward`` handles.
    """
    if not halfedges.is_closed_and_consistent(faces, len(vertices)):
        return False
    labels = halfedges.face_components(halfedges.twins_of_manifold_edges(halfedges.group_edges(faces, len(vertices))))
    if labels.any() and welding.repeated_faces(welding.weld_equal(vertices, faces)[1]).any():
        return False
    return bool((signed_volumes(vertices, faces, labels) > 0).all())


def _as_it_is(mesh: trimesh.Trimesh, actions: list[str]) -> RepairResult | None:
    """Return a mesh that is a solid once degenerate faces (which close seams in some files) are removed; None for other
    meshes.
    """
    faces = np.asarray(mesh.faces, dtype=np.int64)
    kept = ~welding.collapsed_faces(faces)
    if not is_solid(np.asarray(mesh.vertices, dtype=float), faces[kept]):
        return None
    source, collapsed = np.flatnonzero(kept), int((~kept).sum())
    if collapsed:
        mesh = trimesh.Trimesh(mesh.vertices, faces[kept], process=False)
        actions = [*actions, f"dropped {collapsed} collapsed faces"]
    return RepairResult(mesh, source, np.zeros(len(source), dtype=bool), actions, True, None)


def _welded_surface(vertices: np.ndarray, faces: np.ndarray, tolerance_m: float, actions: list[str]) -> Surface:
    """Weld open edges; drop degenerate and duplicate faces."""
    source = np.arange(len(faces))
    distinct = ~welding.collapsed_faces(faces)
    before = len(vertices)
    vertices, faces, used_m = welding.weld_near(vertices, faces[distinct], tolerance_m)
    source = source[distinct]
    if used_m:
        actions.append(f"welded {before} vertices to {len(np.unique(faces))} within {used_m * 1e6:.3g} um")
    keep = ~welding.collapsed_faces(faces)
    faces, source = faces[keep], source[keep]
    collapsed = int((~distinct).sum() + (~keep).sum())
    if collapsed:
        actions.append(f"dropped {collapsed} collapsed faces")
    repeated = welding.repeated_faces(faces)
    if repeated.any():
        actions.append(f"dropped {int(repeated.sum())} repeated faces")
        faces, source = faces[~repeated], source[~repeated]
    return Surface.unglued(vertices, faces, source, np.zeros(len(faces), dtype=bool))


def _glued_surface(surface: Surface, actions: list[str]) -> Surface:
    """Drop fins, glue faces, make winding consistent, and drop debris, until nothing changes."""
    fins = strays = 0
    for _ in range(_MOST_ROUNDS):
        dangling = nonmanifold.fins(
            surface.vertices, surface.faces, halfedges.group_edges(surface.faces, len(surface.vertices))
        )
        if not dangling.any() or dangling.all():
            break
        fins += int(dangling.sum())
        surface = surface.select_faces(~dangling)
    wound = surface
    for _ in range(_MOST_ROUNDS):
        twin, crowded = nonmanifold.glue_faces(surface.vertices, surface.faces)
        wound = wind_consistently(replace(surface, twin=twin))
        stray = _strays(wound, crowded)
        if not stray.any() or stray.all():
            break
        strays += int(stray.sum())
        surface = surface.select_faces(~stray)
    crowded_edges = int((halfedges.group_edges(surface.faces, len(surface.vertices)).counts > 2).sum())
    for count, text in (
        (fins, "dropped {} faces that dangle from an edge with more than two faces"),
        (strays, "dropped {} faces of small open pieces"),
        (crowded_edges, "took the sheets apart at {} edges with more than two faces"),
    ):
        if count:
            actions.append(text.format(count))
    return wound


def _strays(surface: Surface, crowded: np.ndarray) -> np.ndarray:
    """Return which faces belong to open pieces that are debris, or membranes between other sheets.

    ``crowded (3F,)`` marks the half-edges, by face of the same surface, on edges with more than two faces.
    """
    labels = surface.components()
    count = int(labels.max()) + 1
    areas = np.bincount(labels, surface.areas, minlength=count)
    share = areas / max(float(areas.sum()), np.finfo(float).tiny)
    open_at = surface.twin < 0
    of_halfedge = np.repeat(labels, 3)
    opened = np.bincount(of_halfedge, open_at, minlength=count)
    # Winding may renumber a face's half-edges, so crowded edges are counted per face.
    hanging_faces = crowded.reshape(-1, 3).any(1) & open_at.reshape(-1, 3).any(1)
    hanging = np.bincount(labels, hanging_faces, minlength=count) > 0
    cross = face_cross_products(surface.vertices, surface.faces) / 2
    unclosed = np.linalg.norm([np.bincount(labels, column, minlength=count) for column in cross.T], axis=0)
    hanging &= unclosed > _MEMBRANE_SHARE * areas  # excludes a nut with a jaw through it, which is nearly closed
    stray = (opened > 0) & ((share < _STRAY_AREA_SHARE) | (hanging & (share < _HANGING_AREA_SHARE)))
    return stray[labels]


def _closed_surface(
    surface: Surface, lid_length_m: float, lid_area_share: float, wall_m: float, actions: list[str]
) -> tuple[Surface, float | None]:
    """Close all holes; reopen those that are mouths of open sheets, and thicken these sheets."""
    loops = boundary_loops(surface)
    if not loops:
        return face_outward(surface), None
    lengths = loop_lengths(surface, loops)
    filled = fill_loops(surface, loops)
    outward = face_outward(filled.surface)
    lids = lids_of_openings(outward, filled.loop_of_face, lengths, lid_length_m, lid_area_share)
    is_lid = np.isin(filled.loop_of_face, lids)
    holes = np.array([i for i in range(len(loops)) if i not in set(lids.tolist())], dtype=np.int64)
    if len(holes):
        patch_faces = int(np.isin(filled.loop_of_face, holes).sum())
        actions.append(
            f"closed {len(holes)} holes (longest rim {1e3 * lengths[holes].max():.3g} mm) with {patch_faces} triangles"
        )
    labels = outward.components()
    sheet = np.isin(labels, labels[is_lid])
    flat = _flat(outward, labels) & (np.bincount(labels, filled.loop_of_face >= 0) > 0)[labels] & ~sheet
    if flat.any() and not flat.all():
        actions.append(
            f"dropped {int((flat & (filled.loop_of_face < 0)).sum())} faces of membranes that enclose nothing"
        )
        outward, labels, sheet, is_lid = outward.select_faces(~flat), labels[~flat], sheet[~flat], is_lid[~flat]
    if not len(lids):
        return outward, None
    walls = thicken(outward.select_faces(sheet & ~is_lid).with_split_vertices(), wall_m)
    actions.append(
        f"gave an open sheet with {len(lids)} mouths (longest rim {1e3 * lengths[lids].max():.3g} mm)"
        f" a wall of {1e3 * wall_m:.3g} mm inward"
    )
    return (outward.select_faces(~sheet).followed_by(walls) if not sheet.all() else walls), wall_m


def _flat(surface: Surface, labels: np.ndarray) -> np.ndarray:
    """Return which faces belong to closed components of negligible thickness."""
    areas = np.bincount(labels, surface.areas)
    thickness_m = (
        2 * np.abs(signed_volumes(surface.vertices, surface.faces, labels)) / np.maximum(areas, np.finfo(float).tiny)
    )
    return (thickness_m < _FLAT_SHARE * np.sqrt(areas))[labels]


def _encloses_volume(surface: Surface) -> bool:
    one_solid = np.zeros(len(surface.faces), dtype=np.int64)
    closed = halfedges.is_closed_and_consistent(surface.faces, len(surface.vertices))
    return closed and bool(signed_volumes(surface.vertices, surface.faces, one_solid)[0] > 0)


def _finished(surface: Surface, actions: list[str], thickness_m: float | None) -> RepairResult:
    """Split non-manifold vertices and check the result."""
    turned = int((surface.flipped & (surface.source >= 0)).sum())
    split, parted = nonmanifold.separate_coincident_edges(surface.with_split_vertices())
    mesh = trimesh.Trimesh(split.vertices, split.faces, process=False)
    watertight = _encloses_volume(split)
    if parted:
        actions.append(f"put a vertex in the middle of {parted} edges that two sheets share")
    if turned:
        actions.append(f"reversed the winding of {turned} faces")
    if not watertight:
        actions.append("no watertight solid came out: edges with one or more than two faces are left, or no volume")
    return RepairResult(mesh, split.source, split.flipped & (split.source >= 0), actions, watertight, thickness_m)
