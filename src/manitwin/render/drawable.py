"""A thing made ready to be drawn: its surfaces, from both sides where they are seen from behind, and what throws its shadow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import trimesh

from manitwin.formats.meshes.textures import make_part, material_of
from manitwin.formats.meshes.triangles import with_creased_normals
from manitwin.geometry.poses import rotation_between
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.repair.welding import weld_equal
from manitwin.render.raycast import merged
from manitwin.render.simplification import simplified
from manitwin.render.surfaces import RenderSurface, front_faces, render_surface, shrunk

SMALL_TEXTURE_PX = 1024  # of simplified things; the 2048 of a twin's take four times the memory and time to upload
SHADOW_TOLERANCE_M = 0.001
"""How far what throws the shadow may be from what is seen: less than the bias of ``shaders/scene``."""
_RAYS = 40  # each way, from each side
_SEEN_FROM_BEHIND = 2e-4  # share of the hits: what grazing rays find between two triangles of a closed solid is less


@dataclass(frozen=True, eq=False)
class Drawable:
    """``surfaces`` are what is seen; ``shadow``, unseen, throws the shadow. What is uploaded of it stays as long as it does.

    The latter's faces are turned over: SAPIEN leaves out those that face a light, and draws things by their far side, which
    would say nothing of heights.
    """

    surfaces: tuple[RenderSurface, ...]
    shadow: RenderSurface


def drawable(
    parts: Sequence[trimesh.Trimesh], *, tolerance_m: float = 0.0, most_texture_px: int | None = None
) -> Drawable:
    """Prepare the visual parts of a thing; raises TypeError for a mesh without a PBRMaterial.

    Textures get at most ``most_texture_px`` a side; None: ``SMALL_TEXTURE_PX`` where the surfaces are simplified, else as they
    are. Faces that nobody sees from behind get one side only. With a ``tolerance_m`` the surfaces are simplified by about that
    much, and what throws the shadow more: takes a CPU-second for 30,000 triangles, and a frame a third of the time.
    """
    both_sides = shows_back_faces(parts)
    if tolerance_m > 0:
        parts = [_welded_and_simplified(part, tolerance_m) for part in parts]
    surfaces = [render_surface(part) if both_sides else front_faces(render_surface(part)) for part in parts]
    if tolerance_m > 0:
        surfaces = [_simplified(each, tolerance_m) for each in surfaces]
    if most_texture_px is None and tolerance_m > 0:
        most_texture_px = SMALL_TEXTURE_PX
    if most_texture_px is not None:
        surfaces = [_with_small_textures(each, most_texture_px) for each in surfaces]
    return Drawable(tuple(surfaces), _shadow_caster(parts, both_sides, tolerance_m))


def _welded_and_simplified(part: trimesh.Trimesh, tolerance_m: float) -> trimesh.Trimesh:
    """Return a part without textures with fewer vertices and one a place and crease; another one as it is.

    Many files have three vertices for each triangle. Creases are found again in what is left, so that they need not stay
    where they are as the seams of textures must.
    """
    material = material_of(part)
    if material.baseColorTexture is not None or material.metallicRoughnessTexture is not None:
        return part
    vertices, faces = weld_equal(np.asarray(part.vertices), np.asarray(part.faces))
    used, faces = _used(simplified(vertices, faces, tolerance_m), len(vertices))
    lean = make_part(vertices[used], faces, material=material, name=part.metadata["name"])
    return with_creased_normals(lean)


def _simplified(s: RenderSurface, tolerance_m: float) -> RenderSurface:
    """Return a surface with fewer vertices; vertices of seams and creases, where they come twice, stay."""
    used, faces = _used(simplified(s.vertices, s.faces, tolerance_m), len(s.vertices))
    return replace(
        s,
        vertices=s.vertices[used],
        normals=s.normals[used],
        uv=s.uv[used],
        faces=faces.astype(np.uint32),
    )


def _used(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of those of ``count`` vertices that faces ``(F, 3)`` have, and the faces over these alone."""
    there = np.zeros(count, bool)
    there[faces] = True
    return np.flatnonzero(there), (np.cumsum(there) - 1)[faces]


def _with_small_textures(s: RenderSurface, most_px: int) -> RenderSurface:
    color, roughness, metallic = (
        None if image is None else shrunk(image, most_px) for image in (s.color_map, s.roughness_map, s.metallic_map)
    )
    return replace(s, color_map=color, roughness_map=roughness, metallic_map=metallic)


def _shadow_caster(parts: Sequence[trimesh.Trimesh], both_sides: bool, tolerance_m: float) -> RenderSurface:
    whole = merged(list(parts))
    vertices, faces = weld_equal(np.asarray(whole.vertices), np.asarray(whole.faces))
    if tolerance_m > 0:
        faces = simplified(vertices, faces, max(tolerance_m, SHADOW_TOLERANCE_M))
    turned = faces[:, ::-1]
    return _bare_surface(vertices, np.concatenate([turned, faces]) if both_sides else turned)


def _bare_surface(vertices: np.ndarray, faces: np.ndarray) -> RenderSurface:
    """Return a bare mesh, ``(V, 3)`` and ``(F, 3)``, as a grey surface without shading normals."""
    used, faces = _used(faces, len(vertices))
    return RenderSurface(
        vertices=vertices[used].astype(np.float32),
        faces=faces.astype(np.uint32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (len(used), 1)),
        uv=np.zeros((len(used), 2), np.float32),
        color=(0.5, 0.5, 0.5),
        color_map=None,
        metallic=0.0,
        metallic_map=None,
        roughness=1.0,
        roughness_map=None,
    )


def shows_back_faces(parts: Sequence[trimesh.Trimesh]) -> bool:
    """Tell whether faces of the parts, as one thing, are seen from behind from outside: open sheets, or a wrong winding.

    Asked of parallel rays from the 26 directions of a cube's faces, edges and corners. Drawing both sides costs twice the
    time.
    """
    mesh = merged(list(parts))
    if not len(mesh.faces):
        return False
    caster = RayCaster(mesh)
    center, radius = mesh.bounds.mean(0), float(np.linalg.norm(np.ptp(mesh.bounds, axis=0))) / 2
    side = (np.arange(_RAYS) + 0.5) / _RAYS * 2 - 1
    plane = np.stack([*np.meshgrid(side, side), np.ones((_RAYS, _RAYS))], -1).reshape(-1, 3) * radius
    hits = behind = 0
    for direction in product((-1, 0, 1), repeat=3):
        if direction == (0, 0, 0):
            continue
        toward = np.array(direction) / np.linalg.norm(direction)
        origins = center + plane @ rotation_between(np.array([0.0, 0, 1]), toward).T
        _, face = caster.first_hits(origins, np.broadcast_to(-toward, origins.shape))
        normals = caster.face_normals[face[face >= 0]]
        hits += len(normals)
        behind += int((normals @ toward < -1e-3).sum())
    return behind > _SEEN_FROM_BEHIND * hits
