"""Simplified visual meshes of a robot's links as one small GLB for the 3D view."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
import trimesh

from manitwin.episodes.robot_appearance import link_visuals
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.shading_normals import with_creased_normals
from manitwin.formats.meshes.textures import make_part, material_of, pbr_material
from manitwin.geometry.repair.welding import weld_equal
from manitwin.render.simplification import simplified

TOLERANCE_M = 0.0015
"""Maximum deviation of simplified surfaces: about a pixel if a whole arm fills 1,000 pixels."""


def links_with_visuals(urdf: str) -> list[str]:
    """Return the names of the links with visual meshes, in the order of their numbers in the GLB; raises AssetError."""
    return list(link_visuals(urdf))


@lru_cache(maxsize=4)
def robot_glb(urdf: str) -> bytes:
    """Return a GLB whose parts ``l<n>p<k>`` belong to link n, in its own frame; cached.

    Textures are left out: a part has the base colour of its material. Parts of a link with equal materials are merged. Raises
    AssetError.
    """
    parts = []
    for number, visuals in enumerate(link_visuals(urdf).values()):
        parts += [_set_name(part, f"l{number}p{place}") for place, part in enumerate(_merge_by_material(visuals))]
    return write_glb(parts)


def _merge_by_material(visuals: Iterable[trimesh.Trimesh]) -> list[trimesh.Trimesh]:
    """Return parts merged by colour, metallic and roughness, with simplified geometry."""
    alike: dict[tuple[float, ...], list[trimesh.Trimesh]] = {}
    for each in visuals:
        material = material_of(each)
        color = np.asarray(material.baseColorFactor, float)[:3] / 255
        look = (*color.tolist(), float(material.metallicFactor), float(material.roughnessFactor))
        alike.setdefault(look, []).append(each)
    return [_simplified(each, look) for look, each in alike.items()]


def _simplified(parts: list[trimesh.Trimesh], look: tuple[float, ...]) -> trimesh.Trimesh:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts[:-1])])
    vertices, faces = weld_equal(
        np.concatenate([np.asarray(part.vertices) for part in parts]),
        np.concatenate([np.asarray(part.faces) + start for part, start in zip(parts, starts, strict=True)]),
    )
    faces = simplified(vertices, faces, TOLERANCE_M)
    used, faces = np.unique(faces, return_inverse=True)
    material = pbr_material(base_color=list(look[:3]), metallic=look[3], roughness=look[4])
    return with_creased_normals(make_part(vertices[used], faces.reshape(-1, 3), material=material, name="links"))


def _set_name(part: trimesh.Trimesh, name: str) -> trimesh.Trimesh:
    part.metadata["name"] = name
    return part
