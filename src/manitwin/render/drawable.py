"""Preparation of an object for rendering: surfaces, two-sided where their backs are visible, and a shadow caster."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np
import trimesh

from manitwin.formats.meshes.shading_normals import with_creased_normals
from manitwin.formats.meshes.textures import make_part, material_of, uv_of
from manitwin.geometry.poses import rotation_between
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.repair.welding import weld_equal
from manitwin.render.raycast import merge_parts
from manitwin.render.simplification import simplified
from manitwin.render.surfaces import RenderSurface, front_faces, render_surface, shrunk
from manitwin.render.visibility import externally_visible_faces

SMALL_TEXTURE_PX = 1024  # for simplified objects; a twin's 2048 take four times the memory and upload time
SHADOW_TOLERANCE_M = 0.001
"""Largest deviation of the shadow caster from the visible surface: less than the bias of ``shaders/scene``."""
_RAYS = 40  # per direction of the grid
_SEEN_FROM_BEHIND = 2e-4  # share of hits; grazing rays between two triangles of a closed solid give less


@dataclass(frozen=True, eq=False)
class Drawable:
    """An object prepared for rendering: visible ``surfaces``, and an invisible ``shadow`` caster.

    Uploads to the renderer live as long as the Drawable. The caster's faces are reversed, because SAPIEN culls faces towards
    the light and so renders far sides into shadow maps, which would not give the height of the surface.
    """

    surfaces: tuple[RenderSurface, ...]
    shadow: RenderSurface


def prepare_drawable(
    parts: Sequence[trimesh.Trimesh],
    *,
    tolerance_m: float = 0.0,
    most_texture_px: int | None = None,
    hidden_left_out: bool = False,
) -> Drawable:
    """Prepare an object's visual parts. Raises TypeError for a mesh without a PBRMaterial.

    ``most_texture_px``: largest texture side; None: ``SMALL_TEXTURE_PX`` for simplified surfaces, else unchanged. Faces whose
    backs are not visible are one-sided. With a ``tolerance_m`` the surfaces are simplified by about that distance, and
    untextured parts of one material are joined; the shadow caster is simplified more. ``hidden_left_out``: drop faces that are
    not visible from outside, such as the inside of a robot's link.
    """
    both_sides = shows_back_faces(parts)
    if tolerance_m > 0:
        lean = [_simplified(part, tolerance_m) for part in _joined_by_material(parts)]
        parts = [part for part in lean if len(part.faces)] or parts  # objects smaller than the tolerance would vanish
        if most_texture_px is None:
            most_texture_px = SMALL_TEXTURE_PX
    surfaces = [render_surface(part) if both_sides else front_faces(render_surface(part)) for part in parts]
    whole = merge_parts(list(parts))
    if hidden_left_out:
        surfaces = _keep_visible_sides(surfaces, *_sides_seen(whole, both_sides))
    if most_texture_px is not None:
        surfaces = [_with_small_textures(each, most_texture_px) for each in surfaces]
    return Drawable(tuple(surfaces), _shadow_caster(whole, both_sides, tolerance_m, hidden_left_out))


def _joined_by_material(parts: Sequence[trimesh.Trimesh]) -> list[trimesh.Trimesh]:
    """Join untextured parts of one material, as each part costs a draw call."""
    alike: dict[object, list[trimesh.Trimesh]] = {}
    for part in parts:
        material = material_of(part)
        look: object = id(part)
        if not _is_textured(part):
            color = np.asarray(material.baseColorFactor).tolist()
            look = (*color, float(material.metallicFactor), float(material.roughnessFactor))
        alike.setdefault(look, []).append(part)
    return [_merge_parts(each) for each in alike.values()]


def _merge_parts(parts: list[trimesh.Trimesh]) -> trimesh.Trimesh:
    if len(parts) == 1:
        return parts[0]
    whole = merge_parts(parts)
    return make_part(whole.vertices, whole.faces, material=material_of(parts[0]), name=parts[0].metadata["name"])


def _is_textured(part: trimesh.Trimesh) -> bool:
    material = material_of(part)
    return material.baseColorTexture is not None or material.metallicRoughnessTexture is not None


def _simplified(part: trimesh.Trimesh, tolerance_m: float) -> trimesh.Trimesh:
    """Return a part with fewer vertices.

    Textured parts keep the seams and normals of their file. Other parts are welded, and their creases are recomputed, since
    many files have three vertices per triangle.
    """
    rows, faces = np.asarray(part.vertices), np.asarray(part.faces)
    uv = uv_of(part) if _is_textured(part) else None
    if uv is not None:
        rows = np.column_stack([rows, uv, part.vertex_normals])
    rows, faces = weld_equal(rows, faces)
    places = weld_equal(rows[:, :3], np.arange(len(rows)))[1]
    lean = simplified(rows[:, :3], faces, tolerance_m, places=places, keep_open_edges=False)
    used, faces = _used(lean, len(rows))
    rows = rows[used]
    material, name = material_of(part), part.metadata["name"]
    if uv is not None:
        return make_part(rows[:, :3], faces, material=material, name=name, uv=rows[:, 3:5], normals=rows[:, 5:])
    return with_creased_normals(make_part(rows, faces, material=material, name=name))


def _used(faces: np.ndarray, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the indices of those of ``count`` vertices used by faces ``(F, 3)``, and the faces re-indexed."""
    there = np.zeros(count, bool)
    there[faces] = True
    return np.flatnonzero(there), (np.cumsum(there) - 1)[faces]


def _with_small_textures(s: RenderSurface, most_px: int) -> RenderSurface:
    color, roughness, metallic = (
        None if image is None else shrunk(image, most_px) for image in (s.color_map, s.roughness_map, s.metallic_map)
    )
    return replace(s, color_map=color, roughness_map=roughness, metallic_map=metallic)


def _sides_seen(mesh: trimesh.Trimesh, both_sides: bool) -> list[np.ndarray]:
    """Return which faces are visible from their outward side, and with ``both_sides`` which from behind, ``(F,) bool`` each."""
    return [externally_visible_faces(mesh, from_behind=behind) for behind in ([False, True] if both_sides else [False])]


def _keep_visible_sides(
    surfaces: list[RenderSurface], front: np.ndarray, back: np.ndarray | None = None
) -> list[RenderSurface]:
    """Keep the visible sides of faces only: ``(F,) bool`` masks over all surfaces, ``back`` None for one-sided surfaces."""
    lean, first = [], 0
    for surface in surfaces:
        count = len(surface.faces) if back is None else len(surface.faces) // 2  # the second half are the backs
        of_this = slice(first, first + count)
        kept = front[of_this] if back is None else np.concatenate([front[of_this], back[of_this]])
        first += count
        if kept.any():
            used, faces = _used(surface.faces[kept], len(surface.vertices))
            lean.append(
                replace(
                    surface,
                    vertices=surface.vertices[used],
                    normals=surface.normals[used],
                    uv=surface.uv[used],
                    faces=faces.astype(np.uint32),
                )
            )
    return lean


def _shadow_caster(
    whole: trimesh.Trimesh, both_sides: bool, tolerance_m: float, hidden_left_out: bool
) -> RenderSurface:
    vertices, faces = weld_equal(np.asarray(whole.vertices), np.asarray(whole.faces))
    if tolerance_m > 0:
        faces = simplified(vertices, faces, max(tolerance_m, SHADOW_TOLERANCE_M), keep_open_edges=False)
    sides = [faces[:, ::-1], faces] if both_sides else [faces[:, ::-1]]
    if hidden_left_out:
        seen = _sides_seen(trimesh.Trimesh(vertices, faces, process=False), both_sides)
        sides = [side[shown] for side, shown in zip(sides, seen, strict=True)]
    return _bare_surface(vertices, np.concatenate(sides))


def _bare_surface(vertices: np.ndarray, faces: np.ndarray) -> RenderSurface:
    """Return a mesh, ``(V, 3)`` and ``(F, 3)``, as a grey surface without shading normals."""
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
    """Return whether back faces are visible from outside: open sheets, or wrong winding.

    Parallel rays are cast from the 26 directions of a cube's faces, edges and corners. Two-sided rendering takes twice the
    time.
    """
    mesh = merge_parts(list(parts))
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
