"""Stated camera poses of the photos of an object: one camera per photo, with the lens of the uncropped photo."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

from manitwin.errors import InputError
from manitwin.formats.camera_poses.matching import cameras_of
from manitwin.formats.camera_poses.posed_camera import PosedCamera, turned_upright
from manitwin.formats.camera_poses.read import CameraPoses, read_camera_poses
from manitwin.formats.image_file import full_size
from manitwin.formats.outline_mask import require_mask
from manitwin.formats.printable import printable_line

_ROUNDED_PX, _ROUNDED_SHARE = 1.0, 0.005  # tolerances of the aspect ratio of a scaled image
_UPRIGHT, _TURNED = 1, (6, 8)  # EXIF orientations
_SHOWN = 6
_DIGITS = 9  # of numbers in an identity, as the last digits differ between processors


def without_pose(photos: Sequence[Path], poses: Path) -> list[Path]:
    """Return the photos for which a file has no pose. Raises InputError for an unreadable file."""
    found = read_poses(poses)
    return [
        photo
        for photo, camera in zip(photos, cameras_of(photos, found.cameras, pose_file_label(found)), strict=True)
        if camera is None
    ]


def poses_identity(photos: Sequence[Path], poses: Path) -> list[object]:
    """Return the part of an identity that covers the poses of photos: camera parameters and unit, independent of the file's
    notation.
    """
    found = read_poses(poses)
    cameras = [
        {
            "pose": [_rounded(value) for value in camera.world_to_camera.ravel()],
            "lens": [
                *map(_rounded, (*camera.lens.focal, *(camera.lens.centre_px or ()), *(camera.lens.size_px or ()))),
                camera.lens.fisheye,
                *map(_rounded, camera.lens.distortion),
            ],
        }
        for camera in cameras_of_photos(photos, found)
    ]
    return [found.format, found.unit_m, cameras]


def masks_in_pose_file(photos: Sequence[Path], poses: Path) -> list[Path | None]:
    """Return the mask that a file of poses names for each photo. Raises InputError like ``cameras_of_photos``."""
    return [camera.mask for camera in cameras_of_photos(photos, read_poses(poses))]


def read_poses(poses: Path) -> CameraPoses:
    """Read a file of poses, cached until it changes. Raises InputError."""
    files = sorted(file for file in poses.glob("*") if file.is_file()) if poses.is_dir() else [poses]
    try:
        changed = tuple((file.name, file.stat().st_mtime_ns, file.stat().st_size) for file in files)
    except OSError:
        changed = ()
    return _read_as(poses, changed)


@lru_cache(maxsize=8)
def _read_as(poses: Path, changed: tuple[tuple[str, int, int], ...]) -> CameraPoses:
    return read_camera_poses(poses)


def cameras_of_photos(photos: Sequence[Path], found: CameraPoses) -> list[PosedCamera]:
    """Return the camera of each photo.

    Raises InputError for a photo without a pose or with another aspect ratio than its pose, and for a mask that is missing or
    of another size than its photo.
    """
    file = pose_file_label(found)
    cameras = cameras_of(photos, found.cameras, file)
    missing = [photo.name for photo, camera in zip(photos, cameras, strict=True) if camera is None]
    if missing:
        named = ", ".join(missing[:_SHOWN]) + (f" and {len(missing) - _SHOWN} more" if len(missing) > _SHOWN else "")
        some = ", ".join(camera.file for camera in found.cameras[:3])
        raise InputError(
            "unreadable",
            f"{printable_line(named, max_characters=300)}: no pose in {file}, which has {len(found.cameras)}"
            f" ({printable_line(some, max_characters=200)}{', ...' if len(found.cameras) > 3 else ''}); leave"
            f" {'it' if len(missing) == 1 else 'them'} out, or name the photos as the file does",
        )
    for photo, camera in zip(photos, cameras, strict=True):
        _require_own(photo, camera, found)
    return [
        _of_upright(photo, camera, found) for photo, camera in zip(photos, cameras, strict=True) if camera is not None
    ]


def _require_own(photo: Path, camera: PosedCamera | None, found: CameraPoses) -> None:
    """Raise InputError if the named image exists below the file's folder and differs: splits of a data set reuse file names.

    Only its existence and size are checked, and only inside the folder.
    """
    folder = found.file if found.file.is_dir() else found.file.parent
    if camera is None or os.path.isabs(camera.file):
        return
    named = Path(os.path.normpath(folder / camera.file))
    named = named if named.suffix == photo.suffix else named.with_name(named.name + photo.suffix)
    try:
        there = named.is_relative_to(folder) and named.is_file() and not named.samefile(photo)
        other = there and named.stat().st_size != photo.stat().st_size
    except (OSError, ValueError):  # not a valid file name
        return
    if other:
        shown = printable_line(f"{photo.parent.name}/{photo.name}", max_characters=120)
        own = printable_line(camera.file, max_characters=120)
        raise InputError(
            "unreadable",
            f"{shown}: the pose of this name in {pose_file_label(found)} belongs to another picture, {own}; give the poses of"
            " these photos",
        )


def _of_upright(photo: Path, camera: PosedCamera, found: CameraPoses) -> PosedCamera:
    """Return the camera for the upright photo. Raises InputError if the pose is for an image of another aspect ratio.

    Pose estimation programs use the image as stored, or as rotated by its EXIF orientation; the aspect ratio tells which.
    """
    width, height, orientation = full_size(photo)
    file = pose_file_label(found)
    if camera.mask is not None:
        require_mask(camera.mask, found.file.parent, (width, height), orientation)
    whole = replace(camera, lens=camera.lens.with_picture_size(width, height))
    stated = camera.lens.size_px
    name = printable_line(photo.name, max_characters=120)
    if (
        stated is not None
        and orientation in _TURNED
        and stated[0] != stated[1]
        and _same_shape((height, width), stated)
    ):
        return turned_upright(whole, orientation)
    if stated is not None and not _same_shape((width, height), stated):
        raise InputError(
            "unreadable",
            f"{name}: {width} x {height} pixels, but its pose in {file} is for a picture of {stated[0]:.0f} x"
            f" {stated[1]:.0f};"
            " give the photo uncropped, as it was when the poses were estimated",
        )
    told = stated is not None and stated[0] != stated[1] and orientation in _TURNED
    if orientation != _UPRIGHT and not told:
        raise InputError(
            "unreadable",
            f"{name}: its EXIF orientation rotates it, and its pose in {file} may be that of the picture as it is"
            f" stored; save it upright,"
            " without EXIF orientation, and estimate the poses of that",
        )
    return whole


def _same_shape(size_px: tuple[float, float], stated: tuple[float, float]) -> bool:
    off = abs(size_px[1] * stated[0] / size_px[0] - stated[1])
    return off <= _ROUNDED_PX + _ROUNDED_SHARE * stated[1]


def pose_file_label(found: CameraPoses) -> str:
    """Return the name of a file of poses for messages."""
    return printable_line(found.file.name or str(found.file), max_characters=120)


def _rounded(value: float) -> float:
    return float(f"{value:.{_DIGITS}g}") + 0.0
