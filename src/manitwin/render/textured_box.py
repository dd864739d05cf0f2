"""Boxes of furniture with a procedural texture, true to scale."""

from __future__ import annotations

import numpy as np
import trimesh
from PIL import Image

from manitwin.formats.meshes.textures import make_part, pbr_material
from manitwin.render.procedural_textures import ProceduralTexture

# Corners of the faces as seen from outside, from the lower left one counterclockwise, in half extents; the face's
# horizontal and vertical axis in the picture. On top +X runs to the right and +Y up.
_FACES = (
    (((1, -1, -1), (1, 1, -1), (1, 1, 1), (1, -1, 1)), 1, 2),
    (((-1, 1, -1), (-1, -1, -1), (-1, -1, 1), (-1, 1, 1)), 1, 2),
    (((1, 1, -1), (-1, 1, -1), (-1, 1, 1), (1, 1, 1)), 0, 2),
    (((-1, -1, -1), (1, -1, -1), (1, -1, 1), (-1, -1, 1)), 0, 2),
    (((-1, -1, 1), (1, -1, 1), (1, 1, 1), (-1, 1, 1)), 0, 1),
    (((-1, 1, -1), (1, 1, -1), (1, -1, -1), (-1, -1, -1)), 0, 1),
)


def textured_box(
    half_extents_m: np.ndarray, texture: ProceduralTexture, *, offset_m: tuple[float, float] = (0.0, 0.0)
) -> trimesh.Trimesh:
    """Return a box about its origin as a visual part; its grain runs along the longest side.

    ``offset_m`` shifts the texture, so that boards of one wood differ.
    """
    half = np.asarray(half_extents_m, float)
    grain = int(half.argmax())
    vertices, uv, normals = [], [], []
    for corners, right, up in _FACES:
        points = np.array(corners) * half
        axes = (right, up) if right == grain or up != grain else (up, right)
        vertices.append(points)
        uv.append((points[:, axes] + offset_m) / texture.size_m)
        normals.append(np.cross(points[1] - points[0], points[3] - points[0]))
    quads = np.arange(24).reshape(6, 4)
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    normal = np.repeat(np.array(normals) / np.linalg.norm(normals, axis=1)[:, None], 4, axis=0)
    # glTF 2.0, section 3.9.2: roughness is green, metallic is blue
    metal = np.full_like(texture.roughness, round(texture.metallic * 255))
    material = pbr_material(
        "furniture",
        metallic=1.0,
        roughness=1.0,
        base_color_texture=Image.fromarray(texture.color),
        metallic_roughness_texture=Image.fromarray(np.stack([metal * 0, texture.roughness, metal], -1)),
    )
    return make_part(
        np.concatenate(vertices), faces, material=material, name="box", uv=np.concatenate(uv), normals=normal
    )
