"""Surface of an SDF <heightmap>, which is a picture of heights."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import trimesh
from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles
from manitwin.errors import AssetError
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import decode_texture
from manitwin.formats.xml_file import numbers, text_of

_MOST_POINTS = 257
"""Largest number of points along a side: a finer picture is subsampled, which is enough for a terrain."""
_LARGEST = 255.0


def terrain(shape: etree._Element, path: Path, files: AssetFiles, what: str) -> trimesh.Trimesh | None:
    """Return the surface, centred on its size; None with a remark if the picture cannot be decoded.

    White is as high as <size> states, black is 0 (SDFormat specification 1.9, heightmap). Raises AssetError for a size that is
    not positive.
    """
    size = numbers(text_of(shape, "size") or "1 1 1", 3, f"{what} size")
    if (size <= 0).any():
        raise AssetError(f"{what} size: {size.min()} is not above zero")
    place = numbers(text_of(shape, "pos") or "0 0 0", 3, f"{what} pos")
    notes = MeshSource(path, MESH_LIMITS)
    image = decode_texture(notes.data(), path.name, notes)
    for sentence in notes.findings:
        files.remark(sentence)
    if image is None or min(image.size) < 2:
        return None
    heights = np.asarray(image.convert("L"), float)[::-1] / _LARGEST  # from the lowest row up
    step = -(-max(heights.shape) // _MOST_POINTS)
    if step > 1:
        files.remark(f"of its heights every {step}th was read")
        heights = heights[::step, ::step]
    rows, columns = heights.shape
    files.count_shape(2 * rows * columns)
    x, y = np.meshgrid(np.linspace(-0.5, 0.5, columns), np.linspace(-0.5, 0.5, rows))
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).reshape(-1)
    lower = np.column_stack([corner, corner + 1, corner + columns + 1])
    upper = np.column_stack([corner, corner + columns + 1, corner + columns])
    vertices = np.column_stack([x.reshape(-1), y.reshape(-1), heights.reshape(-1)]) * size + place
    return trimesh.Trimesh(vertices, np.concatenate([lower, upper]), process=False)
