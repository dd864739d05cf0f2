"""Carving of an object that turns before a fixed camera: the solid within all silhouettes, with perspective."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.models.generators.lift.carved_solid import CarvedSolid, carved_solid_from_field
from manitwin.models.generators.lift.pinhole import PinholeSilhouette
from manitwin.models.generators.lift.pinhole_hull import hull_field
from manitwin.models.generators.lift.texture import Crop, crop_object
from manitwin.models.generators.lift.turntable import TurntableCamera, pinhole_silhouettes, scaled_masks

SIDE_PX = 320
"""Longest side of the silhouettes' bounding boxes at which the solid is carved."""
MASK_PX = 384


@dataclass(frozen=True)
class TurntablePhoto:
    """A photo with its camera, see ``CarvingPhoto``; ``scale`` is the size of the camera's pixels relative to the photo's."""

    name: str
    turn_deg: float
    crop: Crop
    silhouette: PinholeSilhouette
    scale: float

    def crop_share(self, points: np.ndarray) -> np.ndarray:
        """Return positions of points ``(N, 3)`` (x, height, z towards the first viewer) in the crop, 0 to 1 right and down."""
        column, row, _ = self.silhouette.project(_z_up(points))
        left, top, width, height = self.crop.box
        return np.clip(
            np.column_stack([(column / self.scale - left) / width, (row / self.scale - top) / height]), 0.0, 1.0
        )

    def camera_directions(self, points: np.ndarray) -> np.ndarray:
        """Return the unit vectors ``(N, 3)`` from points to the camera."""
        away = self.silhouette.position[[0, 2, 1]] * [1, 1, -1] - points
        return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


def carve_turntable(
    photos: Sequence[tuple[str, np.ndarray]],
    turns_deg: Sequence[float],
    camera: TurntableCamera,
    covered: Sequence[float],
    power: float,
) -> CarvedSolid:
    """Carve a solid from matted photos (name, ``(H, W, 4) uint8``, all of the same size) of a turning object with a fixed camera.

    ``power`` is the exponent of the superellipse at each level if only two directions are seen. Raises Rejected for an empty
    solid.
    """
    masks = scaled_masks([rgba for _, rgba in photos], SIDE_PX)
    sights = pinhole_silhouettes(masks, camera, turns_deg)
    scale = masks[0].size_px[0] / photos[0][1].shape[1]
    seen = [
        TurntablePhoto(name, turn, crop_object(rgba, MASK_PX), sight, scale)
        for (name, rgba), turn, sight in zip(photos, turns_deg, sights, strict=True)
    ]
    field, cell, origin = hull_field(sights, power if _is_right_angled(turns_deg) else None)
    told = {
        "elevation_deg": round(camera.elevation_deg, 1),
        "focal_of_longer_side": round(camera.focal, 2),
        "axis_share": round(camera.axis_share, 3),
    }
    return carved_solid_from_field(field, cell, origin, seen, covered, told)


def _is_right_angled(turns_deg: Sequence[float]) -> bool:
    """Tell whether all directions are multiples of about 90 degrees from the first photo's."""
    relative = np.subtract(turns_deg, turns_deg[0]) % 90.0
    return bool((np.minimum(relative, 90.0 - relative) < 10.0).all())


def _z_up(points: np.ndarray) -> np.ndarray:
    return np.asarray(points[:, [0, 2, 1]] * [1, -1, 1])
