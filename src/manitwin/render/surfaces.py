"""Visual parts as arrays that a rasteriser takes: normals, V-down texture coordinates, metallic-roughness maps.

The model is glTF 2.0's (section 3.9.2). Colour textures are sRGB, colour factors linear. Normal maps are left out:
SAPIEN takes no tangents with arrays.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import trimesh

from manitwin.formats.meshes.normals import with_creased_normals
from manitwin.formats.meshes.textures import make_part, material_of, pbr_material, uv_of

MAX_TEXTURE_PX = 2048  # twice the largest picture made here; more only costs time and aliases


@dataclass(frozen=True)
class Surface:
    """One mesh with one material, ready for upload.

    ``vertices``, ``normals (V, 3) float32``, ``faces (F, 3) uint32``, ``uv (V, 2) float32`` V-down. ``color_map`` is
    ``(H, W, 4) uint8`` sRGB, or None for ``color (3,)`` linear; ``roughness_map`` and ``metallic_map`` are ``(H, W)
    uint8``.
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


def surface(part: trimesh.Trimesh) -> Surface:
    """Read a visual part as ``files.glb.read_glb`` gives it; raises TypeError for a mesh without a PBRMaterial.

    Every face comes twice, from either side: SAPIEN culls back faces, and open sheets would vanish from behind.
    """
    material, uv = material_of(part), uv_of(part)
    factor = np.asarray(material.baseColorFactor)[:3] / 255
    color_map = mask = None
    if uv is not None and material.baseColorTexture is not None:
        color_map = _tinted(_shrunk(np.asarray(material.baseColorTexture.convert("RGB"))), factor)
    if uv is not None and material.metallicRoughnessTexture is not None:
        mask = _shrunk(np.asarray(material.metallicRoughnessTexture.convert("RGB")))
    metallic, roughness = float(material.metallicFactor), float(material.roughnessFactor)
    vertices, faces, normals = np.asarray(part.vertices), np.asarray(part.faces), np.asarray(part.vertex_normals)
    uv_down = np.zeros((len(vertices), 2)) if uv is None else uv * [1, -1] + [0, 1]
    return Surface(
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


def plain_part(mesh: trimesh.Trimesh, color: tuple[int, int, int], *, roughness: float = 0.6) -> trimesh.Trimesh:
    """Return the mesh as a visual part of one sRGB colour, smooth but for its creases."""
    material = pbr_material(base_color=srgb_to_linear(np.array(color) / 255).tolist(), roughness=roughness)
    return with_creased_normals(make_part(mesh.vertices, mesh.faces, material=material, name="plain"))


def srgb_to_linear(value: np.ndarray) -> np.ndarray:
    """Decode sRGB in [0, 1] (IEC 61966-2-1)."""
    return np.where(value <= 0.04045, value / 12.92, ((value + 0.055) / 1.055) ** 2.4)


def linear_to_srgb(value: np.ndarray) -> np.ndarray:
    """Encode linear values in [0, 1] as sRGB (IEC 61966-2-1)."""
    return np.where(value <= 0.0031308, value * 12.92, 1.055 * np.maximum(value, 0.0031308) ** (1 / 2.4) - 0.055)


def _shrunk(image: np.ndarray) -> np.ndarray:
    """Shrink an image to the largest texture size by averaging."""
    scale = MAX_TEXTURE_PX / max(image.shape[:2])
    if scale >= 1:
        return image
    size = (max(1, round(image.shape[1] * scale)), max(1, round(image.shape[0] * scale)))
    return cv2.resize(image, size, interpolation=cv2.INTER_AREA)


def _tinted(image: np.ndarray, factor: np.ndarray) -> np.ndarray:
    """Multiply an sRGB image ``(H, W, 3) uint8`` by a linear factor; returns ``(H, W, 4) uint8`` sRGB, opaque."""
    if not np.allclose(factor, 1.0, rtol=0, atol=1 / 512):
        table = np.rint(linear_to_srgb(srgb_to_linear(np.linspace(0, 1, 256))[:, None] * factor) * 255).astype(np.uint8)
        image = np.asarray(cv2.LUT(image, table[None]))
    return np.asarray(cv2.cvtColor(image, cv2.COLOR_RGB2RGBA))
