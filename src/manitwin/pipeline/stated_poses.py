"""Stated camera poses of the photos of an object: one per photo, in an upright world, with the known unit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from manitwin.errors import InputError
from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.formats.camera_poses.read import CameraPoses
from manitwin.geometry.camera_up import (
    MOST_ROLL_DEG,
    UpDirection,
    azimuth_deg,
    up_from_level_cameras,
    up_from_world_axis,
)
from manitwin.geometry.length_unit import UNITS_M
from manitwin.geometry.poses import rotation_between
from manitwin.pipeline.item import Item, masks_of
from manitwin.pipeline.photo_cameras import cameras_of_photos, pose_file_label, read_poses

USUAL_UP = {"transforms.json": "z", "colmap": None}
"""The usual up axis of each format's files; a COLMAP model has an arbitrary orientation."""


@dataclass(frozen=True)
class StatedPoses:
    """One camera per photo, ``cameras``, with lenses for the uncropped photos and z up in the world.

    ``file`` and ``format`` are their source; ``unit_m`` is their unit in metres, None if unknown, and ``unit_said`` its source.
    """

    file: str
    format: str
    cameras: tuple[PosedCamera, ...]
    up: UpDirection
    unit_m: float | None
    unit_said: str

    @property
    def turns_deg(self) -> tuple[float, ...]:
        """The cameras' rotations about the vertical, counter-clockwise seen from above, relative to the first."""
        turns = [azimuth_deg(camera.world_to_camera[:, :3]) for camera in self.cameras]
        return tuple(round((turn - turns[0]) % 360.0, 6) % 360.0 for turn in turns)

    def to_json(self) -> dict[str, object]:
        """Return the record of the poses in a twin's source."""
        return {
            "file": self.file,
            "format": self.format,
            "up": self.up.said,
            "roll_deg": round(self.up.roll_deg, 2),
            "unit": self.unit_said,
            "unit_m": self.unit_m,
        }


def poses_of(item: Item) -> StatedPoses | None:
    """Return the stated cameras of an item's photos, with their masks; None if there are none. Raises InputError."""
    if item.poses is None:
        return None
    stated = stated_poses([Path(file) for file in item.files], Path(item.poses), item.up, item.units)
    if not item.masks:
        return stated
    cameras = [replace(camera, mask=mask) for camera, mask in zip(stated.cameras, masks_of(item), strict=True)]
    return replace(stated, cameras=tuple(cameras))


def stated_poses(photos: Sequence[Path], poses: Path, up: str = "auto", units: str = "auto") -> StatedPoses:
    """Return the cameras of photos from the file ``poses``; ``up`` (y, z, auto) and ``units`` (m, cm, mm) are the user's
    statements.

    Raises InputError for an unreadable file, a photo without a pose or with another aspect ratio than its pose, and if the up
    direction cannot be determined from the cameras.
    """
    found = read_poses(poses)
    cameras = cameras_of_photos(photos, found)
    rotations = np.array([camera.world_to_camera[:, :3] for camera in cameras])
    told = (
        up_from_level_cameras(rotations, USUAL_UP[found.format]) if up == "auto" else up_from_world_axis(rotations, up)
    )
    file = pose_file_label(found)
    if told is None and up != "auto":
        raise InputError(
            "unreadable",
            f"{file}: with {up} up most photos would be upside down; leave out the up axis to derive it from the"
            f" cameras",
        )
    if told is None:
        raise InputError(
            "unreadable",
            f"{file}: the up direction is unknown: the cameras are rolled by more than {MOST_ROLL_DEG:.0f} degrees;"
            f" state it"
            " with --up y or z, or turn the poses",
        )
    upright = rotation_between(told.axis, np.array([0.0, 0.0, 1.0]))
    turned = [
        replace(
            each,
            as_read=each.world_to_camera,
            world_to_camera=np.column_stack([each.world_to_camera[:, :3] @ upright.T, each.world_to_camera[:, 3]]),
        )
        for each in cameras
    ]
    unit_m, said = _unit(found, units)
    return StatedPoses(file, found.format, tuple(turned), told, unit_m, said)


def _unit(found: CameraPoses, units: str) -> tuple[float | None, str]:
    if units in UNITS_M:
        return UNITS_M[units], f"{units}, as was stated"
    if found.unit_m is not None and units == "auto":
        name = next(name for name, unit_m in UNITS_M.items() if unit_m == found.unit_m)
        return found.unit_m, f"{name}, as {pose_file_label(found)} states"
    return None, "not stated"
