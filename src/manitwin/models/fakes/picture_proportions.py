"""Estimation of an object's proportions from its silhouettes in several views, for rehearsal answers."""

from __future__ import annotations

import io

import cv2
import numpy as np
from PIL import Image

HALF_VIEW = 0.88 * float(np.tan(np.deg2rad(15.0)))
"""Tangent of the half angle that a centred object fills along the longer image side: field of view 30 degrees, filled to 88 %."""

WIDTHS = np.geomspace(0.05, 1.0, 14)
HEIGHTS = np.geomspace(0.05, 20.0, 26)
YAWS = np.deg2rad(np.arange(0.0, 180.0, 15.0))
_LEAST_CONTRAST = 8  # of 255, against the colour of the corner


def foreground(picture: np.ndarray) -> np.ndarray:
    """Return the mask ``(H, W) bool`` of pixels of ``(H, W, 3) uint8`` that differ from the corner pixel, without specks."""
    differs = np.abs(picture.astype(int) - picture[0, 0].astype(int)).max(2) > _LEAST_CONTRAST
    return cv2.morphologyEx(differs.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3), np.uint8)).astype(bool)


def measure_proportions(pngs: list[bytes], views: list[tuple[float, float]]) -> tuple[float, float, float]:
    """Return the sides of the object's bounding box in descending order, with the longest as 1.

    ``views`` are azimuth and elevation in degrees. The result is the box, upright cylinder or ellipsoid, out of a grid of widths,
    heights and yaws, whose silhouettes match the observed aspect ratios best. Without pictures, a cube is returned.
    """
    aspects, directions, frames = [], [], []
    for png, view in zip(pngs, views, strict=False):
        picture = np.asarray(Image.open(io.BytesIO(png)).convert("RGB"))
        rows, columns = np.nonzero(foreground(picture))
        if len(rows):
            aspects.append((np.ptp(columns) + 1) / (np.ptp(rows) + 1))
            directions.append(view)
            frames.append(HALF_VIEW * np.array(picture.shape[1::-1]) / max(picture.shape[:2]))
    if not aspects:
        return 1.0, 1.0, 1.0
    best = min((_fit(solid, np.array(aspects), directions, frames) for solid in _solids()), key=lambda fit: fit[0])
    sides = sorted(best[1], reverse=True)
    return 1.0, sides[1] / sides[0], sides[2] / sides[0]


def _solids() -> list[np.ndarray]:
    """Return surface points of a box, an upright cylinder and a ball, each with sides 1 and centred at the origin."""
    box = np.array([[x, y, z] for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])
    turn = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    circle = 0.5 * np.stack([np.cos(turn), np.sin(turn)], 1)
    cylinder = np.concatenate([np.column_stack([circle, np.full(16, z)]) for z in (-0.5, 0.5)])
    levels = np.deg2rad([-75.0, -50, -25, 0, 25, 50, 75])
    ball = [np.column_stack([circle * np.cos(level), np.full(16, 0.5 * np.sin(level))]) for level in levels]
    return [box, cylinder, np.concatenate(ball)]


def _fit(
    solid: np.ndarray, aspects: np.ndarray, views: list[tuple[float, float]], frames: list[np.ndarray]
) -> tuple[float, tuple[float, ...]]:
    width, height, yaw = (a.reshape(-1) for a in np.meshgrid(WIDTHS, HEIGHTS, YAWS, indexing="ij"))
    sides = np.stack([np.ones_like(width), width, height], 1)
    points = solid[None] * sides[:, None]
    cos, sin = np.cos(yaw)[:, None], np.sin(yaw)[:, None]
    turned = np.stack(
        [cos * points[..., 0] - sin * points[..., 1], sin * points[..., 0] + cos * points[..., 1], points[..., 2]], -1
    )
    error = np.zeros(len(sides))
    for aspect, (azimuth, elevation), frame in zip(aspects, views, frames, strict=True):
        error += np.log(_outline_aspect(turned, azimuth, elevation, frame) / aspect) ** 2
    best = int(error.argmin())
    return float(error[best]), tuple(float(side) for side in sides[best])


def _outline_aspect(points: np.ndarray, azimuth_deg: float, elevation_deg: float, frame: np.ndarray) -> np.ndarray:
    """Return the aspect ratios (width / height) of silhouettes of points ``(K, N, 3)``, centred and framed in a picture.

    ``frame (2,)`` are the tangents of the filled half angles, horizontal and vertical.
    """
    azimuth, elevation = np.deg2rad(azimuth_deg), np.deg2rad(elevation_deg)
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    backward = np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    seen = points @ np.stack([right, np.cross(backward, right), backward], 1)
    plane, toward = seen[..., :2], seen[..., 2:]
    upper, lower = (plane + toward * frame).max(1), (plane - toward * frame).min(1)
    distance = ((upper - lower) / (2 * frame)).max(1)[:, None, None]
    projected = (plane - ((upper + lower) / 2)[:, None]) / (distance - toward)
    extent = np.ptp(projected, axis=1)
    return extent[:, 0] / extent[:, 1]
