"""Read an asset of any tool."""

from __future__ import annotations

import os
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Literal

from manitwin.assets.asset import Asset, Format
from manitwin.assets.detect import detect, file_format, folder_format, robotwin_data
from manitwin.errors import AssetError, choose_from

FORMATS: tuple[Format, ...] = ("twin", "urdf", "mjcf", "sdf", "usd", "robotwin", "manitwin100k", "embodiedgen", "gso")


def read_asset(path: Path, format: Format | Literal["auto"] = "auto") -> Asset:
    """Read the asset at a path, ``auto``: of the format that ``detect`` tells; raises AssetError.

    A format's reader, and the engine that it may need, are loaded only when they are used.
    """
    if format != "auto" and format not in FORMATS:
        raise AssetError(choose_from("format", format, ("auto", *FORMATS)))
    if not path.exists():
        raise AssetError(f"{path}: no such file or folder")
    chosen = detect(path) if format == "auto" else format
    reader = import_module(f"manitwin.assets.readers.{chosen}")
    asset: Asset = reader.read(path)
    return asset


def find_assets(path: Path) -> Iterator[Path]:
    """Yield every asset at or below a path, in the order of their names; hidden folders are left out.

    A folder that is one asset as a whole is not looked into, and links to folders are not followed. A RoboTwin folder
    gives its model_data files. Raises AssetError where the path is not there.
    """
    if not path.exists():
        raise AssetError(f"{path}: no such file or folder")
    if path.is_file():
        yield path
        return
    form = folder_format(path)
    if form == "robotwin":
        yield from robotwin_data(path)
        return
    if form is not None:
        yield path
        return
    with os.scandir(path) as scanned:
        entries = sorted((entry for entry in scanned if not entry.name.startswith(".")), key=lambda e: e.name)
    for entry in entries:
        if entry.is_file() and file_format(Path(entry.path)) is not None:
            yield Path(entry.path)
    for entry in entries:
        if entry.is_dir(follow_symlinks=False):
            yield from find_assets(Path(entry.path))
