"""Silhouettes of photos with stated cameras: lens distortion is removed, and lengths are normalized by the camera distance."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.formats.camera_poses.posed_camera import PosedCamera
from manitwin.models.generators.lift.pinhole import PinholeSilhouette, signed_distance
from manitwin.models.generators.lift.texture import Crop
from manitwin.models.generators.lift.turntable import scaled_masks


@dataclass(frozen=True)
class PosedPhoto:
    """A matted photo, ``rgba (H, W, 4) uint8`` without distortion, and its camera.

    ``pose (3, 4)`` transforms points of the carving frame to the camera frame (x right, y down, z forward); ``lens (3, 3)``
    projects these to pixels of ``rgba``, whose centres are at one half. ``turn_deg`` is the rotation of the camera about the
    vertical, 0 for the first photo.
    """

    name: str
    rgba: np.ndarray
    pose: np.ndarray
    lens: np.ndarray
    turn_deg: float

    @property
    def position(self) -> np.ndarray:
        """Camera position ``(3,)``."""
        return np.asarray(-self.pose[:, :3].T @ self.pose[:, 3])

    def pinhole_silhouette(self, side_px: int) -> tuple[PinholeSilhouette, float]:
        """Return the silhouette with its bounding box scaled to ``side_px``, and the scale of its pixels to the photo's."""
        (mask,) = scaled_masks([self.rgba], side_px)
        scale = mask.size_px[0] / self.rgba.shape[1]
        lens = np.diag([scale, scale, 1.0]) @ self.lens
        focal_px = float(np.sqrt(lens[0, 0] * lens[1, 1]))
        return PinholeSilhouette(signed_distance(mask.mask), mask.corner, lens @ self.pose, focal_px), scale


@dataclass(frozen=True)
class PosedCarvingPhoto:
    """A photo with its stated camera, see ``CarvingPhoto``."""

    name: str
    turn_deg: float
    crop: Crop
    photo: PosedPhoto

    def crop_share(self, points: np.ndarray) -> np.ndarray:
        """Return positions of points ``(N, 3)`` (x, height, z towards the first viewer) in the crop, 0 to 1 right and down."""
        seen = (points[:, [0, 2, 1]] * [1, -1, 1]) @ self.photo.pose[:, :3].T + self.photo.pose[:, 3]
        pixels = (seen / np.maximum(seen[:, 2:], 1e-9)) @ self.photo.lens.T
        left, top, width, height = self.crop.box
        return np.clip((pixels[:, :2] - [left, top]) / [width, height], 0.0, 1.0)

    def camera_directions(self, points: np.ndarray) -> np.ndarray:
        """Return the unit vectors ``(N, 3)`` from points to the camera."""
        away = self.photo.position[[0, 2, 1]] * [1, 1, -1] - points
        return np.asarray(away / np.linalg.norm(away, axis=1, keepdims=True))


def to_carving_frame(
    photos: Sequence[tuple[str, np.ndarray]], cameras: Sequence[PosedCamera], turns_deg: Sequence[float]
) -> tuple[list[PosedPhoto], float]:
    """Return matted photos (name, ``(H, W, 4) uint8``) with their cameras in the carving frame, and the scale of that frame.

    The world frame of the cameras has z up. The carving frame has x to the first photo's right and y away from its camera;
    its origin is near the point at which the cameras look, and their distance from it is about 1. The scale is the length of
    the poses' unit in it.
    """
    poses = np.array([camera.world_to_camera for camera in cameras])
    positions = -np.einsum("nji,nj->ni", poses[:, :, :3], poses[:, :, 3])
    centre = _common_target(positions, poses[:, 2, :3])
    away = float(np.median(np.linalg.norm(positions - centre, axis=1)))
    unit = 1.0 / away if away > 0 else 1.0
    turn = _turn_about_z(poses[0, 0, :3])
    found = []
    for (name, rgba), camera, pose, turn_deg in zip(photos, cameras, poses, turns_deg, strict=True):
        moved = np.column_stack([pose[:, :3] @ turn.T, unit * (pose[:, 3] + pose[:, :3] @ centre)])
        lens, flat = _undistort(rgba, camera)
        found.append(PosedPhoto(name, flat, moved, lens, turn_deg))
    return found, unit


def _common_target(positions: np.ndarray, ahead: np.ndarray) -> np.ndarray:
    """Return the point nearest to the optical axes of the cameras."""
    across = np.eye(3) - ahead[:, :, None] * ahead[:, None, :]
    found = np.linalg.lstsq(across.sum(axis=0), np.einsum("nij,nj->i", across, positions), rcond=1e-6)[0]
    return np.asarray(found)


def _turn_about_z(right: np.ndarray) -> np.ndarray:
    """Return the rotation ``(3, 3)`` about z that takes the horizontal part of a direction to x."""
    angle = np.arctan2(right[1], right[0])
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1.0]])


def _undistort(rgba: np.ndarray, camera: PosedCamera) -> tuple[np.ndarray, np.ndarray]:
    """Return the camera matrix ``(3, 3)`` for a photo as scaled, and the photo without lens distortion."""
    lens = camera.lens
    height, width = rgba.shape[:2]
    stated = lens.with_picture_size(width, height)
    size, centre = stated.size_px or (width, height), stated.centre_px or (width / 2, height / 2)
    across, down = width / size[0], height / size[1]
    matrix = np.array(
        [[stated.focal[0] * across, 0, centre[0] * across], [0, stated.focal[1] * down, centre[1] * down], [0, 0, 1.0]]
    )
    if not any(lens.distortion) and not lens.fisheye:
        return matrix, rgba
    # pixel centres of OpenCV have integer coordinates
    shifted = matrix - np.array([[0, 0, 0.5], [0, 0, 0.5], [0, 0, 0]])
    # premultiplied, so that colours of transparent pixels do not bleed into visible ones
    alpha = rgba[..., 3:].astype(np.float32) / 255
    layers = np.concatenate([rgba[..., :3] * alpha, alpha], axis=2)
    bent, size_px = np.array(lens.distortion, float), (width, height)
    if lens.fisheye:
        maps = cv2.fisheye.initUndistortRectifyMap(shifted, bent[:4], np.eye(3), shifted, size_px, cv2.CV_32FC1)
    else:
        maps = cv2.initUndistortRectifyMap(shifted, bent, np.eye(3), shifted, size_px, cv2.CV_32FC1)
    flat = cv2.remap(layers, *maps, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=0)
    colours = flat[..., :3] / np.maximum(flat[..., 3:], 1 / 255)
    return matrix, np.dstack([np.clip(colours + 0.5, 0, 255), 255 * flat[..., 3] + 0.5]).astype(np.uint8)
