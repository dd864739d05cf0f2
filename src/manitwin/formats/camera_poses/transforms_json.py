"""Reader and writer of ``transforms.json`` of NeRF's synthetic scenes, instant-ngp and nerfstudio: OpenGL poses to world."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path, PurePosixPath
from typing import Any

import numpy as np

from manitwin.errors import AssetError, InputError
from manitwin.formats.camera_poses.posed_camera import MOST_CAMERAS, Lens, PosedCamera, checked_lens, orthonormalized
from manitwin.formats.json_file import json_number, read_json_object
from manitwin.formats.printable import printable_line

OPENGL_TO_OPENCV = np.diag([1.0, -1.0, -1.0])
"""Maps x right, y up, z backward to x right, y down, z forward."""
UNITS = {
    **dict.fromkeys(("m", "metre", "metres", "meter", "meters"), 1.0),
    **dict.fromkeys(("cm", "centimetre", "centimetres", "centimeter", "centimeters"), 0.01),
    **dict.fromkeys(("mm", "millimetre", "millimetres", "millimeter", "millimeters"), 0.001),
}
"""Metres of the unit that a file may state under the key ``units``; the format itself defines none."""
_PINHOLE = frozenset({"OPENCV", "PINHOLE", "SIMPLE_PINHOLE", "SIMPLE_RADIAL", "RADIAL", "FULL_OPENCV", "PERSPECTIVE"})
_FISHEYE = frozenset({"OPENCV_FISHEYE", "SIMPLE_RADIAL_FISHEYE", "RADIAL_FISHEYE", "FISHEYE"})
_PINHOLE_NAMES = ("k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6")
_FISHEYE_NAMES = ("k1", "k2", "k3", "k4")
_FOCAL = ("fl_x", "fl_y", "camera_angle_x", "camera_angle_y")
_SHOWN = 80

_refused = partial(InputError, "unreadable")


def read_transforms(path: Path) -> tuple[list[PosedCamera], float | None]:
    """Return the cameras of a file in its order, and the length of its unit in metres, None if not stated.

    Lens values of a frame override those of the file. A frame's ``mask_path`` is relative to the file's folder; its existence
    is not checked. Raises InputError with one line.
    """
    document = read_json_object(path, _refused)
    frames = document.get("frames")
    if not isinstance(frames, list) or not frames:
        raise _refused(
            f"{_name(path)}: it has no list 'frames'; give a transforms.json of NeRF, instant-ngp or nerfstudio"
        )
    if len(frames) > MOST_CAMERAS:
        raise _refused(f"{_name(path)}: {len(frames)} frames exceed the limit of {MOST_CAMERAS}; leave some out")
    try:
        return [_camera(path, number, frame, document) for number, frame in enumerate(frames)], _unit_m(path, document)
    except AssetError as error:
        raise _refused(f"{_name(path)}: {error}; correct the file") from error


def transforms_of(
    cameras: Sequence[PosedCamera], names: Sequence[str], unit_m: float | None, masks: Mapping[Path, str]
) -> dict[str, Any]:
    """Return the content of a transforms.json for photos called ``names``; each lens is a result of ``Lens.of_picture``.

    ``masks`` maps the masks of the cameras to their names.
    """
    document: dict[str, Any] = {} if unit_m is None else {"units": next(k for k, v in UNITS.items() if v == unit_m)}
    return document | {"frames": [_frame(camera, name, masks) for camera, name in zip(cameras, names, strict=True)]}


def _frame(camera: PosedCamera, name: str, masks: Mapping[Path, str]) -> dict[str, Any]:
    lens, pose = camera.lens, np.eye(4)
    turn = camera.world_to_camera[:, :3].T
    pose[:3, :3], pose[:3, 3] = turn @ OPENGL_TO_OPENCV, -turn @ camera.world_to_camera[:, 3]
    size, centre = lens.size_px or (0.0, 0.0), lens.centre_px or (0.0, 0.0)
    distortion = dict(zip(_FISHEYE_NAMES if lens.fisheye else _PINHOLE_NAMES, lens.distortion, strict=False))
    return {
        "file_path": name,
        "transform_matrix": pose.tolist(),
        "camera_model": "OPENCV_FISHEYE" if lens.fisheye else "OPENCV",
        "fl_x": lens.focal[0],
        "fl_y": lens.focal[1],
        "cx": centre[0],
        "cy": centre[1],
        "w": size[0],
        "h": size[1],
        **distortion,
        **({} if camera.mask is None else {"mask_path": masks[camera.mask]}),
    }


def _camera(path: Path, number: int, frame: Any, document: Mapping[str, Any]) -> PosedCamera:
    if not isinstance(frame, dict) or not isinstance(frame.get("file_path"), str) or not frame["file_path"].strip():
        raise _refused(f"{_name(path)}: frame {number} has no file_path; name its photo there")
    told = f"{_name(path)}: frame {number} ({printable_line(frame['file_path'], max_characters=_SHOWN)})"
    to_world = orthonormalized(_matrix(frame.get("transform_matrix"), told), f"{told}: transform_matrix")
    turn = OPENGL_TO_OPENCV @ to_world[:, :3].T
    pose = np.column_stack([turn, -turn @ to_world[:, 3]])
    lens = _lens(_lens_values(document, frame), told)
    return PosedCamera(frame["file_path"], pose, lens, mask=_mask(path, frame.get("mask_path"), told))


def _lens_values(document: Mapping[str, Any], frame: Mapping[str, Any]) -> dict[str, Any]:
    """Return the lens values of a frame: its own focal length replaces all focal values of the file."""
    own = any(frame.get(key) is not None for key in _FOCAL)
    return {**{key: value for key, value in document.items() if not (own and key in _FOCAL)}, **frame}


def _mask(path: Path, said: Any, told: str) -> Path | None:
    if said is None:
        return None
    relative = PurePosixPath(said.strip().replace("\\", "/")) if isinstance(said, str) else PurePosixPath()
    if not relative.parts or "\0" in str(relative):
        raise _refused(
            f"{told}: mask_path names no file; give a path below the folder of {_name(path)}, or leave it out"
        )
    if relative.is_absolute() or relative.parts[0].endswith(":") or ".." in relative.parts:
        shown = printable_line(said, max_characters=_SHOWN)
        raise _refused(f"{told}: mask_path {shown} leads outside the folder of {_name(path)}; keep the masks below it")
    return path.parent / relative


def _matrix(value: Any, told: str) -> np.ndarray:
    rows = value if isinstance(value, list) else []
    if len(rows) not in (3, 4) or not all(isinstance(row, list) and len(row) == 4 for row in rows):
        raise _refused(
            f"{told}: transform_matrix does not have 4 rows of 4 numbers; write the camera's pose to the world"
        )
    matrix = np.array([[json_number(each, "transform_matrix") for each in row] for row in rows])
    if len(rows) == 4 and np.abs(matrix[3] - [0, 0, 0, 1]).max() > 1e-6:
        raise _refused(f"{told}: the last row of transform_matrix is not 0, 0, 0, 1; write the matrix row by row")
    return matrix[:3]


def _lens(said: Mapping[str, Any], told: str) -> Lens:
    def number(key: str) -> float | None:
        return None if said.get(key) is None else json_number(said[key], key)

    fisheye = _is_fisheye(said, told)
    width, height = number("w"), number("h")
    size = None if width is None or height is None else (width, height)
    middle = number("cx"), number("cy")
    centre = None if middle[0] is None or middle[1] is None else (middle[0], middle[1])
    focal, in_widths = (number("fl_x"), number("fl_y")), False
    if focal[0] is None:
        angle = number("camera_angle_x")
        if angle is None or not 0 < angle < math.pi:
            raise _refused(f"{told}: the lens is not given; give fl_x (pixels), or camera_angle_x between 0 and pi")
        focal, in_widths = (0.5 / math.tan(angle / 2), None), True
        vertical = number("camera_angle_y")
        if vertical is not None and size is not None and 0 < vertical < math.pi:
            focal = focal[0], 0.5 / math.tan(vertical / 2) * size[1] / size[0]
    along_x = float(focal[0] or 0.0)
    names = _FISHEYE_NAMES if fisheye else _PINHOLE_NAMES
    bent = tuple(number(name) or 0.0 for name in names)
    distortion = bent if any(bent) or fisheye else ()
    both = along_x, along_x if focal[1] is None else focal[1]
    return checked_lens(Lens(both, centre, size, in_widths, distortion, fisheye), told)


def _is_fisheye(said: Mapping[str, Any], told: str) -> bool:
    model = said.get("camera_model")
    if model is None or (isinstance(model, str) and model in _PINHOLE):
        return said.get("is_fisheye") is True
    if isinstance(model, str) and model in _FISHEYE:
        return True
    shown = printable_line(str(model), max_characters=_SHOWN)
    raise _refused(f"{told}: the camera model {shown} is not read; known: {', '.join(sorted(_PINHOLE | _FISHEYE))}")


def _unit_m(path: Path, document: Mapping[str, Any]) -> float | None:
    said = document.get("units", document.get("unit"))
    if said is None:
        return None
    unit_m = UNITS.get(said.strip().lower()) if isinstance(said, str) else None
    if unit_m is None:
        shown = printable_line(str(said), max_characters=_SHOWN)
        raise _refused(f"{_name(path)}: units is {shown}; give m, cm or mm, or leave it out")
    return unit_m


def _name(path: Path) -> str:
    return printable_line(path.name, max_characters=_SHOWN)
