"""Photos of one object in a folder: natural order, without those that have no camera pose in a given file."""

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
    """Return a sort key under which numbers in names count as numbers: photo 2 precedes photo 10."""
    parts = re.split(r"([0-9]+)", name)
    return [(0, int(part)) if part.isascii() and part.isdigit() else (1, part) for part in parts if part], name


def order_photos(files: Sequence[Path], poses: Path | None) -> tuple[list[Path], list[Path]]:
    """Return the files of a folder in natural order, and those left out because ``poses`` has no pose for them.

    Pose estimation programs may fail to register some photos. If no photo has a pose, none is left out. Raises UsageError for
    unreadable poses.
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


def missing_pose_messages(without: Sequence[Path], poses: str | Path | None) -> list[str]:
    """Describe the photos of a folder that have no pose; empty if all have one."""
    if not without or poses is None:
        return []
    named = ", ".join(file.name for file in without[:_MOST_SHOWN]) + (", ..." if len(without) > _MOST_SHOWN else "")
    return [f"{Path(poses).name}: no pose of {printable_line(named, max_characters=200)}: left out"]


def listed_views(paths: Sequence[Path], poses: Path | None) -> list[Path]:
    """Return the given photos, with folders expanded. Raises UsageError for a folder without photos."""
    found: list[Path] = []
    for path in paths:
        if not path.is_dir():
            found.append(path)
            continue
        inputs = list_folder(path).inputs
        if not inputs:
            raise UsageError(f"{path}: this folder contains no photo; give photos, or a folder of them")
        found += order_photos(inputs, poses)[0]
    return found
