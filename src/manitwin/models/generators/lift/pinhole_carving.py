"""Carve what a camera that stays sees of a thing that is turned before it: the solid within all outlines, with perspective."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.models.generators.lift.carved_solid import Carved, carved_of
from manitwin.models.generators.lift.pinhole import Sight
from manitwin.models.generators.lift.pinhole_hull import hull_field
from manitwin.models.generators.lift.texture import Crop, crop_object
from manitwin.models.generators.lift.turntable import TurntableCamera, scaled_masks, sights_of

SIDE_PX = 320
"""The longest side of the outlines' boxes, where the solid is carved."""
MASK_PX = 384


@dataclass(frozen=True)
class SeenPhoto:
    """A photo with its camera, see ``CarvingPhoto``; ``scale`` is that of the camera's pixels against the photo's."""

    name: str
    turn_deg: float
    crop: Crop
    sight: Sight
    scale: float

    def crop_share(self, points: np.ndarray) -> np.ndarray:
        """Return where points ``(N, 3)`` (x, height, z towards the first viewer) are in the crop, 0 to 1 right and down."""
        column, row, _ = self.sight.project(_z_up(points))
        left, top, width, height = self.crop.box
        return np.clip(
            np.column_stack([(column / self.scale - left) / width, (row / self.scale - top) / height]), 0.0, 1.0
        )

    def toward(self, points: np.ndarray) -> np.ndarray:
        """Return the unit vectors ``(N, 3)`` from points to the camera."""
        away = self.sight.position[[0, 2, 1]] * [1, 1, -1] - points
        return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


def carve_turned(
    photos: Sequence[tuple[str, np.ndarray]],
    turns_deg: Sequence[float],
    camera: TurntableCamera,
    covered: Sequence[float],
    power: float,
) -> Carved:
    """Carve what matted photos (name, ``(H, W, 4) uint8``, all of one size) show from the turns to a camera that stays.

    ``power`` is that of the superellipse at each level where only two directions are seen. Raises Rejected where nothing is left.
    """
    masks = scaled_masks([rgba for _, rgba in photos], SIDE_PX)
    sights = sights_of(masks, camera, turns_deg)
    scale = masks[0].size_px[0] / photos[0][1].shape[1]
    seen = [
        SeenPhoto(name, turn, crop_object(rgba, MASK_PX), sight, scale)
        for (name, rgba), turn, sight in zip(photos, turns_deg, sights, strict=True)
    ]
    field, cell, origin = hull_field(sights, power if _are_two_crossing(turns_deg) else None)
    told = {
        "elevation_deg": round(camera.elevation_deg, 1),
        "focal_of_longer_side": round(camera.focal, 2),
        "axis_share": round(camera.axis_share, 3),
    }
    return carved_of(field, cell, origin, seen, covered, told)


def _are_two_crossing(turns_deg: Sequence[float]) -> bool:
    """Tell whether all directions are, but for their sense, two at about a right angle along the first photo's axes."""
    relative = np.subtract(turns_deg, turns_deg[0]) % 90.0
    return bool((np.minimum(relative, 90.0 - relative) < 10.0).all())


def _z_up(points: np.ndarray) -> np.ndarray:
    return np.asarray(points[:, [0, 2, 1]] * [1, -1, 1])
