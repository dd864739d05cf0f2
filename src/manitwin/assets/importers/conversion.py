"""Conversion of an asset to the content of an import: a mesh in metres and a record, as bytes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Literal

from manitwin.assets.asset import Asset, Format
from manitwin.assets.importers.collision_only import with_collision_as_visual
from manitwin.assets.importers.record import asset_to_object, import_record, visible_parts
from manitwin.assets.joints import Joints
from manitwin.assets.read import detect, read_asset
from manitwin.assets.readers.mjcf import count_objects
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.shading_normals import with_normals
from manitwin.formats.meshes.textures import bake_transform
from manitwin.twin.import_record import IMPORT_RECORD, IMPORTED_MESH, ImportRecord

MAX_TEXTURE_SIZE = 8192
"""Texture size limit that leaves textures unchanged: none of the known collections has larger ones."""


def imported_files(asset: Asset) -> tuple[dict[str, bytes], ImportRecord]:
    """Return the files of an imported asset, by name, and its record; raise AssetError if it has no visual mesh.

    ``asset.glb`` has the visual meshes in metres, Y up as glTF requires. The output is deterministic.
    """
    asset = with_collision_as_visual(asset)
    to_object = asset_to_object(asset)
    record = import_record(asset, to_object)
    # boxes and cylinders of a description have sharp edges and no normals that mark them
    parts = [with_normals(bake_transform(part, to_object)) for part in visible_parts(asset)]
    # absent fields are not written, so that the bytes equal those of earlier record versions
    unsaid = {name for name in ("articulation", "friction_range") if getattr(record, name) is None}
    text = json.dumps(record.model_dump(mode="json", exclude=unsaid), indent=1, sort_keys=True, allow_nan=False) + "\n"
    files = {IMPORTED_MESH: write_glb(parts, max_texture_size=MAX_TEXTURE_SIZE), IMPORT_RECORD: text.encode()}
    return files, record


def read_for_import(
    place: Path,
    format: Format | Literal["auto"],
    root: Path | None = None,
    joints: Joints = "keep",
    number: int | None = None,
) -> tuple[dict[str, bytes], ImportRecord]:
    """Read an asset below a ``root`` and return what to import, for use in an isolated process. Raises AssetError."""
    return imported_files(read_asset(place, format, root=root, joints=joints, number=number))


def count_for_import(place: Path, format: Format | Literal["auto"], root: Path | None = None) -> int:
    """Return the number of freely movable objects in an MJCF file; 0 for other formats.

    For use in an isolated process. Raises AssetError.
    """
    return count_objects(place, root) if "mjcf" in (format, detect(place) if format == "auto" else format) else 0
