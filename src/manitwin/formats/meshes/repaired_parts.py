"""Visual parts after mesh repair: surviving faces with the winding of the solid, and patches coloured like their surroundings."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.formats.meshes.textures import (
    color_by_corner,
    linear_to_srgb,
    make_part,
    material_of,
    normals_of,
    pbr_material,
    uv_of,
)
from manitwin.geometry.repair.cascade import RepairResult


def repaired_parts(parts: list[trimesh.Trimesh], result: RepairResult) -> list[trimesh.Trimesh]:
    """Return parts that show exactly the surface of the repaired solid.

    ``result`` is the repair of the faces of all parts in order. Faces that it dropped are removed, flipped ones are reversed
    with their normals, and new ones form a separate part, coloured at every corner like the nearest point of the parts.
    """
    counts = np.array([len(part.faces) for part in parts])
    starts = np.cumsum(counts) - counts
    old = result.source_face >= 0
    kept = np.zeros(counts.sum(), dtype=bool)
    flipped = np.zeros(counts.sum(), dtype=bool)
    kept[result.source_face[old]] = True
    flipped[result.source_face[old]] = result.flipped[old]
    shown = [
        _surviving(part, kept[start : start + count], flipped[start : start + count])
        for part, start, count in zip(parts, starts, counts, strict=True)
        if kept[start : start + count].any()
    ]
    return [*shown, _patch(parts, result)] if not old.all() else shown


def _surviving(part: trimesh.Trimesh, kept: np.ndarray, flipped: np.ndarray) -> trimesh.Trimesh:
    if kept.all() and not flipped.any():
        return part
    faces = np.where(flipped[:, None], part.faces[:, ::-1], part.faces)[kept]
    turned = np.repeat(flipped[kept], 3)
    # a vertex used by both flipped and unflipped faces is duplicated: its normals point both ways
    keys = faces.reshape(-1) * 2 + turned
    used, inverse = np.unique(keys, return_inverse=True)
    old = used // 2
    normals, uv = normals_of(part), uv_of(part)
    if normals is not None:
        normals = normals[old] * np.where(used % 2, -1.0, 1.0)[:, None]
    return make_part(
        part.vertices[old],
        inverse.reshape(-1, 3),
        material=material_of(part),
        name=part.metadata["name"],
        uv=None if uv is None else uv[old],
        normals=normals,
    )


def _patch(parts: list[trimesh.Trimesh], result: RepairResult) -> trimesh.Trimesh:
    faces = result.mesh.faces[result.source_face < 0]
    used, inverse = np.unique(faces, return_inverse=True)
    vertices = np.asarray(result.mesh.vertices)[used]
    # unreferenced vertices have no colour
    referenced = [np.unique(part.faces) for part in parts]
    points = np.concatenate([part.vertices[rows] for part, rows in zip(parts, referenced, strict=True)])
    colors = np.concatenate([_vertex_colors(part)[rows] for part, rows in zip(parts, referenced, strict=True)])
    _, nearest = cKDTree(points).query(vertices)
    owners = np.repeat(np.arange(len(parts)), [len(rows) for rows in referenced])
    around = material_of(parts[int(np.bincount(owners[nearest]).argmax())])
    shade = pbr_material("patch", metallic=around.metallicFactor, roughness=around.roughnessFactor)
    part = make_part(vertices, inverse.reshape(-1, 3), material=shade, name="patch")
    if around.baseColorTexture is None and (colors[nearest] == colors[nearest][0]).all():
        shade.baseColorFactor = around.baseColorFactor
        return part
    return color_by_corner(part, colors[nearest][part.faces])


def _vertex_colors(part: trimesh.Trimesh) -> np.ndarray:
    """Return the base colour ``(V, 3) uint8`` sRGB at every vertex, with the texture sampled at the nearest texel."""
    material, uv = material_of(part), uv_of(part)
    factor = np.asarray(material.baseColorFactor[:3]) / 255
    if material.baseColorTexture is None or uv is None:
        return np.repeat(np.round(linear_to_srgb(factor) * 255).astype(np.uint8)[None], len(part.vertices), axis=0)
    texture = np.asarray(material.baseColorTexture.convert("RGB"))
    height, width = texture.shape[:2]
    column = np.floor(np.mod(uv[:, 0], 1.0) * width).astype(int) % width
    row = np.floor(np.mod(1.0 - uv[:, 1], 1.0) * height).astype(int) % height
    return texture[row, column]
