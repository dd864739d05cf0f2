"""Conversion of visual parts to arrays for rasterization, and their upload to SAPIEN.

The material model is that of glTF 2.0 (section 3.9.2): colour textures are sRGB, colour factors linear; texture coordinates are
V-down. Normal maps are ignored, as SAPIEN does not accept tangents with arrays.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import cv2
import numpy as np
import trimesh
from PIL import Image

from manitwin.formats.meshes.shading_normals import with_creased_normals
from manitwin.formats.meshes.textures import make_part, material_of, pbr_material, uv_of

MAX_TEXTURE_PX = 2048  # larger textures only cost time and cause aliasing
SPECULAR = 0.5  # dielectric reflectance of 0.5 * 0.08 = 4 %, the default of glTF 2.0 (index of refraction 1.5)


@dataclass(frozen=True)
class RenderSurface:
    """A mesh with a single material, ready for upload.

    ``vertices``, ``normals (V, 3) float32``, ``faces (F, 3) uint32``, ``uv (V, 2) float32`` V-down. ``color_map`` is ``(H, W,
    4) uint8`` sRGB, or None for ``color (3,)`` linear; ``roughness_map`` and ``metallic_map`` are ``(H, W) uint8``.
    """

    vertices: np.ndarray
    faces: np.ndarray
    normals: np.ndarray
    uv: np.ndarray
    color: tuple[float, float, float]
    color_map: np.ndarray | None
    metallic: float
    metallic_map: np.ndarray | None
    roughness: float
    roughness_map: np.ndarray | None


def render_surface(part: trimesh.Trimesh, *, texels_a_unit: float = math.inf) -> RenderSurface:
    """Convert a visual part from ``formats.glb.read_glb``. Raises TypeError for a mesh without a PBRMaterial.

    Textures are downsampled to about ``texels_a_unit`` per unit of length on the surface, see ``texture_px``. Every face is
    included from both sides: SAPIEN culls back faces, and open sheets would vanish from behind.
    """
    material, uv = material_of(part), uv_of(part)
    factor = np.asarray(material.baseColorFactor)[:3] / 255
    color_map = mask = None
    most_px = MAX_TEXTURE_PX if uv is None else texture_px(part, uv, texels_a_unit)
    if uv is not None and material.baseColorTexture is not None:
        color_map = _tinted(shrunk(_rgb(material.baseColorTexture), most_px), factor)
    if uv is not None and material.metallicRoughnessTexture is not None:
        mask = shrunk(_rgb(material.metallicRoughnessTexture), most_px)
    metallic, roughness = float(material.metallicFactor), float(material.roughnessFactor)
    vertices, faces, normals = np.asarray(part.vertices), np.asarray(part.faces), np.asarray(part.vertex_normals)
    uv_down = np.zeros((len(vertices), 2)) if uv is None else uv * [1, -1] + [0, 1]
    return RenderSurface(
        vertices=np.concatenate([vertices, vertices]).astype(np.float32),
        faces=np.concatenate([faces, faces[:, ::-1] + len(vertices)]).astype(np.uint32),
        normals=np.concatenate([normals, -normals]).astype(np.float32),
        uv=np.concatenate([uv_down, uv_down]).astype(np.float32),
        color=(float(factor[0]), float(factor[1]), float(factor[2])),
        color_map=color_map,
        metallic=metallic,
        metallic_map=None if mask is None else (mask[..., 2] * metallic).astype(np.uint8),
        roughness=roughness,
        roughness_map=None if mask is None else (mask[..., 1] * roughness).astype(np.uint8),
    )


def texture_px(part: trimesh.Trimesh, uv: np.ndarray, texels_a_unit: float) -> int:
    """Return the texture side with ``texels_a_unit`` on average on a surface with coordinates ``uv (V, 2)``.

    Textures of which the surface uses a small share, and palettes with one point per face, are kept at full size.
    """
    if math.isinf(texels_a_unit):
        return MAX_TEXTURE_PX
    corners = uv[part.faces]
    along, across = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    share = float(np.abs(along[:, 0] * across[:, 1] - along[:, 1] * across[:, 0]).sum()) / 2
    side = texels_a_unit * math.sqrt(part.area / share) if share > 0 else math.inf
    return math.ceil(min(side, MAX_TEXTURE_PX))


def plain_part(mesh: trimesh.Trimesh, color: tuple[int, int, int], *, roughness: float = 0.6) -> trimesh.Trimesh:
    """Return the mesh as a visual part with one sRGB colour, smooth except for creases."""
    material = pbr_material(base_color=srgb_to_linear(np.array(color) / 255).tolist(), roughness=roughness)
    return with_creased_normals(make_part(mesh.vertices, mesh.faces, material=material, name="plain"))


def shrunk(image: np.ndarray, most_px: int) -> np.ndarray:
    """Downsample an image to at most ``most_px`` per side, by averaging."""
    scale = most_px / max(image.shape[:2])
    if scale >= 1:
        return image
    size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
    return np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA))


def srgb_to_linear(value: np.ndarray) -> np.ndarray:
    """Decode sRGB in [0, 1] (IEC 61966-2-1)."""
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(value: np.ndarray) -> np.ndarray:
    """Encode linear values in [0, 1] as sRGB (IEC 61966-2-1)."""
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 0.0031308) ** (1 / 2.4) - 0.055)


def _rgb(image: Image.Image) -> np.ndarray:
    return np.asarray(image if image.mode == "RGB" else image.convert("RGB"))  # convert() would make another copy


def _tinted(image: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """Multiply an sRGB image ``(H, W, 3) uint8`` by a linear factor; return ``(H, W, 4) uint8`` sRGB, opaque."""
    if not np.allclose(factor, 1.0, rtol=0, atol=1 / 512):
        table = np.rint(linear_to_srgb(srgb_to_linear(np.linspace(0, 1, 256))[:, None] * factor) * 255).astype(np.uint8)
        image = np.asarray(cv2.LUT(image, table[None]))
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2RGBA))


def triangle_mesh_shape(render: Any, s: RenderSurface) -> Any:
    """Return a surface as a shape of the module ``sapien.render``."""
    material, roughness, metallic = _material(render, s)
    if s.color_map is not None:
        material.base_color_texture = _texture(render, s.color_map, "R8G8B8A8Unorm", srgb=True)
    if roughness is not None:
        material.roughness_texture = _texture(render, roughness, "R8Unorm")
    if metallic is not None:
        material.metallic_texture = _texture(render, metallic, "R8Unorm")
    return render.RenderShapeTriangleMesh(s.vertices, s.faces, s.normals, s.uv, material)


def scene_shape(render: Any, s: RenderSurface) -> Any:
    """Return a surface as a shape of the module ``sapien.render`` for ``shaders/scene``, with textures in that shader's encoding.

    Textures have mipmaps, since they are much finer than the pixels. As lavapipe averages sRGB slowly, colours are stored as
    square roots of linear values; their averages are slightly darker than those of light. With a colour texture, roughness is
    its alpha channel.
    """
    material, roughness, metallic = _material(render, s)
    if s.color_map is not None:
        colors = np.dstack(
            [cv2.LUT(s.color_map[..., :3], _ROOTS[None, :, None]), np.full(s.color_map.shape[:2], 255, np.uint8)]
        )
        if roughness is not None:
            size = colors.shape[1::-1]
            colors[..., 3] = roughness if roughness.shape == size[::-1] else cv2.resize(roughness, size)
            material.set_emission([1.0, 0.0, 0.0, 0.0])  # tells the shader about the alpha channel
        material.base_color_texture = _texture(render, colors, "R8G8B8A8Unorm", mipmaps=True)
    elif roughness is not None:
        material.roughness_texture = _texture(render, roughness, "R8Unorm", mipmaps=True)
    if metallic is not None:
        material.metallic_texture = _texture(render, metallic, "R8Unorm", mipmaps=True)
    return render.RenderShapeTriangleMesh(s.vertices, s.faces, s.normals, s.uv, material)


_ROOTS = np.rint(np.sqrt(srgb_to_linear(np.arange(256) / 255)) * 255).astype(np.uint8)


def _material(render: Any, s: RenderSurface) -> tuple[Any, np.ndarray | None, np.ndarray | None]:
    """Return a surface's material without textures, and its roughness and metallic maps unless they are constant."""
    material = render.RenderMaterial()
    material.base_color = [*s.color, 1.0]
    material.specular = SPECULAR
    roughness, material.roughness = _map_or_value(s.roughness_map, s.roughness)
    metallic, material.metallic = _map_or_value(s.metallic_map, s.metallic)
    return material, roughness, metallic


def front_faces(s: RenderSurface) -> RenderSurface:
    """Return a surface without the reversed copies of its faces (see ``render_surface``)."""
    vertices, faces = len(s.vertices) // 2, len(s.faces) // 2
    return replace(
        s, vertices=s.vertices[:vertices], normals=s.normals[:vertices], uv=s.uv[:vertices], faces=s.faces[:faces]
    )


def _map_or_value(image: np.ndarray | None, value: float) -> tuple[np.ndarray | None, float]:
    """Replace a constant map by its value, as many are and per-pixel lookups cost time."""
    if image is not None and image.min() == image.max():
        return None, float(image.flat[0]) / 255
    return image, value


def _texture(render: Any, image: np.ndarray, pixel_format: str, *, srgb: bool = False, mipmaps: bool = False) -> Any:
    array = np.ascontiguousarray(image if image.ndim == 3 else image[..., None])
    levels = min(image.shape[:2]).bit_length() if mipmaps else 1
    return render.RenderTexture2D(array=array, format=pixel_format, mipmap_levels=levels, srgb=srgb)
