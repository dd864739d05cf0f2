"""Google Scanned Objects: models of Gazebo with one texture each, and their collection's licence."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import trimesh

from manitwin.assets.asset import Asset
from manitwin.assets.asset_files import MESH_LIMITS, AssetFiles
from manitwin.assets.read import SCAN_METADATA, is_file_below
from manitwin.assets.readers.sdf import asset_of, open_sdf
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.meshes.source import MeshSource
from manitwin.formats.meshes.textures import decode_texture, make_part, material_of, normals_of, uv_of

LICENSE, ATTRIBUTION = "CC-BY-4.0", "Google Research, Google Scanned Objects"
"""Of the collection as a whole (Downs et al. 2022, arXiv 2204.11918, section 3)."""

_CATEGORY = re.compile(r'categories\s*\{[^}]{0,2000}?first:\s*"([^"]+)"')
_MAX_TEXT = 1 << 20


def read(path: Path) -> Asset:
    """Read a model's folder, or its model.sdf, as the SDF reader does; raises AssetError.

    Textures are taken from materials/textures where the material names them beside the mesh, as all of the collection do.
    """
    folder = path.parent if path.is_file() else path
    opened = open_sdf(path)
    asset = asset_of(opened, path)
    files = opened.files
    visual = tuple(_textured(list(asset.visual), files, folder))
    metadata, category = folder / SCAN_METADATA, None
    licence, attribution = asset.license, asset.attribution
    if is_file_below(metadata, folder) and metadata.stat().st_size <= _MAX_TEXT:
        files.used.add(metadata.resolve())
        content = read_bytes(metadata, _MAX_TEXT, AssetError, inside=folder)
        found = _CATEGORY.search(content.decode("utf-8", errors="replace"))
        category = found.group(1) if found else None
        if licence is None:
            licence, attribution = LICENSE, ATTRIBUTION
            files.remark(f"the licence {LICENSE} is that of the collection; the folder does not state one")
    return replace(
        asset,
        format="gso",
        visual=visual,
        category=category,
        license=licence,
        attribution=attribution,
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=tuple(files.remarks),
    )


def _textured(parts: list[trimesh.Trimesh], files: AssetFiles, folder: Path) -> list[trimesh.Trimesh]:
    """Put the model's one texture on parts that name one beside the mesh, where it is not."""
    pictures = (folder / "materials" / "textures").glob("*.png")
    textures = sorted(file for file in pictures if is_file_below(file, folder))
    bare = [p for p in parts if uv_of(p) is not None and material_of(p).baseColorTexture is None]
    absent = [name for name in files.missing if Path(name).name in {t.name for t in textures}]
    if not bare or not absent:
        return parts
    file = next(t for t in textures if t.name == Path(absent[0]).name)
    source = MeshSource(file, MESH_LIMITS)
    image = decode_texture(source.data(), file.name, source)
    files.missing = [name for name in files.missing if name not in absent]
    if image is None:
        files.remark(f"texture {file.name} cannot be read")
        return parts
    files.used.add(file.resolve())
    dressed = []
    for part in parts:
        if any(part is other for other in bare):
            material = material_of(part).copy()
            material.baseColorTexture, material.baseColorFactor = image, np.full(4, 255, np.uint8)
            name, uv, normals = part.metadata["name"], uv_of(part), normals_of(part)
            part = make_part(part.vertices, part.faces, material=material, name=name, uv=uv, normals=normals)
        dressed.append(part)
    return dressed
