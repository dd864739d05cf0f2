"""Backgrounds of composites: a ground plane and sometimes a wall, with textures in perspective, clutter and light falloff."""

from __future__ import annotations

import cv2
import numpy as np
from composite_things import HEIGHT_PX, WIDTH_PX, Part, Thing, draw_thing, linear

from manitwin.render.procedural_textures import periodic_noise, procedural_texture

GROUNDS: dict[Part, tuple[str, ...]] = {
    "tuning": ("plain", "plain", "plain", "paper", "paper", "wood", "cloth", "concrete"),
    "held-out": ("plain", "plain", "plain", "paper", "wood", "marble", "metal", "carpet", "tiles", "felt"),
    "calibration": (
        *("plain", "plain", "plain", "paper", "wood", "cloth", "concrete"),
        *("terrazzo", "linen", "leather", "checks"),
    ),
    "training": (
        *("plain", "plain", "plain", "paper", "wood", "cloth", "concrete"),
        *("terrazzo", "linen", "leather", "checks"),
    ),
}


def draw_ground(rng: np.random.Generator, part: Part, thing: Thing, placement: np.ndarray) -> tuple[np.ndarray, str]:
    """Return the empty scene ``(H, W, 3)`` in linear light and the name of its kind."""
    family = GROUNDS[part][int(rng.integers(len(GROUNDS[part])))]
    setting = family
    scale = placement[0, 0]
    camera = thing.camera
    y, x = np.mgrid[:HEIGHT_PX, :WIDTH_PX] + 0.5
    seen = np.stack([(x - placement[0, 2]) / scale, (y - placement[1, 2]) / scale], -1)
    rays = (
        np.stack(
            [
                (seen[..., 0] - WIDTH_PX / 2) / camera.focal_px,
                -(seen[..., 1] - HEIGHT_PX / 2) / camera.focal_px,
                -np.ones_like(x),
            ],
            -1,
        )
        @ camera.camera_to_object[:3, :3].T
    )
    size_m = float(np.ptp(thing.vertices, axis=0).max())
    with np.errstate(divide="ignore"):
        reach = np.where(rays[..., 2] < -1e-6, (thing.vertices[:, 2].min() - camera.position[2]) / rays[..., 2], np.inf)
    reach_limit = float(np.linalg.norm(camera.position)) + float(rng.uniform(1.2, 4)) * size_m
    floor = reach < reach_limit
    place = camera.position[:2] + np.where(floor, reach, reach_limit)[..., None] * rays[..., :2]
    colour = _base_colour(rng, thing)
    if colour[1]:
        setting += ", same colour"
    picture = _textured(rng, family, place / size_m, colour[0])
    if not floor.all():
        if family in ("plain", "paper") and rng.random() < 0.6:  # paper bent upwards, no edge behind
            depth = np.clip((np.minimum(reach, 4 * reach_limit) / reach_limit - 0.6) / 1.5, 0, 1)[..., None]
            picture = picture * (1 - depth * rng.uniform(-0.15, 0.3))
        else:
            setting += ", wall"
            wall = _textured(rng, "plain", np.stack([x, y], -1) / 200, _base_colour(rng, thing)[0])
            line = cv2.GaussianBlur(floor.astype(np.float32), (0, 0), float(rng.uniform(0.7, 4)))[..., None]
            picture = picture * line + wall * (1 - line)
    if rng.random() < 0.08:
        setting += ", clutter"
        picture = _cluttered(rng, picture, part)
    return (picture * _falloff(rng)).astype(np.float32), setting


def _base_colour(rng: np.random.Generator, thing: Thing) -> tuple[np.ndarray, bool]:
    """Return the linear colour of a ground: mostly light and pale; in one of ten pictures nearly that of the thing.

    The flag says whether the ground has nearly the colour of the thing.
    """
    if rng.random() < 0.1:
        mean = thing.rgb[thing.coverage > 0.5].mean(0)
        return np.clip(mean * np.exp(rng.normal(0, 0.12, 3)), 0.01, 0.95), True
    drawn = rng.random()
    lightness = rng.uniform(0.5, 0.95) if drawn < 0.6 else rng.uniform(0.02, 0.5)
    tint = rng.normal(0, 0.05 if rng.random() < 0.7 else 0.4, 3)
    return np.clip(lightness * np.exp(tint), 0.01, 0.95), False


def _textured(rng: np.random.Generator, family: str, place: np.ndarray, colour: np.ndarray) -> np.ndarray:
    """Return a surface ``(H, W, 3)`` in linear light whose texture repeats over ``place (H, W, 2)``.

    ``place`` is in units of the thing's size.
    """
    if family == "plain":
        return np.broadcast_to(colour, (*place.shape[:2], 3)).copy()
    seed, repeat = int(rng.integers(1 << 30)), float(rng.uniform(0.15, 0.6))
    if family in ("wood", "cloth", "marble", "metal"):
        texture = linear(procedural_texture(family, seed, size_px=512).color)
    else:
        texture = colour * np.clip(1 + _noise_of(rng, family), 0.05, 3)[..., None]
        if family == "tiles":
            repeat *= 2
    angle = rng.uniform(0, np.pi)
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    at = (place @ turn * repeat * 512).astype(np.float32) % 512
    # Details smaller than a pixel are blurred, to avoid aliasing.
    step = float(np.median(np.abs(np.diff(place, axis=1)).max(-1))) * repeat * 512
    smooth = cv2.GaussianBlur(texture.astype(np.float32), (0, 0), max(0.3, 0.5 * step), borderType=cv2.BORDER_REFLECT)
    smooth = np.pad(smooth, ((0, 1), (0, 1), (0, 0)), mode="wrap")
    return np.asarray(cv2.remap(smooth, at[..., 0], at[..., 1], cv2.INTER_LINEAR))


def _noise_of(rng: np.random.Generator, family: str) -> np.ndarray:
    """Return the pattern ``(512, 512)`` of a material as deviations from its mean brightness."""
    if family == "paper":
        return 0.012 * periodic_noise(rng, 512, wavelengths=(0.05, 0.05), slope=0.4)
    if family == "concrete":
        clouds = periodic_noise(rng, 512, wavelengths=(0.5, 0.5), slope=1.2)
        return 0.06 * clouds + 0.03 * periodic_noise(rng, 512, wavelengths=(0.01, 0.01), slope=0.2)
    if family == "carpet":
        return 0.12 * periodic_noise(rng, 512, wavelengths=(0.02, 0.02), slope=0.2)
    if family == "felt":
        return 0.05 * periodic_noise(rng, 512, wavelengths=(0.05, 0.02), slope=0.3)
    if family == "terrazzo":
        chips = periodic_noise(rng, 512, wavelengths=(0.04, 0.04), slope=1.5)
        return float(rng.uniform(0.08, 0.3)) * np.clip(6 * (np.abs(chips) - 1.2), 0, 1) * np.sign(chips)
    if family == "linen":
        phase = 2 * np.pi * 48 * (np.arange(512) + 0.5) / 512
        threads = np.sin(phase)[:, None] * np.sin(phase)[None]
        return 0.04 * threads + 0.03 * periodic_noise(rng, 512, wavelengths=(0.3, 0.01), slope=0.4)
    if family == "leather":
        grain = np.abs(periodic_noise(rng, 512, wavelengths=(0.04, 0.04), slope=1.2))
        return np.asarray(0.1 * np.minimum(grain, 0.6) + 0.02 * periodic_noise(rng, 512, wavelengths=(0.6, 0.6)))
    if family == "checks":
        bands = np.sign(np.sin(2 * np.pi * 4 * (np.arange(512) + 0.5) / 512))
        return float(rng.uniform(0.03, 0.2)) * (bands[:, None] + bands[None]) / 2 + 0.01 * periodic_noise(
            rng, 512, wavelengths=(0.02, 0.02), slope=0.2
        )
    tiles = 0.03 * periodic_noise(rng, 512, wavelengths=(0.4, 0.4), slope=1.0)
    tiles[::128] = tiles[1::128] = tiles[:, ::128] = tiles[:, 1::128] = -float(rng.uniform(0.2, 0.6))
    return tiles


def _cluttered(rng: np.random.Generator, picture: np.ndarray, part: Part) -> np.ndarray:
    """Draw other objects, far out of focus, behind the thing."""
    layer = picture.copy()
    for _ in range(int(rng.integers(2, 5))):
        other = draw_thing(rng, None, part)
        moved = np.array([[0.5, 0, rng.uniform(-0.2, 0.8) * WIDTH_PX], [0, 0.5, rng.uniform(-0.4, 0.1) * HEIGHT_PX]])
        rgb, coverage = (cv2.warpAffine(x, moved, (WIDTH_PX, HEIGHT_PX)) for x in (other.rgb, other.coverage))
        layer = layer * (1 - coverage[..., None]) + rgb
    return np.asarray(cv2.GaussianBlur(layer, (0, 0), float(rng.uniform(10, 22))))


def _falloff(rng: np.random.Generator) -> np.ndarray:
    """Return the light ``(H, W, 1)`` of a lamp at the side, with the vignette of a lens."""
    y, x = np.mgrid[-1 : 1 : HEIGHT_PX * 1j, -1 : 1 : WIDTH_PX * 1j]
    direction, strength = rng.uniform(0, 2 * np.pi), rng.uniform(0, 0.3)
    slope = 1 + strength * (np.cos(direction) * x + np.sin(direction) * y)
    spot = 1 + rng.uniform(-0.1, 0.35) * np.exp(-((x - rng.uniform(-1, 1)) ** 2 + (y - rng.uniform(-1, 1)) ** 2) / 0.8)
    return np.asarray(slope * spot * (1 - rng.uniform(0, 0.18) * (x**2 + y**2)))[..., None]
