"""Calibration of a fixed camera before a turntable from silhouettes, since the visual hull must fill all of them.

Silhouette coherence (Hernandez, Schmitt and Cipolla 2007, "Silhouette Coherence for Camera Calibration under Circular
Motion") at stated turns. A camera that is moved around the object at constant height and distance, aimed at it, is
equivalent.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from scipy.optimize import minimize

from manitwin.models.generators.lift.pinhole import PinholeSilhouette, mean_ray_miss_px, signed_distance

SIDE_PX = 160
"""Longest side of the silhouettes' bounding boxes during calibration."""
LEAST_ELEVATION_DEG, MOST_ELEVATION_DEG = -12.0, 75.0
"""Range of elevations. Below the lower limit, an object turned the other way round looks about the same as from above."""
LEAST_FOCAL, MOST_FOCAL = 0.5, 12.0
"""Range of focal lengths over the longer side of the picture: from an 18 mm full-frame lens to almost no perspective.

Wider lenses explain any silhouettes.
"""
_ELEVATIONS_DEG, _FOCALS = tuple(range(0, 73, 8)), (0.9, 1.8, 5.0)
_USUAL_FOCAL, _FOCAL_SPREAD, _FOCAL_WEIGHT = 1.1, 0.7, 0.003
"""Prior of an unstated focal length over the picture's longer side, spread of its logarithm, and weight against pixels."""
_STATED_FOCAL_WEIGHT = 0.1
_PHOTOS = 8
_STARTS = 3
_FULL_FRAME_MM = 36.0  # longer side of the full frame, to which a 35 mm equivalent refers


@dataclass(frozen=True)
class TurntableCamera:
    """A camera at distance 1 from the axis: elevation, focal length over the longer side of the picture, and column of the axis.

    ``axis_share`` is a share of the picture's width. ``cost_px`` is the mean distance by which rays along the silhouettes
    miss the hull, for silhouettes of ``SIDE_PX``.
    """

    elevation_deg: float
    focal: float
    axis_share: float
    cost_px: float

    def matrix(self, turn_deg: float, width_px: float, height_px: float) -> np.ndarray:
        """Return the projection ``(3, 4)`` of a ``PinholeSilhouette`` to a picture of that size, seen from ``turn_deg``."""
        turn, elevation = np.deg2rad([turn_deg, self.elevation_deg])
        toward = np.array([np.sin(turn) * np.cos(elevation), -np.cos(turn) * np.cos(elevation), np.sin(elevation)])
        right = np.array([np.cos(turn), np.sin(turn), 0.0])
        focal = self.focal * max(width_px, height_px)
        pose = np.zeros((3, 4))
        pose[:, :3] = right, -np.cross(toward, right), -toward
        pose[:, 3] = (self.axis_share - 0.5) * width_px / focal, 0.0, 1.0
        lens = np.array([[focal, 0, width_px / 2], [0, focal, height_px / 2], [0, 0, 1.0]])
        return np.asarray(lens @ pose)


@dataclass(frozen=True)
class ScaledMask:
    """A silhouette cropped to its box: ``mask (H, W) bool``, the box's corner (x, y) and the picture's size in scaled pixels."""

    mask: np.ndarray
    corner: np.ndarray
    size_px: tuple[float, float]


def scaled_masks(photos: Sequence[np.ndarray], side_px: int) -> list[ScaledMask]:
    """Return the silhouettes of photos ``(H, W, 4) uint8`` of the same size at a common scale; the widest box has ``side_px``."""
    boxes = [_box(rgba[..., 3] > 127) for rgba in photos]
    scale = side_px / max(max(box[2] - box[0], box[3] - box[1]) for box in boxes)
    found = []
    for rgba, (left, top, right, bottom) in zip(photos, boxes, strict=True):
        size = max(3, round((right - left) * scale)), max(3, round((bottom - top) * scale))
        alpha = np.ascontiguousarray(rgba[top:bottom, left:right, 3]).astype(np.float32)
        mask = cv2.resize(alpha, size, interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR) > 127
        found.append(
            ScaledMask(_largest(mask), scale * np.array([left, top]), (rgba.shape[1] * scale, rgba.shape[0] * scale))
        )
    return found


def pinhole_silhouettes(
    masks: Sequence[ScaledMask], camera: TurntableCamera, turns_deg: Sequence[float]
) -> list[PinholeSilhouette]:
    """Return the silhouettes as ``PinholeSilhouette`` of the camera at the turns."""
    plain = [_without_camera(mask) for mask in masks]
    return _with_turntable_camera(plain, masks, camera, turns_deg)


def calibrate_turntable(
    photos: Sequence[np.ndarray], turns_deg: Sequence[float], focal_mm: float | None = None
) -> TurntableCamera:
    """Estimate the fixed camera for matted ``photos (H, W, 4) uint8``, all of the same size, of a turning object.

    ``turns_deg`` are those of the camera about the vertical, counter-clockwise; ``focal_mm`` is the 35 mm equivalent focal
    length, if stated. Of many photos a subset spread over the turns is used.
    """
    chosen = _select_spread_photos(turns_deg)
    masks = scaled_masks([photos[k] for k in chosen], SIDE_PX)
    turns = [turns_deg[k] for k in chosen]
    plain = [_without_camera(mask) for mask in masks]
    usual, weight = _USUAL_FOCAL, _FOCAL_WEIGHT
    if focal_mm is not None:
        usual, weight = focal_mm / _FULL_FRAME_MM, _STATED_FOCAL_WEIGHT
    width = masks[0].size_px[0]
    axis = _axis_px(masks, turns)

    def camera(at: np.ndarray) -> TurntableCamera:
        return TurntableCamera(10 * float(at[0]), float(np.exp(at[1])), (axis + float(at[2])) / width, 0.0)

    def cost(at: np.ndarray) -> float:
        tried = camera(at)
        outside = max(LEAST_ELEVATION_DEG - tried.elevation_deg, tried.elevation_deg - MOST_ELEVATION_DEG, 0.0)
        outside += 10 * max(float(np.log(LEAST_FOCAL) - at[1]), float(at[1] - np.log(MOST_FOCAL)), 0.0)
        return (
            mean_ray_miss_px(_with_turntable_camera(plain, masks, tried, turns))
            + outside
            + weight * ((at[1] - np.log(usual)) / _FOCAL_SPREAD) ** 2
        )

    starts = sorted(
        ([each / 10, np.log(focal), 0.0] for each in _ELEVATIONS_DEG for focal in _FOCALS),
        key=lambda at: cost(np.array(at)),
    )
    found = []
    for start in starts[:_STARTS]:
        corners = np.array(start) + np.vstack([np.zeros(3), np.diag([0.4, 0.3, 1.5])])
        options = {"initial_simplex": corners, "maxfev": 100, "xatol": 0.004, "fatol": 1e-4}
        found.append(minimize(cost, np.array(start), method="Nelder-Mead", options=options))
    best = min(found, key=lambda each: float(each.fun)).x
    told = camera(best)
    return TurntableCamera(
        told.elevation_deg,
        told.focal,
        told.axis_share,
        mean_ray_miss_px(_with_turntable_camera(plain, masks, told, turns)),
    )


def _without_camera(mask: ScaledMask) -> PinholeSilhouette:
    return PinholeSilhouette(signed_distance(mask.mask), mask.corner, np.zeros((3, 4)), 1.0)


def _with_turntable_camera(
    plain: Sequence[PinholeSilhouette], masks: Sequence[ScaledMask], camera: TurntableCamera, turns_deg: Sequence[float]
) -> list[PinholeSilhouette]:
    return [
        sight.with_camera(camera.matrix(turn, *mask.size_px), camera.focal * max(mask.size_px))
        for sight, mask, turn in zip(plain, masks, turns_deg, strict=True)
    ]


def _select_spread_photos(turns_deg: Sequence[float]) -> list[int]:
    order = sorted(range(len(turns_deg)), key=lambda k: (turns_deg[k] % 360.0, k))
    if len(order) <= _PHOTOS:
        return sorted(order)
    return sorted(order[k] for k in np.linspace(0, len(order), _PHOTOS, endpoint=False).astype(int))


def _axis_px(masks: Sequence[ScaledMask], turns_deg: Sequence[float]) -> float:
    """Return the column about which the centres of the silhouettes swing."""
    turns = np.deg2rad(turns_deg)
    middles = [mask.corner[0] + mask.mask.shape[1] / 2 for mask in masks]
    swing = np.column_stack([np.ones(len(turns)), np.cos(turns), np.sin(turns)])
    return float(np.linalg.lstsq(swing, np.array(middles), rcond=None)[0][0])


def _box(mask: np.ndarray) -> tuple[int, int, int, int]:
    mask = _largest(mask)
    rows, columns = np.nonzero(mask.any(axis=1))[0], np.nonzero(mask.any(axis=0))[0]
    return int(columns[0]), int(rows[0]), int(columns[-1]) + 1, int(rows[-1]) + 1


def _largest(mask: np.ndarray) -> np.ndarray:
    count, labels, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    return mask if count < 3 else labels == 1 + int(np.argmax(stats[1:, cv2.CC_STAT_AREA]))
