"""Root folder of an asset: the folder above which none of its files are read."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

PACKAGE_MARKS = ("package.xml", "model.config")
"""Files that mark a ROS package and a Gazebo model, whose folders are self-contained."""
LEAST_COMMON_PARTS = 3
"""Number of trailing path parts that identify a file; shorter paths such as meshes/base_link.stl occur in many robots."""
_MOST_PARTS, _MOST_FOLDERS = 32, 256
REPOSITORY_MARK = ".git"


def root_of(path: Path, named: Iterable[Path] = ()) -> Path:
    """Return the root folder of the asset in a file or folder, with symbolic links resolved.

    This is the innermost folder of ``named``, the folders that the user gave, that contains the asset; otherwise the enclosing
    repository, otherwise the enclosing package or model (``PACKAGE_MARKS``), otherwise the asset's own folder. Home folders and
    those above them never count as a repository or package.
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
    """Return the user's home folder and its parents, which hold far more than an asset."""
    home = Path.home().resolve()
    return frozenset({home, *home.parents})


def upward(folder: Path, root: Path) -> Iterator[Path]:
    """Yield a folder and its parents up to and including the root; only the folder if it is not below the root."""
    folder, root = folder.resolve(), root.resolve()
    yield folder
    if folder.is_relative_to(root):
        while folder != root:
            folder = folder.parent
            yield folder


def with_the_path(name: str, folder: Path, root: Path) -> Iterator[Path]:
    """Yield candidate paths of a file that is not where a description says, because programs search folders of their own.

    Candidates are the last ``LEAST_COMMON_PARTS`` or more parts of the name below a folder or a parent up to the root, and all
    parts below any folder directly inside one of these. An absolute path is also tried relative to the folder, as PyBullet
    does.
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
