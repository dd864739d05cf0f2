"""Reader of the JSON file of a depth camera: intrinsics, picture size, and depth unit."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object

REMEDY = (
    "give fx, fy, cx, cy (or K), width, height and depth_unit_m, such as"
    ' {"fx": 615.0, "fy": 615.0, "cx": 319.5, "cy": 239.5, "width": 640, "height": 480, "depth_unit_m": 0.001}'
)
MAX_CAMERA_BYTES = 1 << 20
_LEAST_BOP_SCALE = 0.02
"""BOP's ``depth_scale`` is in millimetres per unit (0.1 and 1 are common), librealsense's in metres per unit (at most 0.001)."""
_PRINCIPAL = (("cx", "cy"), ("ppx", "ppy"))


@dataclass(frozen=True)
class CameraFile:
    """``intrinsics (3, 3)`` with the upper left pixel's centre at (0.5, 0.5); size in pixels; metres per depth unit."""

    intrinsics: np.ndarray
    width_px: int
    height_px: int
    depth_unit_m: float


def read_camera(path: Path) -> CameraFile:
    """Read a camera file: BOP's ``camera.json``, parameters of OpenCV, ROS or librealsense, or K itself.

    Pixel centres are at whole numbers, as in these, unless ``pixel_centers_at`` is 0.5. Missing values are not assumed. Raises
    UsageError.
    """
    told = read_json_object(path, UsageError, limit_bytes=MAX_CAMERA_BYTES, name=str(path), remedy=REMEDY)
    intrinsics = _intrinsics(told, path)
    centers = told.get("pixel_centers_at", 0)
    if centers not in (0, 0.5) or isinstance(centers, bool):
        raise UsageError(
            f"{path}: pixel_centers_at is {str(centers)[:40]}; 0 (OpenCV, BOP, librealsense) and 0.5 are known"
        )
    intrinsics[:2, 2] += 0.5 - float(centers)
    width_px, height_px = (int(_number(told, key, path)) for key in ("width", "height"))
    return CameraFile(intrinsics, width_px, height_px, _depth_unit_m(told, path))


def _intrinsics(told: dict[str, Any], path: Path) -> np.ndarray:
    given = told.get("K", told.get("cam_K"))
    if given is not None:
        try:
            matrix = np.array(given, float).reshape(3, 3)
        except (TypeError, ValueError, OverflowError) as error:
            raise UsageError(f"{path}: K is not a matrix of 3 x 3 numbers; {REMEDY}") from error
    else:
        principal = next((names for names in _PRINCIPAL if names[0] in told), _PRINCIPAL[0])
        fx, fy, cx, cy = (_number(told, key, path) for key in ("fx", "fy", *principal))
        matrix = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
    upright = matrix[0, 0] > 0 and matrix[1, 1] > 0 and matrix[1, 0] == 0 and (matrix[2] == [0, 0, 1]).all()
    if not upright or not np.isfinite(matrix).all():
        raise UsageError(f"{path}: K is not the matrix of a pinhole camera (fx, fy > 0, last row 0 0 1); {REMEDY}")
    return matrix


def _depth_unit_m(told: dict[str, Any], path: Path) -> float:
    if "depth_unit_m" in told:
        unit = _number(told, "depth_unit_m", path)
    elif "depth_scale" in told:
        scale = _number(told, "depth_scale", path)
        if scale < _LEAST_BOP_SCALE:
            raise UsageError(
                f"{path}: depth_scale {scale:g} may mean metres (librealsense) or millimetres (BOP) per unit; give"
                f" depth_unit_m"
            )
        unit = scale / 1000
    else:
        raise UsageError(f"{path}: does not give the unit of its depths; {REMEDY}")
    if unit > 1:
        raise UsageError(f"{path}: a depth unit of {unit:g} m; give metres per unit, 0.001 for millimetres")
    return unit


def _number(told: dict[str, Any], key: str, path: Path) -> float:
    value = told.get(key)
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0 < value < 1e6:
        said = "is missing" if value is None else f"is {str(value)[:40]}, not a number above 0"
        raise UsageError(f"{path}: {key} {said}; {REMEDY}")
    return float(value)
