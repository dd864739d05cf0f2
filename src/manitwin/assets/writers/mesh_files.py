"""The meshes of a twin as the files that XML formats name: visual parts as OBJ, MTL and PNG, hulls as OBJ."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import trimesh
from PIL import Image

from manitwin.assets.writers.content import TwinContent
from manitwin.assets.writers.obj_file import mtl_file, obj_file
from manitwin.errors import ExportError
from manitwin.formats.meshes.textures import linear_to_srgb, material_of, normals_of, uv_of


@dataclass(frozen=True)
class VisualPart:
    """A textured mesh: its files by name, all in one folder, and what its material is.

    ``mesh`` and ``texture`` are names in ``files``; ``rgba`` is sRGB and multiplies the texture. ``places`` counts its
    distinct vertices.
    """

    name: str
    files: dict[str, bytes]
    mesh: str
    texture: str | None
    rgba: tuple[float, float, float, float]
    roughness: float
    metallic: float
    places: int


def visual_parts(twin: TwinContent, folder: str) -> tuple[VisualPart, ...]:
    """Return the visual parts below ``folder``, in the object frame, with names that no other twin has."""
    return tuple(_visual_part(part, f"{twin.name}_visual_{i:02d}", folder) for i, part in enumerate(twin.visual))


def hulls_of(twin: TwinContent) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Return the hulls of a twin. Raises ExportError where there is none: such a body falls through the floor."""
    if not twin.hulls:
        raise ExportError(f"{twin.name}: it has no collision hulls; build the twin again")
    return twin.hulls


def hull_files(twin: TwinContent, folder: str) -> dict[str, bytes]:
    """Return the collision hulls below ``folder``: one OBJ file each, in the object frame, by name, in the twin's order.

    Raises ExportError where there is none.
    """
    return {
        f"{folder}/{twin.name}_hull_{i:02d}.obj": obj_file(vertices, faces)
        for i, (vertices, faces) in enumerate(hulls_of(twin))
    }


def lost_maps(twin: TwinContent) -> tuple[str, ...]:
    """Say which textures OBJ's material does not have, as lines for a README."""
    materials = [material_of(part) for part in twin.visual]
    lost = []
    if any(m.normalTexture is not None for m in materials):
        lost.append("normal")
    if any(m.metallicRoughnessTexture is not None for m in materials):
        lost.append("metallic-roughness")
    return (f"the {' and '.join(lost)} maps of the visual mesh: the GLB has them.",) if lost else ()


def _visual_part(part: trimesh.Trimesh, name: str, folder: str) -> VisualPart:
    material = material_of(part)
    uv, image = uv_of(part), material.baseColorTexture
    textured = uv is not None and image is not None
    texture = f"{folder}/{name}.png" if textured else None
    red, green, blue, alpha = (np.asarray(material.baseColorFactor) / 255).tolist()
    factor = linear_to_srgb(
        np.array([red, green, blue])
    )  # factors are linear (glTF 2.0, section 3.9.2), these formats sRGB
    rgba = (*(round(float(c), 6) for c in factor), round(alpha, 6))
    roughness, metallic = float(material.roughnessFactor), float(material.metallicFactor)
    normals = normals_of(part)
    vertices = np.asarray(part.vertices, np.float32)  # a GLB has no more than these digits
    files = {
        f"{folder}/{name}.obj": obj_file(
            vertices,
            np.asarray(part.faces),
            uv=np.asarray(uv, np.float32) if textured else None,
            normals=None if normals is None else np.asarray(normals, np.float32),
            library=f"{name}.mtl",
            material=name,
        ),
        f"{folder}/{name}.mtl": mtl_file(
            name, rgba=rgba, roughness=roughness, metallic=metallic, texture=f"{name}.png" if textured else None
        ),
    }
    if texture is not None:
        files[texture] = _png(image, with_alpha=material.alphaMode in ("BLEND", "MASK"))
    places = len(np.unique(vertices, axis=0))
    return VisualPart(name, files, f"{folder}/{name}.obj", texture, rgba, roughness, metallic, places)


def _png(image: Image.Image, *, with_alpha: bool) -> bytes:
    stream = io.BytesIO()
    image.convert("RGBA" if with_alpha and image.mode == "RGBA" else "RGB").save(stream, "PNG", compress_level=6)
    return stream.getvalue()
