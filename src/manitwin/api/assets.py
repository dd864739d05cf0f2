"""Import the assets of other tools."""

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
    """Import all assets at and below ``paths`` into folders below ``out`` that ``build`` takes; return what became of each.

    What moves by joints is kept with its links and joints (URDF, MJCF, SDF, USD), of other formats the first rigid part is taken;
    with ``lock_joints`` all of it (the same formats) is one rigid body as the file stands. With ``each_object`` every
    object of an MJCF file that is free to move is an asset, else the first one alone. Nothing is read above ``root``, which is
    each asset's repository, package or own folder where it is not given. An asset that cannot be read has an
    ``error`` and no folder. Nothing is written over. Raises UsageError for a path that is not there or not below ``root``, and
    where a folder of another kind has an asset's name.
    """
    from manitwin.assets.importers.importer import import_assets as imported

    given = [paths] if isinstance(paths, str | Path) else paths
    wanted = {"lock_joints": lock_joints, "each_object": each_object}
    below = None if root is None else Path(root)
    return list(imported([Path(path) for path in given], Path(out), format=format, root=below, **wanted))
