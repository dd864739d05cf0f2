"""A thing made ready to be drawn: its surfaces, and what throws its shadow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import trimesh

from manitwin.formats.meshes.normals import with_creased_normals
from manitwin.formats.meshes.textures import make_part, material_of
from manitwin.geometry.repair.welding import weld_equal
from manitwin.render.back_faces import shows_back_faces
from manitwin.render.raycast import merged
from manitwin.render.sapien_shape import front_faces
from manitwin.render.simplification import simplified
from manitwin.render.surfaces import Surface, surface

SMALL_TEXTURE_PX = 1024  # of simplified things; the 2048 of a twin's take four times the memory and time to upload
SHADOW_TOLERANCE_M = 0.001
"""How far what throws the shadow may be from what is seen: less than the bias of ``shaders/scene``."""


@dataclass(frozen=True)
class Drawable:
    """``surfaces`` are what is seen; ``shadow``, unseen, throws the shadow.

    The latter's faces are turned over: SAPIEN leaves out those that face a light, and draws things by their far side, which
    would say nothing of heights.
    """

    surfaces: tuple[Surface, ...]
    shadow: Surface


def drawable(parts: Sequence[trimesh.Trimesh], *, tolerance_m: float = 0.0) -> Drawable:
    """Prepare the visual parts of a thing; raises TypeError for a mesh without a PBRMaterial.

    Faces that nobody sees from behind get one side only. With a ``tolerance_m`` the surfaces are simplified by about that
    much, and what throws the shadow more: takes a CPU-second for 30,000 triangles, and a frame a third of the time.
    """
    both_sides = shows_back_faces(parts)
    if tolerance_m > 0:
        parts = [_welded(part) for part in parts]
    surfaces = [surface(part) if both_sides else front_faces(surface(part)) for part in parts]
    if tolerance_m > 0:
        surfaces = [_simplified(each, tolerance_m) for each in surfaces]
    return Drawable(tuple(surfaces), _shadow_caster(parts, both_sides, tolerance_m))


def _welded(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return a part without textures with one vertex a place and crease; many files have three for each triangle."""
    material = material_of(part)
    if material.baseColorTexture is not None or material.metallicRoughnessTexture is not None:
        return part
    vertices, faces = weld_equal(np.asarray(part.vertices), np.asarray(part.faces))
    return with_creased_normals(make_part(vertices, faces, material=material, name=part.metadata["name"]))


def _simplified(s: Surface, tolerance_m: float) -> Surface:
    """Return a surface with fewer vertices and texels; vertices of seams and creases, where they come twice, stay."""
    faces = simplified(s.vertices, s.faces, tolerance_m)
    used, faces = np.unique(faces, return_inverse=True)
    return replace(
        s,
        vertices=s.vertices[used],
        normals=s.normals[used],
        uv=s.uv[used],
        faces=faces.reshape(-1, 3).astype(np.uint32),
        color_map=_shrunk(s.color_map),
        roughness_map=_shrunk(s.roughness_map),
        metallic_map=_shrunk(s.metallic_map),
    )


def _shrunk(image: np.ndarray | None) -> np.ndarray | None:
    if image is None or max(image.shape[:2]) <= SMALL_TEXTURE_PX:
        return image
    scale = SMALL_TEXTURE_PX / max(image.shape[:2])
    size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def _shadow_caster(parts: Sequence[trimesh.Trimesh], both_sides: bool, tolerance_m: float) -> Surface:
    whole = merged(list(parts))
    vertices, faces = weld_equal(np.asarray(whole.vertices), np.asarray(whole.faces))
    if tolerance_m > 0:
        faces = simplified(vertices, faces, max(tolerance_m, SHADOW_TOLERANCE_M))
    turned = faces[:, ::-1]
    return _bare_surface(vertices, np.concatenate([turned, faces]) if both_sides else turned)


def _bare_surface(vertices: np.ndarray, faces: np.ndarray) -> Surface:
    """Return a bare mesh, ``(V, 3)`` and ``(F, 3)``, as a grey surface without shading normals."""
    used, faces = np.unique(faces, return_inverse=True)
    return Surface(
        vertices=vertices[used].astype(np.float32),
        faces=faces.reshape(-1, 3).astype(np.uint32),
        normals=np.tile(np.array([0, 0, 1], np.float32), (len(used), 1)),
        uv=np.zeros((len(used), 2), np.float32),
        color=(0.5, 0.5, 0.5),
        color_map=None,
        metallic=0.0,
        metallic_map=None,
        roughness=1.0,
        roughness_map=None,
    )
