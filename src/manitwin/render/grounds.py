"""The plain ground behind an object and the colour of the markers on it: such that neither is like the object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from manitwin.render.renderer import BACKDROP, Frame

DARK_GROUND = (84, 88, 94)
"""Behind light things: as far from white as the light ground is from black-brown, and no colour either."""

_ALIKE_LIGHTNESS = 22.0
"""Of CIELAB's 100: edges nearer than that to their ground are lost (looked at: white mugs on BACKDROP)."""
_ALIKE_COLOR = 38.0  # CIELAB distance under which a dot is taken for a spot of the object
_ALIKE_HUE_DEG, _COLORFUL = 25.0, 25.0  # a darker or paler shade of a colour has its name too, where it is no grey
_GROUND_TOLERANCE = 6  # what lossy pictures move a plain colour by
_SPARSE = 2  # and so are those of every second row and column
_THINNED = 20_000  # pixels are enough to know an object's colours


@dataclass(frozen=True)
class MarkerColor:
    """A colour of markers, by the word that questions use for it."""

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
"""The first that an object has little of is taken."""


def ground_for(frames: Sequence[Frame]) -> tuple[int, int, int]:
    """Return the light ground, or the darker one where more of the object is as light as the light ground."""
    pixels = np.concatenate([frame.rgb[frame.coverage > 0.9] for frame in frames])
    return ground_of_pixels(pixels)


def ground_of_pixels(pixels: np.ndarray) -> tuple[int, int, int]:
    """Return the ground that fewer of an object's pixels ``(N, 3) uint8`` are as light as."""
    if not len(pixels):
        return BACKDROP
    lightness = _lab(_thinned(pixels))[:, 0]
    like = [
        float((np.abs(lightness - _lab(np.array([ground], np.uint8))[0, 0]) < _ALIKE_LIGHTNESS).mean())
        for ground in (BACKDROP, DARK_GROUND)
    ]
    return BACKDROP if like[0] <= like[1] else DARK_GROUND


def shown_object(picture: np.ndarray) -> np.ndarray:
    """Return where a picture ``(H, W, 3) uint8`` differs from its plain ground, the colour of its corner; ``(H, W) bool``."""
    channels = [picture[..., channel].astype(np.int16) for channel in range(3)]
    far = [np.abs(channel - channel[0, 0]) > _GROUND_TOLERANCE for channel in channels]
    return np.asarray(far[0] | far[1] | far[2])


def marker_color(pictures: Sequence[np.ndarray]) -> MarkerColor:
    """Return the colour for markers on an object, from its pictures on plain ground: the one that it has least of.

    Colours of which it has less than a hundredth are equally good: the first of them is taken.
    """
    sparse = [picture[::_SPARSE, ::_SPARSE] for picture in pictures]
    pixels = np.concatenate([picture[shown_object(picture)] for picture in sparse])
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
