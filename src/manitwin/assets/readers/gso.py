"""Reader of Google Scanned Objects: Gazebo models with one texture each, under the licence of the collection."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

from manitwin.assets.asset import Asset
from manitwin.assets.asset_files import MESH_LIMITS
from manitwin.assets.read import SCAN_METADATA, is_file_below
from manitwin.assets.readers.sdf import asset_of, open_sdf
from manitwin.errors import AssetError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.meshes.source import MeshLimits

LICENSE, ATTRIBUTION = "CC-BY-4.0", "Google Research, Google Scanned Objects"
"""Licence and attribution of the whole collection (Downs et al. 2022, arXiv 2204.11918, section 3)."""

_CATEGORY = re.compile(r'categories\s*\{[^}]{0,2000}?first:\s*"([^"]+)"')
_MAX_TEXT = 1 << 20


def read(path: Path, root: Path | None = None, limits: MeshLimits = MESH_LIMITS) -> Asset:
    """Read a model folder, or its model.sdf, like the SDF reader; raises AssetError.

    Textures that a material names beside the mesh are taken from materials/textures, as needed throughout the collection.
    """
    folder = path.parent if path.is_file() else path
    opened = open_sdf(path, root, limits)
    asset = asset_of(opened, path)
    files = opened.files
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
        category=category,
        license=licence,
        attribution=attribution,
        files=files.sorted_files(),
        missing_files=files.missing_names(),
        remarks=tuple(files.remarks),
    )
