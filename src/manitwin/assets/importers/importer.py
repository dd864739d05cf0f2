"""Bring an asset of any tool to the folder that ``manitwin build`` takes."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from manitwin.assets.asset import Asset, Format
from manitwin.assets.importers.record import asset_to_object, import_record, shown_parts
from manitwin.assets.read import find_assets, read_asset, robotwin_data
from manitwin.errors import AssetError, UsageError
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.textures import bake_transform
from manitwin.twin.import_record import IMPORT_RECORD, IMPORTED_MESH, ImportRecord, is_imported
from manitwin.twin.store import replace_folder

MAX_TEXTURE_SIZE = 8192
"""Textures are kept as they are: none of the collections has larger ones."""

DIGEST_DIGITS = 8
"""32 bits tell apart the few assets that share a name."""


@dataclass(frozen=True)
class Imported:
    """The outcome for one asset: the folder and its record, or the one line that says why there is none.

    ``there_already``: the folder holds this very asset from before and was left as it is.
    """

    path: Path
    folder: Path | None
    record: ImportRecord | None
    error: str | None = None
    there_already: bool = False


def imported_files(asset: Asset) -> tuple[dict[str, bytes], ImportRecord]:
    """Return the files of an imported asset, by name, and its record; raises AssetError where it has no visual mesh.

    ``asset.glb`` has the visual meshes in metres, Y up as glTF is; the same asset gives the same bytes.
    """
    to_object = asset_to_object(asset)
    record = import_record(asset, to_object)
    parts = [bake_transform(part, to_object) for part in shown_parts(asset)]
    text = json.dumps(record.model_dump(mode="json"), indent=1, sort_keys=True, allow_nan=False) + "\n"
    files = {IMPORTED_MESH: write_glb(parts, max_texture_size=MAX_TEXTURE_SIZE), IMPORT_RECORD: text.encode()}
    return files, record


def import_assets(paths: Iterable[Path], out: Path, *, format: Format | Literal["auto"] = "auto") -> Iterator[Imported]:
    """Import all assets at and below paths into ``out``, each into a folder of its name; yield what became of each.

    An asset that cannot be read is said and left out. Nothing is written over: an asset that is there already is left as it
    is, and another one of the same name gets a folder whose name ends in a digest of what was imported. Raises UsageError
    for a path that is not there, and where a folder of another kind has the name.
    """
    for path in paths:
        if not path.exists():
            raise UsageError(f"{path}: not there; give an asset's file or folder, or a folder of assets")
        for place in _places(path, format):
            try:
                files, record = imported_files(read_asset(place, format))
            except AssetError as error:
                yield Imported(place, None, None, str(error))
                continue
            folder, there_already = _folder_for(files, out, folder_name(record))
            if not there_already:
                _write(files, folder)
            yield Imported(place, folder, record, there_already=there_already)


def folder_name(record: ImportRecord) -> str:
    """Return a folder's name for an imported asset: letters, digits and underscores."""
    stem = Path(record.file).stem if record.format in ("robotwin", "gso", "manitwin100k") else ""
    words = f"{record.name} {stem}" if stem.lower() not in record.name.lower() else record.name
    return re.sub(r"[^a-z0-9]+", "_", words.lower()).strip("_")[:60] or "object"


def _places(path: Path, format: Format | Literal["auto"]) -> list[Path]:
    if path.is_file():
        return [path]
    if format == "robotwin":
        return robotwin_data(path) or list(find_assets(path))
    found = list(find_assets(path))
    return found or [path]  # then the reader says what the folder lacks


def _folder_for(files: dict[str, bytes], out: Path, name: str) -> tuple[Path, bool]:
    """Return the folder of an imported asset, and whether the same asset is there already."""
    digest = hashlib.sha256(b"".join(hashlib.sha256(files[file]).digest() for file in sorted(files))).hexdigest()
    for folder in (out / name, out / f"{name}_{digest[:DIGEST_DIGITS]}"):
        if not folder.exists():
            return folder, False
        if not is_imported(folder):
            raise UsageError(f"{folder}: there already, and no imported asset; give another folder with -o")
        if all((folder / file).is_file() and (folder / file).read_bytes() == files[file] for file in files):
            return folder, True
    raise UsageError(f"{folder}: imported before and changed since; move it away, or give another folder with -o")


def _write(files: dict[str, bytes], folder: Path) -> None:
    """Write a folder under another name first, so that none is ever half there."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    fresh = folder.with_name(f".{folder.name}.new")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir()
    for name, content in files.items():
        (fresh / name).write_bytes(content)
    replace_folder(fresh, folder)
