"""Selection from very many photos of one object: directions spread evenly over all."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from manitwin.formats.camera_poses.matching import cameras_of
from manitwin.geometry.even_directions import evenly_spread
from manitwin.models.generators.protocol import MOST_PHOTOS
from manitwin.pipeline.photo_cameras import pose_file_label, read_poses

MOST_GIVEN = 4096
"""Limit per object: the frames of a two-minute video; each is examined."""


def select_photos(photos: Sequence[Path], turns_deg: Sequence[float], poses: Path | None) -> list[int]:
    """Return the numbers of the photos to use, in order: all up to ``MOST_PHOTOS``, otherwise as many, spread evenly.

    The directions come from ``turns_deg``, one per photo, or the file ``poses``. All photos are returned if neither is given or
    a photo has no pose. The first photo is always included. Raises InputError for unreadable poses.
    """
    every = list(range(len(photos)))
    if len(photos) <= MOST_PHOTOS:
        return every
    if poses is not None:
        found = read_poses(poses)
        cameras = cameras_of(photos, found.cameras, pose_file_label(found))
        directions = [camera.world_to_camera[2, :3] for camera in cameras if camera is not None]
        if len(directions) < len(photos):
            return every
    elif turns_deg:
        turns = np.deg2rad(turns_deg)
        directions = list(np.column_stack([np.cos(turns), np.sin(turns), np.zeros(len(turns))]))
    else:
        return every
    return [int(number) for number in evenly_spread(np.array(directions), MOST_PHOTOS)]


def thinned_words(used: int, given: int) -> str:
    """Describe that not all photos of an object are used."""
    return f"{used} of {given} photos used, spread evenly over the directions: more say nothing new of the shape"
