"""Surfaces as SAPIEN's shapes: geometry, material and textures uploaded."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from manitwin.render.surfaces import Surface

SPECULAR = 0.5  # reflectance of a dielectric at 0.5 * 0.08 = 4 %, the default of glTF 2.0 (index of refraction 1.5)


def triangle_mesh_shape(render: Any, s: Surface, *, mipmaps: bool) -> Any:
    """Return a surface as a shape of the module ``sapien.render``.

    ``mipmaps`` are for scenes, where textures are much finer than the pixels; the driver averages them in sRGB, which
    darkens what is both fine and rich in contrast a little.
    """
    material = render.RenderMaterial()
    material.base_color = [*s.color, 1.0]
    material.specular = SPECULAR
    roughness, material.roughness = _map_or_value(s.roughness_map, s.roughness)
    metallic, material.metallic = _map_or_value(s.metallic_map, s.metallic)
    if s.color_map is not None:
        material.base_color_texture = _texture(render, s.color_map, "R8G8B8A8Unorm", srgb=True, mipmaps=mipmaps)
    if roughness is not None:
        material.roughness_texture = _texture(render, roughness, "R8Unorm", srgb=False, mipmaps=mipmaps)
    if metallic is not None:
        material.metallic_texture = _texture(render, metallic, "R8Unorm", srgb=False, mipmaps=mipmaps)
    return render.RenderShapeTriangleMesh(s.vertices, s.faces, s.normals, s.uv, material)


def front_faces(s: Surface) -> Surface:
    """Return a surface without the copies of its faces that are seen from behind (``render.surfaces.surface``)."""
    vertices, faces = len(s.vertices) // 2, len(s.faces) // 2
    return replace(
        s, vertices=s.vertices[:vertices], normals=s.normals[:vertices], uv=s.uv[:vertices], faces=s.faces[:faces]
    )


def _map_or_value(image: np.ndarray | None, value: float) -> tuple[np.ndarray | None, float]:
    """Return an even map as its value: many are, and looking them up for every pixel costs."""
    if image is not None and image.min() == image.max():
        return None, float(image.flat[0]) / 255
    return image, value


def _texture(render: Any, image: np.ndarray, pixel_format: str, *, srgb: bool, mipmaps: bool) -> Any:
    array = np.ascontiguousarray(image if image.ndim == 3 else image[..., None])
    levels = min(image.shape[:2]).bit_length() if mipmaps else 1
    return render.RenderTexture2D(array=array, format=pixel_format, mipmap_levels=levels, srgb=srgb)
