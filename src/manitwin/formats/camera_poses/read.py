"""Reading of camera poses from a transforms.json or a COLMAP model."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from manitwin.errors import InputError
from manitwin.formats.camera_poses.colmap_model import CAMERAS, IMAGES, model_files, read_model
from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.formats.camera_poses.transforms_json import read_transforms
from manitwin.formats.missing_path import missing_path_message
from manitwin.formats.printable import printable_line

GIVE = "give a transforms.json (NeRF, instant-ngp, nerfstudio) or the folder of a COLMAP model (cameras and images, .txt or .bin)"


@dataclass(frozen=True)
class CameraPoses:
    """The cameras of a file; ``unit_m`` is the length of its world's unit in metres, None if not stated."""

    format: Literal["transforms.json", "colmap"]
    file: Path
    cameras: tuple[PosedCamera, ...]
    unit_m: float | None


def read_camera_poses(path: Path) -> CameraPoses:
    """Read a transforms.json, or a COLMAP model by its folder or one of its two files; raises InputError with one line."""
    called = printable_line(path.name or str(path), max_characters=200)
    if not path.exists():
        raise InputError("unreadable", f"{called}: {missing_path_message(str(path))}; {GIVE}")
    folder = path if path.is_dir() else path.parent
    if path.is_dir() or (path.stem in (CAMERAS, IMAGES) and path.suffix in (".txt", ".bin")):
        files = model_files(folder)
        if files is None and path.is_dir() and (path / "transforms.json").is_file():
            return read_camera_poses(path / "transforms.json")
        if files is None:
            raise InputError("unreadable", f"{called}: no {CAMERAS} and {IMAGES} of a COLMAP model found; {GIVE}")
        if not path.is_dir():  # in the format, text or binary, of the given file
            files = folder / f"{CAMERAS}{path.suffix}", folder / f"{IMAGES}{path.suffix}"
        return CameraPoses("colmap", folder, tuple(read_model(*files)), None)
    if path.suffix.lower() != ".json":
        raise InputError("wrong_type", f"{called}: not a file of camera poses; {GIVE}")
    cameras, unit_m = read_transforms(path)
    return CameraPoses("transforms.json", path, tuple(cameras), unit_m)
