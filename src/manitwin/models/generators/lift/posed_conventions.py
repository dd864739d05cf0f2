"""Diagnosis of silhouettes that are inconsistent with the stated poses: another convention, a single photo, or unknown."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.models.generators.lift.pinhole_hull import covered_shares
from manitwin.models.generators.lift.posed_photos import to_carving_frame
from manitwin.models.generators.lift.turntable import SIDE_PX

LEAST_COVERED = 0.95
"""Minimum share of a silhouette that the hull fills; with correct poses and masks it is 0.98 and more."""
_OPENGL_TO_OPENCV = np.diag([1.0, -1.0, -1.0, 1.0])
"""Converts between camera axes of OpenGL (y up, z backward) and OpenCV (y down, z forward)."""
_MOST_WRONG = 0.25  # of the photos: tolerated share of inconsistent photos under the right convention

CONVENTIONS: tuple[tuple[Callable[[np.ndarray], np.ndarray], str], ...] = (
    (
        lambda read: _OPENGL_TO_OPENCV @ read,
        "the cameras' y and z axes point the other way (OpenGL has y up and z backward, OpenCV y down and z forward): turn both"
        " round in every pose",
    ),
    (
        lambda read: np.asarray(_OPENGL_TO_OPENCV @ np.linalg.inv(read) @ _OPENGL_TO_OPENCV),
        "the matrices are those from the world to an OpenGL camera, and should be from it to the world: invert every one",
    ),
    (
        lambda read: np.asarray(np.linalg.inv(read) @ _OPENGL_TO_OPENCV),
        "the matrices are those from the world to an OpenCV camera, and should be from an OpenGL camera to the world: invert"
        " every one, and turn the y and z axes of the camera round",
    ),
    (
        lambda read: np.asarray(np.linalg.inv(read)),
        "rotation and translation are those from the camera to the world, and should be from the world to the camera: invert"
        " every one",
    ),
)
"""Corrections of a world-to-camera pose ``(4, 4)`` that was read in a wrong convention, with their descriptions."""


def describe_inconsistency(
    photos: Sequence[tuple[str, np.ndarray]],
    cameras: Sequence[PosedCamera],
    covered: Sequence[float],
    without: np.ndarray,
) -> str:
    """Return why the silhouettes of matted photos (name, ``(H, W, 4) uint8``) are inconsistent with their poses.

    ``covered`` and ``without`` are those of ``covered_shares``.
    """
    for change, what in CONVENTIONS:
        posed, _ = to_carving_frame(
            photos, [_apply_convention(camera, change) for camera in cameras], [0.0] * len(photos)
        )
        filled, _ = covered_shares([photo.pinhole_silhouette(SIDE_PX)[0] for photo in posed])
        if float(np.quantile(filled, _MOST_WRONG)) >= LEAST_COVERED:
            return f"the outlines are those of one thing where {what}"
    names = [name for name, _ in photos]
    others = [float(np.delete(without[:, k], k).min()) for k in range(len(names))]
    alone = int(np.argmax(others))
    if len(names) > 2 and others[alone] >= LEAST_COVERED:
        return (
            f"{names[alone]}: its outline does not match its pose and the outlines of the other photos; check that"
            f" the pose is its own"
            " and that it shows the whole of the same object, or leave it out"
        )
    worst = sorted(range(len(names)), key=lambda k: covered[k])[:3]
    filled_of = ", ".join(f"{covered[k]:.0%} of that of {names[k]}" for k in worst)
    return (
        f"these {len(names)} outlines are not of one object at the stated poses (their common solid fills"
        f" {filled_of}); check"
        " that the poses are those of these photos, uncropped, that the focal lengths are in pixels of them, and"
        " that the object did not move"
    )


def _apply_convention(camera: PosedCamera, change: Callable[[np.ndarray], np.ndarray]) -> PosedCamera:
    read = np.eye(4)
    read[:3] = camera.world_to_camera if camera.as_read is None else camera.as_read
    return replace(camera, world_to_camera=change(read)[:3])
