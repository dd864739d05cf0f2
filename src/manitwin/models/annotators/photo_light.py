"""Light of a photo, estimated from a pale background: the observed colour is object colour times light, plus sheen.

Exposure metering makes a white sheet grey, and a black object on it shows the sheet's reflection. Without correction, the
pixels of a yellow object are olive, those of a pink one brown, and those of a black one dark grey. A background of known
reflectance gives the brightness of the light: people place objects on pale paper, cloth and tables with little tint. For any
other background the light stays unknown.
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

# Chosen on one half of the categories of benchmarks/photo_colors.py, the sheen also with regard to real photos
# (docs/measured/annotations.md).
PALE_REFLECTANCE = 0.7  # of a pale background: white paper has 0.85, a light grey table 0.5
MOST_SHEEN = 0.02
"""Reflection of the surroundings relative to white.

It is 4 % at normal incidence (Fresnel, refractive index 1.5) of surroundings with a mean brightness of half that of white.
"""
_DARKEST_PERCENT = 5.0  # percentile of the object's pixels: a pixel cannot be darker than its sheen
_LEAST_LIGHTNESS = 50.0  # minimum CIELAB L* of a pale background
_MOST_CHROMA = 15.0  # CIELAB; a wooden table top has 22
_RING_SHARE = (0.02, 0.10)  # of the longer side: beyond the contact shadow, but still in the same light as the object
_SEEN_PX = 512
_OPAQUE = 127


@dataclass(frozen=True)
class PhotoLight:
    """Brightness of a photo: ``white`` is the linear luminance in [0, 1] of a white surface in the light of the object.

    ``sheen`` is the light from surface reflection and lens flare, relative to white. The tint of the light is not corrected,
    because a background's own tint is about as large as the error of a camera's white balance.
    """

    white: float
    sheen: float

    def object_colors(self, srgb: np.ndarray) -> np.ndarray:
        """Return the object colours ``(..., 3)`` sRGB in [0, 1] for the colours ``srgb (..., 3)`` of the photo."""
        return np.asarray(linear_to_srgb(np.clip(srgb_to_linear(srgb) / self.white - self.sheen, 0.0, 1.0)))


def estimate_photo_light(rgba: np.ndarray) -> PhotoLight | None:
    """Return the light of a photo ``(H, W, 4) uint8`` with the object's mask as alpha; None without a pale background.

    Pixels with alpha 0 must have the colours of the photo.
    """
    scale = _SEEN_PX / max(rgba.shape[:2])
    if scale < 1:  # channels are resized separately; premultiplied alpha would darken the background
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


def estimate_mean_light(paths: Iterable[Path]) -> PhotoLight | None:
    """Return the mean light of matted photos (RGBA) of one object; None if it is unknown for one of them."""
    lights = [estimate_photo_light(np.asarray(Image.open(path).convert("RGBA"))) for path in paths]
    told = [light for light in lights if light is not None]
    if not told or len(told) < len(lights):
        return None
    white = float(np.exp(np.mean([np.log(light.white) for light in told])))
    return PhotoLight(white, float(np.mean([light.sheen for light in told])))


def _disc(radius_px: float) -> np.ndarray:
    size = 2 * round(radius_px) + 1
    return np.asarray(cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (size, size)))
