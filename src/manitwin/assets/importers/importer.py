"""Import of assets of any tool into folders that ``manitwin build`` takes."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from manitwin.assets.importers.asset_name import split_words
from manitwin.assets.read import find_assets, is_file_below, robotwin_data
from manitwin.assets.root import root_of
from manitwin.assets.within_limits import run_within_limits
from manitwin.errors import AssetError, UsageError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.plurals import counted
from manitwin.twin.import_record import ImportRecord, is_imported
from manitwin.twin.store import replace_folder

if TYPE_CHECKING:
    from manitwin.assets.asset import Format
    from manitwin.assets.joints import Joints

READ = "manitwin.assets.importers.conversion:read_for_import"
COUNT = "manitwin.assets.importers.conversion:count_for_import"

_SUFFIXES = (".urdf", ".sdf", ".xml", ".usd", ".usda", ".usdc", ".usdz", ".json")
_MOST_LETTERS = 60
DIGEST_DIGITS = 8
"""32 bits suffice to distinguish the few assets that share a name."""


@dataclass(frozen=True)
class Imported:
    """The outcome for one asset: its folder and record, or a one-line error.

    ``there_already``: the folder held this very asset before and was left unchanged.
    """

    path: Path
    folder: Path | None
    record: ImportRecord | None
    error: str | None = None
    there_already: bool = False


def import_assets(
    paths: Iterable[Path],
    out: Path,
    *,
    format: Format | Literal["auto"] = "auto",
    lock_joints: bool = False,
    each_object: bool = False,
    root: Path | None = None,
) -> Iterator[Imported]:
    """Import all assets at and below paths into ``out``, each into a folder of its name; yield the outcome of each.

    - ``lock_joints``: articulated assets are imported as one rigid body; by default links and joints are kept where the reader
      of the format supports it (``read_asset``).
    - ``each_object``: import every freely movable object of an MJCF file, not only the first.
    - ``root``: the folder above which nothing is read (default: ``root_of`` each asset).

    An asset that cannot be read within limits of time and memory yields an error and is skipped. Nothing is overwritten: an
    asset that was imported before is left unchanged, and a different one of the same name gets a folder name extended by the
    name of its file, or else by a digest of the imported content. Raises UsageError for a path that does not exist or is not
    below ``root``, and where a folder of another kind occupies the name.
    """
    joints: Joints = "lock" if lock_joints else "keep"
    for path in paths:
        if not os.path.exists(path):
            raise UsageError(f"{path}: not there; give an asset's file or folder, or a folder of assets")
        if root is not None and not (root.is_dir() and path.resolve().is_relative_to(root.resolve())):
            raise UsageError(f"{path}: not below the root {root}; name a folder that it lies in, or leave the root out")
        for place in _places(path, format):
            below = root_of(place, [path] if root is None else [root])
            try:
                free = run_within_limits(COUNT, place, format, below) if each_object else 0
            except AssetError as error:
                yield Imported(place, None, None, str(error))
                continue
            for number in range(free) if free else (None,):
                yield _import(place, out, format, below, joints, number)


def _import(
    place: Path, out: Path, format: Format | Literal["auto"], root: Path, joints: Joints, number: int | None
) -> Imported:
    """Import one asset, or the object ``number`` in it."""
    try:
        files, record = run_within_limits(READ, place, format, root, joints, number)
    except AssetError as error:
        return Imported(place, None, None, str(error))
    folder, there_already = _folder_for(files, out, folder_name(record), record.file)
    if not there_already:
        _write(files, folder)
    return Imported(place, folder, record, there_already=there_already)


def kept_properties(record: ImportRecord) -> list[str]:
    """Return descriptions of what an import kept besides the mesh."""
    kept = [] if record.category is None else [record.category]
    kept += [] if record.mass_kg is None else [f"mass {record.mass_kg:.4g} kg"]
    kept += [] if record.center_of_mass_m is None else ["centre of mass"]
    kept += [] if record.inertia_kg_m2 is None else ["inertia"]
    if record.articulation is not None:
        kept.append(f"{len(record.articulation.links)} links, {len(record.articulation.joints)} joints")
    kept += [] if record.friction_static is None else [f"friction {record.friction_static:.3g}"]
    kept += [] if record.friction_dynamic is None else [f"dynamic friction {record.friction_dynamic:.3g}"]
    for count, what in (
        (len(record.captions), "captions"),
        (len(record.functional_points), "functional points"),
        (len(record.grasp_points), "grasp points"),
        (sum(len(grasps.held) for grasps in record.grasps), "grasps"),
        (len(record.rests), "resting poses"),
    ):
        kept += [counted(count, what)] if count else []
    return kept


def folder_name(record: ImportRecord) -> str:
    """Return the folder name of an imported asset: lower-case letters, digits and underscores."""
    stem = Path(record.file).stem if record.format in ("robotwin", "gso", "manitwin100k") else ""
    words = f"{record.name} {stem}" if stem.lower() not in record.name.lower() else record.name
    return _slug(words) or "object"


def _slug(words: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", split_words(words).lower()).strip("_")[:_MOST_LETTERS].rstrip("_")


def _fuller_name(name: str, file: str) -> str:
    """Extend a folder name by the name of the asset's file to distinguish assets of one name: chair_02, kettle_kitchen1."""
    own = _slug(Path(file).stem if Path(file).suffix.lower() in _SUFFIXES else file)
    return own if own.startswith(name) else _slug(f"{name[: _MOST_LETTERS - 1 - len(own)]}_{own}")


def _places(path: Path, format: Format | Literal["auto"]) -> list[Path]:
    if path.is_file():
        return [path]
    if format == "robotwin":
        return robotwin_data(path) or list(find_assets(path))
    found = list(find_assets(path))
    return found or [path]  # the reader then reports what the folder lacks


def _folder_for(files: dict[str, bytes], out: Path, name: str, file: str) -> tuple[Path, bool]:
    """Return the folder for an imported asset, and whether it holds the same asset already.

    If the name is taken by another asset, the name of the asset's file is appended, and failing that a digest of the content.
    """
    digest = hashlib.sha256(b"".join(hashlib.sha256(files[file]).digest() for file in sorted(files))).hexdigest()
    for folder in (out / name, out / _fuller_name(name, file), out / f"{name}_{digest[:DIGEST_DIGITS]}"):
        if not folder.exists():
            return folder, False
        if not is_imported(folder):
            raise UsageError(f"{folder}: there already, and no imported asset; give another folder with -o")
        if all(_has_content(folder, file, content) for file, content in files.items()):
            return folder, True
    raise UsageError(f"{folder}: imported before and changed since; move it away, or give another folder with -o")


def _has_content(folder: Path, name: str, content: bytes) -> bool:
    """Return whether a file in a folder has this content; no more than its length is read."""
    file = folder / name
    if not is_file_below(file, folder) or file.stat().st_size != len(content):
        return False
    return read_bytes(file, len(content), UsageError, inside=folder) == content


def _write(files: dict[str, bytes], folder: Path) -> None:
    """Write a folder under a temporary name first, so that it appears atomically."""
    folder.parent.mkdir(parents=True, exist_ok=True)
    fresh = folder.with_name(f".{folder.name}.new")
    shutil.rmtree(fresh, ignore_errors=True)
    fresh.mkdir()
    for name, content in files.items():
        (fresh / name).write_bytes(content)
    replace_folder(fresh, folder)
