"""Composites with an exactly known mask: rendered templates on backgrounds that the project generates itself.

A picture has a textured ground plane in perspective and sometimes a wall behind it. The thing throws a shadow on the ground: its
mesh is projected along the light from several points of an extended lamp. The light falls off, and lens blur, sensor noise and
JPEG compression are applied. The kinds are ``single`` (one whole thing, to be accepted), ``cut`` (the frame cuts the thing off)
and ``several`` (two or three things of similar size); the last two are to be rejected. The same part and number always give the
same picture.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from composite_grounds import draw_ground
from composite_shadows import draw_lamp, light_left
from composite_shop import draw_exact_ground, shade_of_shop, shop_picture, shop_thing
from composite_things import HEIGHT_PX, WIDTH_PX, Kind, Part, draw_thing, linear, overlaps, place_of
from composite_variants import Variant, labelled, matched, small

SEEDS: dict[Part, int] = {"tuning": 0, "held-out": 1, "calibration": 2, "training": 3}
VARIANT_SEED = 7


@dataclass(frozen=True)
class Composite:
    """A composite picture and its truth.

    ``rgb`` is ``(H, W, 3) uint8``. ``truth (H, W) bool`` is true where the thing covers at least half of the pixel. ``setting``
    is the kind of ground, with ``wall``, ``clutter``, ``same colour`` or ``clear`` added where they apply.
    """

    rgb: np.ndarray
    truth: np.ndarray
    kind: Kind
    category: str
    setting: str


def composite(part: Part, number: int, variant: Variant = "plain") -> Composite:
    """Make the picture of a part with the given number, in the given variant."""
    rng = np.random.default_rng([number, SEEDS[part]])
    drawn = rng.random()
    kind: Kind = "single" if drawn < 0.72 else "cut" if drawn < 0.86 else "several"
    things = [draw_thing(rng, None, part)]
    main = things[0]
    placements = [place_of(rng, main, kind)]
    if kind == "several":
        for _ in range(int(rng.integers(1, 3))):
            other = draw_thing(rng, main, part)
            places = [place_of(rng, other, "single", scale=float(rng.uniform(0.35, 0.5))) for _ in range(30)]
            apart = [p for p in places if not overlaps(things, placements, other, p)]
            if apart:
                things.append(other)
                placements.append(apart[0])
        kind = "several" if len(things) > 1 else "single"
    ground, setting = draw_ground(rng, part, main, placements[0])
    own_rng = np.random.default_rng([number, SEEDS[part], VARIANT_SEED])
    if variant == "labelled":
        things[0] = labelled(own_rng, main)
    elif variant == "matched":
        under = cv2.warpAffine(main.coverage, placements[0], (WIDTH_PX, HEIGHT_PX)) > 0.5
        things[0] = matched(own_rng, main, ground[under].mean(0) if under.any() else ground.mean((0, 1)))
    elif variant in ("shop", "black"):
        exact = draw_exact_ground(own_rng) if variant == "shop" else np.zeros(3, np.uint8)
        things[0] = shop_thing(own_rng, main, exact)
        ground = np.broadcast_to(linear(exact), ground.shape).astype(np.float32)
        setting = variant
    light = ground.copy()
    lamp = draw_lamp(rng)
    for thing, placement in zip(things, placements, strict=True):
        light *= light_left(rng, thing, placement, lamp)
    shade = np.ones_like(light)
    if variant == "shop":
        shade = shade_of_shop(own_rng, light / np.maximum(ground, 1e-9))
        light = ground * shade
    covered = np.zeros((HEIGHT_PX, WIDTH_PX), np.float32)
    truth = np.zeros((HEIGHT_PX, WIDTH_PX), bool)
    for thing, placement in zip(things, placements, strict=True):
        smooth = 0.45 * max(0.0, 1 / placement[0, 0] - 1) + 1e-3  # details smaller than a pixel would alias
        rgb, coverage = (
            cv2.warpAffine(cv2.GaussianBlur(x, (0, 0), smooth), placement, (WIDTH_PX, HEIGHT_PX))
            for x in (thing.rgb, thing.coverage)
        )
        light = _over(rng, light, rgb, coverage, clear=thing.clear)
        truth |= coverage > 0.5
        covered = np.maximum(covered, coverage)
    if main.clear:
        setting += ", clear"
    if variant in ("shop", "black"):
        return Composite(*shop_picture(own_rng, light, covered, shade, exact), kind, main.category, setting)
    rgb = _photographed(rng, light)
    if variant == "small":
        rgb, truth = small(rgb, truth)
    return Composite(rgb, truth, kind, main.category, setting)


def _over(
    rng: np.random.Generator, light: np.ndarray, rgb: np.ndarray, coverage: np.ndarray, *, clear: bool
) -> np.ndarray:
    """Draw a thing over the picture; through a transparent one the ground is visible, displaced, except at its rim."""
    if not clear:
        return light * (1 - coverage[..., None]) + rgb
    shift = np.array([[1, 0, rng.uniform(-9, 9)], [0, 1, rng.uniform(-9, 9)]])
    through = cv2.warpAffine(light, shift, (WIDTH_PX, HEIGHT_PX), borderMode=cv2.BORDER_REPLICATE)
    depth = cv2.distanceTransform((coverage > 0.5).astype(np.uint8), cv2.DIST_L2, 5)
    rim = np.exp(-depth / float(rng.uniform(2, 8)))[..., None]
    tint = rng.uniform(0.6, 1.0, 3)
    body = through * tint * (1 - float(rng.uniform(0.3, 0.7)) * rim)
    share = float(rng.uniform(0.1, 0.6))
    mixed = (1 - share) * body * coverage[..., None] + share * rgb
    return np.asarray(light * (1 - coverage[..., None]) + mixed)


def _photographed(rng: np.random.Generator, light: np.ndarray) -> np.ndarray:
    """Return the sRGB picture of a camera of linear light: lens blur, photon and read noise, and JPEG compression."""
    light = np.asarray(cv2.GaussianBlur(light.astype(np.float32), (0, 0), float(rng.uniform(0.35, 1.0))))
    light = light * np.exp(rng.normal(0, 0.04, 3)).astype(np.float32)
    gain = float(rng.uniform(0.2, 2.5)) * 1e-4
    light = light + rng.standard_normal(light.shape, dtype=np.float32) * np.sqrt(gain * np.maximum(light, 0) + 1e-6)
    rgb = _SRGB[np.rint(4095 * np.clip(light, 0, 1)).astype(np.int16)]
    encoded = cv2.imencode(".jpg", rgb[..., ::-1], [cv2.IMWRITE_JPEG_QUALITY, int(rng.integers(70, 97))])[1]
    return np.ascontiguousarray(cv2.imdecode(encoded, cv2.IMREAD_COLOR)[..., ::-1])


# IEC 61966-2-1
_SRGB = np.array(
    [round(255 * (12.92 * c if c <= 0.0031308 else 1.055 * c ** (1 / 2.4) - 0.055)) for c in np.arange(4096) / 4095],
    np.uint8,
)
