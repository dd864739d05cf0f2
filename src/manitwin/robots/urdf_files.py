"""Where a robot's files are: below its TOML file's folder and nowhere else, or in an installed distribution."""

from __future__ import annotations

import os
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from manitwin.errors import Unavailable, UsageError
from manitwin.robots.definition import UrdfField

PACKAGE, FILE = "package://", "file://"
MAX_FILE_BYTES = 64 << 20
"""The largest mesh of the shipped robots' 98 files is 1.4 MB."""


@dataclass(frozen=True)
class UrdfFiles:
    """A URDF's own path, its SRDF's, the folder of its packages, and the folder that none of its files may leave.

    The files of an ``installed`` distribution may be links into the installer's cache.
    """

    urdf: Path
    srdf: Path | None
    package_folder: Path
    boundary: Path
    installed: bool

    def mesh(self, name: str) -> Path:
        """Return where a mesh of the URDF is; raises UsageError where it is missing, too large or outside."""
        if name.startswith(PACKAGE):
            wanted = self.package_folder / name.removeprefix(PACKAGE).lstrip("/")
        else:
            wanted = self.urdf.parent / name.removeprefix(FILE)
        return _inside(wanted, self.boundary, self.installed, f"{self.urdf.name}: mesh {name[:120]!r}")


def urdf_files(field: UrdfField, folder: Path, robot: str) -> UrdfFiles:
    """Return the places that a robot's file names.

    Raises Unavailable where the distribution is not installed, UsageError where a file is not there or leaves its folder.
    """
    installed = field.distribution is not None
    root = _distribution_folder(field, robot) if installed else folder
    packages = _inside(root / field.package_folder, root, installed, f"robot {robot}: package_folder", directory=True)
    urdf = _inside(root / field.file, root, installed, f"robot {robot}: URDF {field.file!r}")
    srdf = None
    if field.srdf is not None:
        srdf = _inside(root / field.srdf, root, installed, f"robot {robot}: SRDF {field.srdf!r}")
    return UrdfFiles(urdf, srdf, packages, packages if installed else root, installed)


def _distribution_folder(field: UrdfField, robot: str) -> Path:
    remedy = f"pip install 'manitwin[{field.extra}]'" if field.extra else f"pip install {field.distribution}"
    try:
        return Path(str(distribution(str(field.distribution)).locate_file("")))
    except PackageNotFoundError as error:
        raise Unavailable(f"robot {robot} wants the files of {field.distribution}: {remedy}") from error


def _inside(path: Path, boundary: Path, links_allowed: bool, what: str, directory: bool = False) -> Path:
    """Return an absolute path below the boundary, where its links lead too unless they are allowed to; else raise UsageError."""
    try:
        plain, limit = (Path(os.path.normpath(one.absolute())) for one in (path, boundary))
        inside = plain.is_relative_to(limit)
        inside = inside and (links_allowed or path.resolve().is_relative_to(boundary.resolve()))
        there = inside and (plain.is_dir() if directory else plain.is_file())
        too_large = there and plain.stat().st_size > MAX_FILE_BYTES
    except (OSError, ValueError) as error:  # a name that no file system can hold
        raise UsageError(f"{what} cannot be a file: {error}; mend the name") from error
    if not inside:
        raise UsageError(f"{what} leaves {boundary}; put it below that folder")
    if not there:
        raise UsageError(f"{what} is not there: looked for {plain}; put it there, or mend the name")
    if too_large:
        raise UsageError(f"{what} is larger than {MAX_FILE_BYTES >> 20} MiB, which no robot's file is; make it smaller")
    return plain
