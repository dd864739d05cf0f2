"""The root of an asset: the folder above which nothing is read for it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

PACKAGE_MARKS = ("package.xml", "model.config")
"""A package of ROS, and a model of Gazebo: their folders are self-contained."""
LEAST_COMMON_PARTS = 3
"""So much of a path says which file is meant: meshes/base_link.stl is in every second robot's folder."""
_MOST_PARTS, _MOST_FOLDERS = 32, 256
REPOSITORY_MARK = ".git"


def root_of(path: Path, named: Iterable[Path] = ()) -> Path:
    """Return the root of an asset in a file or folder, links resolved.

    It is the folder that the user ``named``, where the asset lies in one; else the repository that it lies in, or the package
    or model (``PACKAGE_MARKS``), or its own folder. A home folder is no repository, nor are those above it.
    """
    own = path.resolve() if path.is_dir() else path.resolve().parent
    within = [folder.resolve() for folder in named if folder.is_dir()]
    holding = [folder for folder in within if own.is_relative_to(folder)]
    if holding:
        return min(holding, key=lambda folder: len(folder.parts))
    private = private_folders()
    above = [folder for folder in (own, *own.parents) if folder not in private]
    for marks in ((REPOSITORY_MARK,), PACKAGE_MARKS):
        for folder in above:
            if any((folder / mark).exists() for mark in marks):
                return folder
    return own


def private_folders() -> frozenset[Path]:
    """Return the user's home folder and those above it, which hold far more than an asset."""
    home = Path.home().resolve()
    return frozenset({home, *home.parents})


def upward(folder: Path, root: Path) -> Iterator[Path]:
    """Yield a folder and those above it up to the root, which comes last; the folder alone where it is not below the root."""
    folder, root = folder.resolve(), root.resolve()
    yield folder
    if folder.is_relative_to(root):
        while folder != root:
            folder = folder.parent
            yield folder


def with_the_path(name: str, folder: Path, root: Path) -> Iterator[Path]:
    """Yield where a file may lie that is not where a description says: what programs load from folders that only they know.

    That is a path of ``LEAST_COMMON_PARTS`` or more of the name's last parts below a folder or one above it up to the root, or
    all of them below a folder directly in one of these. A path from the file system's root may be meant
    from the folder, as PyBullet takes it.
    """
    parts = [
        part for part in name.partition("://")[2 if "://" in name else 0].split("/") if part not in ("", ".", "..")
    ]
    if name.startswith("/") and 0 < len(parts) <= _MOST_PARTS:
        yield folder.joinpath(*parts)
    if not LEAST_COMMON_PARTS <= len(parts) <= _MOST_PARTS:
        return
    for above in upward(folder, root):
        for first in range(len(parts) - LEAST_COMMON_PARTS + 1):
            yield above.joinpath(*parts[first:])
        for beside in _folders_in(above):
            yield beside.joinpath(*parts)


def _folders_in(folder: Path) -> list[Path]:
    try:
        with os.scandir(folder) as scanned:
            inside = [e.name for e in scanned if not e.name.startswith(".") and e.is_dir(follow_symlinks=False)]
    except OSError:
        return []
    return [folder / name for name in sorted(inside)[:_MOST_FOLDERS]]
