"""The light of a photo, read off the pale ground around its thing: what a camera saw is own colour times light, and sheen.

A meter makes a white sheet grey, and a black thing on it shows the sheet's reflection: read as they are, a yellow thing's pixels
are olive, a pink one's brown, a black one's dark grey. How bright the light is, is told by a ground whose matter is known: people
lay things on paper, cloths and tables that are pale and hardly tinted. Of any other ground nothing is told.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from PIL import Image

from manitwin.formats.meshes.textures import linear_to_srgb, srgb_to_linear
from manitwin.models.annotators.surface_color import lab_from_srgb
from manitwin.render.scene_lighting import LUMINANCE

# chosen on one half of the categories of benchmarks/photo_colors.py, the sheen also with real photos in sight
# (docs/measured/annotations.md)
PALE_REFLECTANCE = 0.7  # of a pale ground: white paper has 0.85, a light grey table 0.5
MOST_SHEEN = 0.02
"""What a surface reflects of its surroundings, of white: 4 % at normal incidence (Fresnel, refractive index 1.5) of what is half
as bright as white in the mean."""
_DARKEST_PERCENT = 5.0  # of the thing's pixels: what is darker than the sheen has not that much of it
_LEAST_LIGHTNESS = 50.0  # CIELAB L* of a ground that is taken for a pale one
_MOST_CHROMA = 15.0  # CIELAB; a wooden table top has 22, and is no white sheet
_RING_SHARE = (0.02, 0.10)  # of the longer side: beyond the contact shadow, and still in the thing's own light
_SEEN_PX = 512
_OPAQUE = 127


@dataclass(frozen=True)
class PhotoLight:
    """How bright a photo is: ``white`` is the linear luminance in 0..1 of a white surface in the thing's light.

    ``sheen`` is what the thing reflects of its surroundings and the lens spreads, as a share of white. The light's tint is left
    alone: a ground's own tint is about as large as what a camera's white balance leaves.
    """

    white: float
    sheen: float

    def own_colors(self, srgb: np.ndarray) -> np.ndarray:
        """Return the own colours ``(..., 3)`` sRGB in 0..1 of what the photo shows as ``srgb (..., 3)``."""
        return np.asarray(linear_to_srgb(np.clip(srgb_to_linear(srgb) / self.white - self.sheen, 0.0, 1.0)))


def light_of_photo(rgba: np.ndarray) -> PhotoLight | None:
    """Return the light of a photo ``(H, W, 4) uint8`` whose alpha is the thing; None where its ground does not tell it.

    The colours where alpha is 0 must be those of the photo.
    """
    scale = _SEEN_PX / max(rgba.shape[:2])
    if scale < 1:  # colour by colour: premultiplied ones would darken the ground
        rgba = np.asarray(cv2.resize(rgba, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA))
    thing = (rgba[..., 3] > 0).astype(np.uint8)
    near, far = (cv2.dilate(thing, _disc(share * max(thing.shape))) > 0 for share in _RING_SHARE)
    ring = far & ~near
    if not ring.any():
        return None
    ground = np.median(srgb_to_linear(rgba[ring][:, :3] / 255), axis=0)
    lightness, *tint = lab_from_srgb(linear_to_srgb(ground))
    if lightness < _LEAST_LIGHTNESS or np.hypot(*tint) > _MOST_CHROMA:
        return None
    white = min(float(LUMINANCE @ ground) / PALE_REFLECTANCE, 1.0)
    own = srgb_to_linear(rgba[rgba[..., 3] > _OPAQUE][:, :3] / 255) @ LUMINANCE
    darkest = float(np.percentile(own, _DARKEST_PERCENT)) / white if len(own) else 0.0
    return PhotoLight(white, min(MOST_SHEEN, darkest))


def light_of_photos(paths: Iterable[Path]) -> PhotoLight | None:
    """Return the mean light of cut-out photos (RGBA) of one thing; None where one of them does not tell it."""
    lights = [light_of_photo(np.asarray(Image.open(path).convert("RGBA"))) for path in paths]
    told = [light for light in lights if light is not None]
    if not told or len(told) < len(lights):
        return None
    white = float(np.exp(np.mean([np.log(light.white) for light in told])))
    return PhotoLight(white, float(np.mean([light.sheen for light in told])))


def _disc(radius_px: float) -> np.ndarray:
    size = 2 * round(radius_px) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
