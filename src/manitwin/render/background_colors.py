"""Choice of plain background and marker colours that contrast with the object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.render.renderer import BACKDROP, Frame

DARK_GROUND = (84, 88, 94)
"""Background for light objects: as far from white as the light background is from dark brown, and neutral as well."""

_ALIKE_LIGHTNESS = 22.0
"""CIELAB lightness difference (of 100) below which edges disappear in the background (e.g. white mugs on BACKDROP)."""
_ALIKE_COLOR = 38.0  # CIELAB distance below which a dot looks like a spot of the object
_ALIKE_HUE_DEG, _COLORFUL = 25.0, 25.0  # darker and paler shades share a colour's name unless they are grey
_GROUND_TOLERANCE = 6  # deviation of a plain colour due to lossy compression
_SPARSE = 2  # step of rows and columns used
_THINNED = 20_000  # pixels suffice to determine an object's colours


@dataclass(frozen=True)
class MarkerColor:
    """A marker colour and its name in questions."""

    name: str
    rgb: tuple[int, int, int]


MARKER_COLORS = (
    MarkerColor("red", (226, 26, 92)),
    MarkerColor("green", (0, 168, 62)),
    MarkerColor("blue", (24, 84, 236)),
    MarkerColor("yellow", (248, 212, 0)),
    MarkerColor("pink", (255, 60, 220)),
    MarkerColor("cyan", (0, 205, 230)),
)
"""Colours of markers, in order of preference."""


def background_for(frames: Sequence[Frame]) -> tuple[int, int, int]:
    """Return the background, light or dark, that fewer of the object's pixels resemble in lightness."""
    pixels = np.concatenate([frame.rgb[frame.coverage > 0.9] for frame in frames])
    return background_of_pixels(pixels)


def background_of_pixels(pixels: np.ndarray) -> tuple[int, int, int]:
    """Return the background that fewer of an object's pixels ``(N, 3) uint8`` resemble in lightness."""
    if not len(pixels):
        return BACKDROP
    lightness = _lab(_thinned(pixels))[:, 0]
    like = [
        float((np.abs(lightness - _lab(np.array([ground], np.uint8))[0, 0]) < _ALIKE_LIGHTNESS).mean())
        for ground in (BACKDROP, DARK_GROUND)
    ]
    return BACKDROP if like[0] <= like[1] else DARK_GROUND


def foreground_mask(picture: np.ndarray) -> np.ndarray:
    """Return where an image ``(H, W, 3) uint8`` differs from its plain background, the corner's colour; ``(H, W) bool``."""
    channels = [picture[..., channel].astype(np.int16) for channel in range(3)]
    far = [np.abs(channel - channel[0, 0]) > _GROUND_TOLERANCE for channel in channels]
    return np.asarray(far[0] | far[1] | far[2])


def marker_color(pictures: Sequence[np.ndarray]) -> MarkerColor:
    """Return the marker colour least present on an object, from images on a plain background.

    Colours with a share below one hundredth count as equal; the first of them is used.
    """
    sparse = [picture[::_SPARSE, ::_SPARSE] for picture in pictures]
    pixels = np.concatenate([picture[foreground_mask(picture)] for picture in sparse])
    if not len(pixels):
        return MARKER_COLORS[0]
    seen = _lab(_thinned(pixels))
    shares = []
    for color in MARKER_COLORS:
        own = _lab(np.array([color.rgb], np.uint8))[0]
        shades = _hue_apart_deg(seen, own) < _ALIKE_HUE_DEG
        alike = (np.linalg.norm(seen - own, axis=1) < _ALIKE_COLOR) | (shades & (_chroma(seen) > _COLORFUL))
        shares.append(max(float(alike.mean()), 0.01))
    return MARKER_COLORS[int(np.argmin(shares))]


def _thinned(pixels: np.ndarray) -> np.ndarray:
    return pixels[:: max(1, len(pixels) // _THINNED)]


def _chroma(lab: np.ndarray) -> np.ndarray:
    return np.asarray(np.hypot(lab[..., 1], lab[..., 2]))


def _hue_apart_deg(lab: np.ndarray, other: np.ndarray) -> np.ndarray:
    apart = np.degrees(np.arctan2(lab[:, 2], lab[:, 1]) - np.arctan2(other[2], other[1]))
    return np.asarray(np.abs((apart + 180) % 360 - 180))


def _lab(rgb: np.ndarray) -> np.ndarray:
    """Return CIELAB ``(N, 3)`` of sRGB ``(N, 3) uint8``."""
    return np.asarray(cv2.cvtColor(rgb[None].astype(np.float32) / 255, cv2.COLOR_RGB2LAB))[0]
