"""Mesh files of a twin for XML formats: visual parts as OBJ, MTL and PNG, hulls as OBJ."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import trimesh
from PIL import Image

from manitwin.assets.writers.exporter import TwinContent
from manitwin.errors import ExportError
from manitwin.formats.meshes.textures import linear_to_srgb, material_of, normals_of, uv_of


@dataclass(frozen=True)
class VisualPart:
    """A textured mesh with its files by name, all in one folder, and its material.

    ``mesh`` and ``texture`` are names in ``files``. ``rgba`` is in sRGB and multiplies the texture. ``places`` is the number of
    distinct vertex positions.
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
    """Return the visual parts below ``folder``, in the object frame, with names unique to the twin."""
    return tuple(_visual_part(part, f"{twin.name}_visual_{i:02d}", folder) for i, part in enumerate(twin.visual))


def hulls_of(twin: TwinContent) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
    """Return the hulls of a twin. Raises ExportError if it has none, since such a body falls through the floor."""
    if not twin.hulls:
        raise ExportError(f"{twin.name}: it has no collision hulls; build the twin again")
    return twin.hulls


def hull_files(twin: TwinContent, folder: str) -> dict[str, bytes]:
    """Return the collision hulls below ``folder``: one OBJ file each, in the object frame, by name, in the order of the twin.

    Raises ExportError if there are none.
    """
    return {
        f"{folder}/{twin.name}_hull_{i:02d}.obj": obj_file(vertices, faces)
        for i, (vertices, faces) in enumerate(hulls_of(twin))
    }


def lost_texture_lines(twin: TwinContent) -> tuple[str, ...]:
    """Return README lines on the textures that an OBJ material cannot hold."""
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
    )  # factors are linear (glTF 2.0, section 3.9.2); these formats use sRGB
    rgba = (*(round(float(c), 6) for c in factor), round(alpha, 6))
    roughness, metallic = float(material.roughnessFactor), float(material.metallicFactor)
    normals = normals_of(part)
    vertices = np.asarray(part.vertices, np.float32)  # a GLB stores single precision
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


def obj_file(
    vertices: np.ndarray,
    faces: np.ndarray,
    *,
    uv: np.ndarray | None = None,
    normals: np.ndarray | None = None,
    library: str | None = None,
    material: str | None = None,
) -> bytes:
    """Return an OBJ file with one object.

    ``vertices (V, 3)`` are in metres; ``faces (F, 3)``; ``uv (V, 2)`` has its origin at the lower left as in OBJ;
    ``normals (V, 3)``. Coincident vertices are written once, so that a solid with texture seams stays closed for tools that
    compare indices. Numbers have the fewest digits that restore them exactly in the precision of the arrays.
    """
    lines = [f"mtllib {library}"] if library is not None else []
    corners: list[np.ndarray | None] = []
    for keyword, rows in (("v", vertices), ("vt", uv), ("vn", normals)):
        if rows is None:
            corners.append(None)
            continue
        distinct, index = np.unique(rows + 0.0, axis=0, return_inverse=True)  # + 0.0: no negative zeros
        lines += [f"{keyword} {' '.join(row)}" for row in distinct.astype(str).tolist()]
        corners.append((index.reshape(-1)[faces] + 1).astype(str))
    if material is not None:
        lines.append(f"usemtl {material}")
    lines += [f"f {' '.join(face)}" for face in _format_corners(*corners).tolist()]
    return ("\n".join(lines) + "\n").encode("ascii")


def mtl_file(
    name: str, *, rgba: tuple[float, float, float, float], roughness: float, metallic: float, texture: str | None
) -> bytes:
    """Return a material library with one material; ``rgba`` is in sRGB, ``texture`` the name of a file beside it.

    ``Pr`` and ``Pm`` are roughness and metalness in the PBR extension that Blender and assimp read.
    """
    red, green, blue, alpha = rgba
    lines = [
        f"newmtl {name}",
        f"Kd {red!r} {green!r} {blue!r}",
        f"d {alpha!r}",
        "illum 2",
        f"Pr {roughness!r}",
        f"Pm {metallic!r}",
    ]
    if texture is not None:
        lines.append(f"map_Kd {texture}")
    return ("\n".join(lines) + "\n").encode("ascii")


def _format_corners(place: np.ndarray | None, uv: np.ndarray | None, normal: np.ndarray | None) -> np.ndarray:
    """Format the corners of faces ``(F, 3)`` as ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``."""
    assert place is not None
    words = place
    if uv is not None or normal is not None:
        words = np.strings.add(words, "/")
    if uv is not None:
        words = np.strings.add(words, uv)
    if normal is not None:
        words = np.strings.add(np.strings.add(words, "/"), normal)
    return words


def object_mesh(twin: TwinContent) -> bytes:
    """Return all visual parts as one OBJ file without materials: metres, +Z up, origin at the bottom centre."""
    vertices, faces = trimesh.util.append_faces([p.vertices for p in twin.visual], [p.faces for p in twin.visual])
    return obj_file(np.asarray(vertices, np.float32), np.asarray(faces))  # a GLB stores single precision
