"""Vertex and face colours as a texture: engines that know only textures show them too."""

from __future__ import annotations

import numpy as np
import trimesh
from PIL import Image

from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import make_part, material_of, normals_of, srgb_to_linear

_MAX_ATLAS = 4096
_CELL_SIZES = (
    8,
    4,
)  # 8 pixels are JPEG's own block, so colours do not leak between cells; 4 are the fewest for two triangles


def color_by_corner(
    part: trimesh.Trimesh, corner_colors: np.ndarray, source: MeshSource | None = None
) -> trimesh.Trimesh:
    """Return the part with its corner colours ``(F, 3, 3) uint8`` sRGB painted into a base colour texture of its own.

    Two triangles share a square cell of the atlas, its diagonal free between them; the corners lie on texel centres, so
    bilinear sampling gives the linear blend of the three colours. Vertices are then no longer shared between faces.
    More faces than an atlas of 4096 pixels holds get their mean colour, with a finding.
    """
    count = len(part.faces)
    across = max(int(np.ceil(np.sqrt((count + 1) // 2))), 1)
    cell = next((size for size in _CELL_SIZES if across * size <= _MAX_ATLAS), None)
    material = material_of(part).copy()
    if cell is None or count == 0:
        if count and source is not None:
            source.find(
                f"the colours of {count} vertices and faces were replaced by their mean: too many for a texture"
            )
        mean = corner_colors.reshape(-1, 3).mean(0) if count else np.full(3, 255)
        factor = np.append(srgb_to_linear(mean / 255) * 255, 255)
        material.baseColorFactor = np.round(factor * (material.baseColorFactor / 255)).astype(np.uint8)
        return make_part(part.vertices, part.faces, material=material, name=part.metadata["name"])
    material.baseColorTexture = Image.fromarray(_paint(corner_colors, across, cell))
    corners, normals = part.faces.reshape(-1), normals_of(part)
    return make_part(
        part.vertices[corners],
        np.arange(3 * count).reshape(-1, 3),
        material=material,
        name=part.metadata["name"],
        uv=_corner_uv(count, across, cell),
        normals=None if normals is None else normals[corners],
    )


def _paint(corner_colors: np.ndarray, across: int, cell: int) -> np.ndarray:
    """Return the atlas ``(across * cell, across * cell, 3) uint8``, row 0 at the top."""
    colors = np.zeros((2 * across * across, 3, 3))
    colors[: len(corner_colors)] = corner_colors
    column, row = np.meshgrid(np.arange(cell), np.arange(cell))
    span = cell - 3
    upper = _blend(column / span, row / span)
    lower = _blend((cell - 1 - column) / span, (cell - 1 - row) / span)
    diagonal = column + row
    share = np.select([diagonal < cell - 1, diagonal == cell - 1], [1.0, 0.5], 0.0)[..., None]
    tiles = np.einsum("yxk,nkc->nyxc", upper * share, colors[0::2]) + np.einsum(
        "yxk,nkc->nyxc", lower * (1 - share), colors[1::2]
    )
    pixels = (
        tiles.reshape(across, across, cell, cell, 3).transpose(0, 2, 1, 3, 4).reshape(across * cell, across * cell, 3)
    )
    return np.clip(np.round(pixels), 0, 255).astype(np.uint8)


def _blend(second: np.ndarray, third: np.ndarray) -> np.ndarray:
    """Return barycentric weights ``(..., 3)``; a texel beyond the edge goes on with the same slope."""
    return np.stack([1 - second - third, second, third], axis=-1)


def _corner_uv(count: int, across: int, cell: int) -> np.ndarray:
    """Return the texture coordinates ``(3 * count, 2)`` of all corners, origin at the lower left."""
    far = cell - 1
    places = np.array([[(0, 0), (cell - 3, 0), (0, cell - 3)], [(far, far), (2, far), (far, 2)]], dtype=float)
    face = np.arange(count)
    origin = np.stack([face // 2 % across, face // 2 // across], axis=1) * cell
    pixels = (places[face % 2] + origin[:, None] + 0.5) / (across * cell)
    return np.stack([pixels[..., 0], 1 - pixels[..., 1]], axis=-1).reshape(-1, 2)
