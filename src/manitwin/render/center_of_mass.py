"""The centre of mass drawn as a quartered disc, with a ring for its uncertainty."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.render.cameras import Camera, project

DARK, LIGHT = (24, 28, 36), (255, 255, 255)
RADIUS_SHARE = 0.022  # fraction of the image height
_SUBPIXEL_BITS = 4


@dataclass(frozen=True)
class CenterOfMass:
    """The centre of mass: ``position_m (3,)`` in the object frame, and its uncertainty (m)."""

    position_m: np.ndarray
    uncertainty_m: float


def draw_center_of_mass(picture: np.ndarray, center: CenterOfMass, camera: Camera) -> np.ndarray:
    """Return an image ``(H, W, 3) uint8`` with the centre of mass drawn in front of everything.

    The ring around the disc has the radius of the uncertainty; it is omitted if it would lie within the disc.
    """
    drawn = np.ascontiguousarray(picture.copy())  # OpenCV's pixel centres have integer coordinates
    pixels, depth = project(np.asarray(center.position_m, dtype=float)[None], camera)
    middle, radius_px = pixels[0] - 0.5, max(4.0, RADIUS_SHARE * camera.height_px)
    ring_px = camera.focal_px * center.uncertainty_m / float(depth[0])
    if ring_px > radius_px + 2:
        _circle(drawn, middle, ring_px, LIGHT, 3)
        _circle(drawn, middle, ring_px, DARK, 1)
    _circle(drawn, middle, radius_px + 1.5, DARK, -1)
    for start, color in ((0, LIGHT), (90, DARK), (180, LIGHT), (270, DARK)):
        corners = [middle] + [
            middle + radius_px * np.array([np.cos(turn), np.sin(turn)])
            for turn in np.radians(np.linspace(start, start + 90, 16))
        ]
        cv2.fillPoly(drawn, [_fixed(np.array(corners))], color, cv2.LINE_AA, _SUBPIXEL_BITS)
    return drawn


def _circle(picture: np.ndarray, middle: np.ndarray, radius_px: float, color: tuple[int, int, int], width: int) -> None:
    at = _fixed(middle)
    radius = round(radius_px * (1 << _SUBPIXEL_BITS))
    cv2.circle(picture, (int(at[0]), int(at[1])), radius, color, width, cv2.LINE_AA, _SUBPIXEL_BITS)


def _fixed(pixels: np.ndarray) -> np.ndarray:
    return np.asarray(np.rint(pixels * (1 << _SUBPIXEL_BITS)), dtype=np.int32)
