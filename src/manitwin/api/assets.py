"""Import simulation assets (URDF, MJCF, SDF, USD and mesh files) as inputs of a build."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from manitwin.assets.asset import Format
    from manitwin.assets.importers.importer import Imported


def import_assets(
    paths: str | Path | Iterable[str | Path],
    out: str | Path,
    *,
    format: Format | Literal["auto"] = "auto",
    lock_joints: bool = False,
    each_object: bool = False,
    root: str | Path | None = None,
) -> list[Imported]:
    """Import every asset at or below ``paths`` into a folder of its own below ``out``; return one result per asset.

    The written folders are valid inputs of ``build``.

    - ``lock_joints``: an articulated asset (URDF, MJCF, SDF, USD) becomes one rigid body with its joints fixed where the file
      puts them. Otherwise it keeps its links and joints. Of any other format the first rigid part is imported.
    - ``each_object``: import every freely moving object of an MJCF file as an asset of its own, not only the first one.
    - ``root``: no file above this folder is read. Default: the repository, package or folder of each asset.

    An asset that cannot be read is returned with an ``error`` and without a folder. Existing files are not overwritten. Raises
    UsageError if a path does not exist or is not below ``root``, or if a folder of another kind already has an asset's name.
    """
    from manitwin.assets.importers.importer import import_assets as imported

    given = [paths] if isinstance(paths, str | Path) else paths
    wanted = {"lock_joints": lock_joints, "each_object": each_object}
    below = None if root is None else Path(root)
    return list(imported([Path(path) for path in given], Path(out), format=format, root=below, **wanted))
