"""Composites on a ground of one exact digital colour, like shop pictures that were cut out or overexposed."""

from __future__ import annotations

import cv2
import numpy as np
from composite_things import Thing, linear
from composite_variants import labelled, matched

from manitwin.formats.meshes.textures import linear_to_srgb

WHITE = 255
LIGHT_GROUNDS = (200, 254)
SHADELESS = 0.99
"""Share of the light on the ground above which an editor would see no shadow."""
SIDES_PX = (180, 640)
QUALITIES = (50, 97)


def draw_exact_ground(rng: np.random.Generator) -> np.ndarray:
    """Return a colour ``(3,)`` uint8: white in three of four pictures, else a light grey or any colour."""
    drawn = rng.random()
    if drawn < 0.75:
        return np.full(3, WHITE, np.uint8)
    if drawn < 0.9:
        return np.full(3, rng.integers(*LIGHT_GROUNDS), np.uint8)
    return rng.integers(0, 256, 3).astype(np.uint8)


def shop_thing(rng: np.random.Generator, thing: Thing, ground: np.ndarray) -> Thing:
    """Print a label on one of three things, and give a part of one of five the colour ``ground (3,)`` uint8."""
    drawn = rng.random()
    if drawn < 1 / 3:
        return labelled(rng, thing)
    return matched(rng, thing, linear(ground)) if drawn < 1 / 3 + 1 / 5 else thing


def shade_of_shop(rng: np.random.Generator, shade: np.ndarray) -> np.ndarray:
    """Return the light ``(H, W, 3)`` left on the ground: all of it in half of the pictures, else a lighter ``shade``."""
    if rng.random() < 0.5:
        return np.ones_like(shade)
    lighter = shade ** float(rng.uniform(0.2, 1.0))
    return np.where(lighter.min(2, keepdims=True) > SHADELESS, 1.0, lighter)


def shop_picture(
    rng: np.random.Generator, light: np.ndarray, coverage: np.ndarray, shade: np.ndarray, ground: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return a picture ``(H, W, 3)`` uint8 and its true mask ``(H, W)``, in a random size and mostly compressed.

    ``light (H, W, 3)`` is the linear light of the scene, ``coverage (H, W)`` that of the things, and ``shade`` the result of
    ``shade_of_shop``. Pixels with neither thing nor shadow have exactly the colour ``ground``. In half of the pictures the things
    are overexposed, so that their lightest tones are clipped.
    """
    brighter = float(np.exp(rng.uniform(0, 0.7))) if rng.random() < 0.5 else 1.0
    shown = linear(ground) * shade
    seen = np.asarray(light, np.float32) * brighter
    seen = seen * np.exp(0.02 * rng.standard_normal(seen.shape[:2], dtype=np.float32))[..., None]
    mixed = np.where(coverage[..., None] > 0, seen + (1 - coverage[..., None]) * (1 - brighter) * shown, shown)
    mixed = np.asarray(cv2.GaussianBlur(mixed.astype(np.float32), (0, 0), float(rng.uniform(0.3, 0.8))))
    rgb = np.rint(255 * linear_to_srgb(np.clip(mixed, 0, 1))).astype(np.uint8)
    reached = cv2.dilate((coverage > 0).astype(np.uint8), np.ones((7, 7))) > 0
    rgb[~reached & (shade.min(2) == 1)] = ground
    scale = float(rng.uniform(*SIDES_PX)) / max(rgb.shape[:2])
    rgb = cv2.resize(rgb, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    share = cv2.resize(coverage.astype(np.float32), rgb.shape[1::-1], interpolation=cv2.INTER_AREA)
    if rng.random() < 0.75:
        quality = int(rng.integers(*QUALITIES))
        jpeg = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, quality])[1]
        rgb = np.ascontiguousarray(cv2.imdecode(jpeg, cv2.IMREAD_COLOR)[..., ::-1])
    return rgb, share > 0.5
