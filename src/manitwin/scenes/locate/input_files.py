"""Readers of untrusted pictures and point clouds of a view."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from scipy.spatial import cKDTree

from manitwin.errors import InputError, UsageError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.image_file import read_image
from manitwin.formats.label_picture import MAX_PICTURE_BYTES, parse_label_picture
from manitwin.formats.meshes.ply import read_ply_points
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.formats.npz_file import read_npz_array
from manitwin.scenes.locate.camera_file import CameraFile, read_camera
from manitwin.scenes.locate.depth_view import LEAST_PX, DepthView

CLOUD_ARRAYS = ("points", "xyz_m", "xyz")
MAX_CLOUD_BYTES = 256 << 20
MOST_SIDE_PX = 480
_MOST_TANGENT = float(np.tan(np.deg2rad(89.0)))
_PITCH_OF_SPACING = 1.6
"""Ratio of pixel size to point spacing that leaves few holes in the picture of a cloud."""
_MARGIN = 0.5
"""Margin around a cloud, as share of its size, in which a pose may show what was not observed."""


def read_view(depth: Path, camera: Path, rgb: Path | None, mask: Path | None) -> tuple[DepthView, np.ndarray | None]:
    """Read a depth picture with its camera, its colours and an object mask ``(H, W) bool``; raises UsageError."""
    said = read_camera(camera)
    numbers = _labels(depth, said, camera, "save depths as a 16-bit PNG with one channel")
    pixels = None if rgb is None else _colors(rgb, said, camera)
    told = (
        None
        if mask is None
        else _labels(mask, said, camera, "save masks as a PNG with one channel, 0 outside the object")
    )
    view = DepthView(numbers * said.depth_unit_m, said.intrinsics, pixels, said.depth_unit_m)
    return view, None if told is None else told > 0


def read_cloud(path: Path) -> tuple[DepthView, np.ndarray]:
    """Read the points of one object, m, in the camera's frame (z forward), as a depth picture; raises UsageError.

    ``.ply`` has x, y, z; ``.npz`` an array ``points``, ``xyz_m`` or ``xyz`` ``(N, 3)``.
    """
    if path.suffix.lower() == ".npz":
        points = read_npz_array(path, CLOUD_ARRAYS, MAX_CLOUD_BYTES, UsageError)
    elif path.suffix.lower() == ".ply":
        try:
            points = read_ply_points(MeshSource(path, MeshLimits(max_bytes=MAX_CLOUD_BYTES)))
        except InputError as error:
            raise UsageError(f"{path}: {error.detail}") from error
    else:
        raise UsageError(f"{path}: is not a point cloud; give a .ply, or an .npz with an array of points")
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "fiu":
        raise UsageError(f"{path}: has points of the shape {points.shape}; give (N, 3) numbers, metres")
    points = points[np.isfinite(points).all(1)].astype(float)
    return view_of_cloud(points, str(path))


def view_of_cloud(points_m: np.ndarray, name: str) -> tuple[DepthView, np.ndarray]:
    """Return the depth picture of points ``(N, 3)`` of one object seen from the origin along +z, and its mask.

    Outside the points nothing is seen, and holes between them are unknown. Raises UsageError.
    """
    if len(points_m) < LEAST_PX:
        raise UsageError(f"{name}: {len(points_m)} points; at least {LEAST_PX} are needed")
    if not (points_m[:, 2] > 0).all():
        raise UsageError(
            f"{name}: has points behind the camera; give them in its frame: x right, y down, z ahead, metres"
        )
    tangents = points_m[:, :2] / np.maximum(points_m[:, 2:], np.finfo(float).tiny)
    if np.abs(tangents).max() > _MOST_TANGENT:
        raise UsageError(f"{name}: has points more than 89 degrees off the camera axis; remove them")
    low, high = tangents.min(0), tangents.max(0)
    spacing = float(np.median(cKDTree(tangents).query(tangents, k=2)[0][:, 1]))
    pitch = max(_PITCH_OF_SPACING * spacing, float((high - low).max()) / MOST_SIDE_PX, 1e-6)
    margin = _MARGIN * float((high - low).max())
    width, height = (int(side) for side in np.ceil((high - low + 2 * margin) / pitch) + 1)
    origin = low - margin
    columns, rows = np.floor((tangents - origin) / pitch).astype(int).T
    nearest = np.full(height * width, np.inf)
    np.minimum.at(nearest, rows * width + columns, points_m[:, 2])
    depth = nearest.reshape(height, width)
    mask = np.isfinite(depth)
    closed = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_CLOSE, np.ones((5, 5), np.uint8)).astype(bool)
    depth[closed & ~mask] = 0.0
    intrinsics = np.array([[1 / pitch, 0, -origin[0] / pitch], [0, 1 / pitch, -origin[1] / pitch], [0, 0, 1.0]])
    return DepthView(depth, intrinsics), mask


def _labels(path: Path, camera: CameraFile, camera_path: Path, remedy: str) -> np.ndarray:
    content = read_bytes(path, MAX_PICTURE_BYTES, UsageError, name=str(path))
    return _of_size(parse_label_picture(content, str(path), UsageError, remedy=remedy), path, camera, camera_path)


def _colors(path: Path, camera: CameraFile, camera_path: Path) -> np.ndarray:
    try:
        pixels = read_image(path).pixels[..., :3]
    except InputError as error:
        raise UsageError(f"{path}: {error.detail}") from error
    return _of_size(pixels, path, camera, camera_path)


def _of_size(pixels: np.ndarray, path: Path, camera: CameraFile, camera_path: Path) -> np.ndarray:
    if pixels.shape[:2] != (camera.height_px, camera.width_px):
        raise UsageError(
            f"{path}: {pixels.shape[1]} x {pixels.shape[0]} pixels, but {camera_path} says {camera.width_px} x"
            f" {camera.height_px};"
            " give pictures that are aligned, and their own camera"
        )
    return pixels
