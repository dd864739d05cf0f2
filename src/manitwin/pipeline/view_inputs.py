"""The photos of one thing that lie in a folder: in natural order, without those of which a file of cameras has no pose."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from manitwin.errors import InputError, UsageError
from manitwin.formats.printable import printable_line
from manitwin.formats.source_files import MESH_SUFFIXES
from manitwin.pipeline.folder_listing import list_folder
from manitwin.pipeline.photo_cameras import without_pose

_MOST_SHOWN = 20


def natural_order(name: str) -> tuple[list[tuple[int, int | str]], str]:
    """Return what names are sorted by so that numbers in them count as such: photo 2 comes before photo 10."""
    parts = re.split(r"([0-9]+)", name)
    return [(0, int(part)) if part.isascii() and part.isdigit() else (1, part) for part in parts if part], name


def in_order(files: Sequence[Path], poses: Path | None) -> tuple[list[Path], list[Path]]:
    """Return the files of a folder in natural order, and those that are left out, since ``poses`` has none of them.

    Programs that estimate poses find that some photos go with no others. Where none has a pose, none is left out. Raises
    UsageError for poses that are not read.
    """
    found = sorted(files, key=lambda file: natural_order(str(file)))
    if poses is None:
        return found, []
    try:
        without = without_pose([file for file in found if file.suffix.lower() not in MESH_SUFFIXES], poses)
    except InputError as error:
        raise UsageError(f"--poses: {error.detail}") from error
    kept = [file for file in found if file not in set(without)]
    return (kept, without) if kept else (found, [])


def no_pose_told(without: Sequence[Path], poses: str | Path | None) -> list[str]:
    """Say which photos of a folder have no pose; nothing where all have one."""
    if not without or poses is None:
        return []
    named = ", ".join(file.name for file in without[:_MOST_SHOWN]) + (", ..." if len(without) > _MOST_SHOWN else "")
    return [f"{Path(poses).name}: no pose of {printable_line(named, max_characters=200)}: left out"]


def listed_views(paths: Sequence[Path], poses: Path | None) -> list[Path]:
    """Return the photos that are given, and those of the folders among them; raises UsageError for a folder without any."""
    found: list[Path] = []
    for path in paths:
        if not path.is_dir():
            found.append(path)
            continue
        inputs = list_folder(path).inputs
        if not inputs:
            raise UsageError(f"{path}: this folder contains no photo; give photos, or a folder of them")
        found += in_order(inputs, poses)[0]
    return found
