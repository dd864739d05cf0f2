"""Shadows of composites: a mesh projected along the light, from several points of an extended lamp."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from composite_things import HEIGHT_PX, WIDTH_PX, Thing

from manitwin.geometry.poses import inverse, transform_points


@dataclass(frozen=True)
class Lamp:
    """A lamp that throws a shadow.

    ``towards (3,)`` is the direction of its light, ``extent`` its size divided by its distance (0.02 gives a hard shadow), and
    ``depth (3,)`` the darkness of its shadow per colour channel, tinted by other lights.
    """

    towards: np.ndarray
    extent: float
    depth: np.ndarray
    ambient: float


def draw_lamp(rng: np.random.Generator) -> Lamp:
    """Draw a lamp at random; in three of ten pictures it is small and its shadow hard."""
    azimuth, elevation = rng.uniform(0, 2 * np.pi), np.deg2rad(rng.uniform(35, 80))
    towards = -np.array([np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)])
    hard = rng.random() < 0.3
    depth = np.clip(rng.uniform(0.0, 0.55) * (1 + rng.normal(0, 0.08, 3)), 0, 0.7)
    return Lamp(
        towards, float(rng.uniform(0.02, 0.1) if hard else rng.uniform(0.25, 0.8)), depth, float(rng.uniform(0.1, 0.5))
    )


def light_left(rng: np.random.Generator, thing: Thing, placement: np.ndarray, lamp: Lamp) -> np.ndarray:
    """Return the light ``(H, W, 3)`` that remains on the ground around a thing: that of the lamp, and that of the sky near the
    contact.
    """
    ground_z = thing.vertices[:, 2].min()
    lamps = 6
    shade = np.zeros((HEIGHT_PX, WIDTH_PX), np.float32)
    for _ in range(lamps):
        towards = lamp.towards + lamp.extent * rng.uniform(-0.5, 0.5, 3)
        towards[2] = min(towards[2], -0.25)
        shade += _fallen(thing, placement, ground_z, towards) / lamps
    size_px = placement[0, 0] * HEIGHT_PX
    shade = cv2.GaussianBlur(shade, (0, 0), 0.6 + 0.012 * lamp.extent * size_px)
    sky = np.zeros((HEIGHT_PX, WIDTH_PX), np.float32)
    for step in range(7):
        around = 2 * np.pi * step / 7
        sky += _fallen(thing, placement, ground_z, np.array([np.cos(around), np.sin(around), -1.0])) / 7
    sky = cv2.GaussianBlur(sky, (0, 0), 0.02 * size_px)
    return np.asarray((1 - lamp.depth * shade[..., None]) * (1 - lamp.ambient * sky[..., None]))


def _fallen(thing: Thing, placement: np.ndarray, ground_z: float, towards: np.ndarray) -> np.ndarray:
    drop = (thing.vertices[:, 2] - ground_z) / -towards[2]
    fallen = thing.vertices + drop[:, None] * towards
    camera = thing.camera
    seen = transform_points(inverse(camera.camera_to_object), fallen)
    mask = np.zeros((HEIGHT_PX // 2, WIDTH_PX // 2), np.uint8)
    with np.errstate(divide="ignore", invalid="ignore"):
        pixels = camera.focal_px * seen[:, :2] / -seen[:, 2:] * [1, -1] + [WIDTH_PX / 2, HEIGHT_PX / 2]
    good = (seen[:, 2] < -1e-3)[thing.faces].all(1)
    pixels = pixels * placement[0, 0] + placement[:, 2]
    corners = np.clip(np.nan_to_num(pixels) / 2, -4000, 4000).astype(np.int32)[thing.faces[good]]
    edges = corners[:, [1, 2]] - corners[:, [0]]
    turned = edges[:, 0, 0] * edges[:, 1, 1] - edges[:, 0, 1] * edges[:, 1, 0]
    for corner in corners[turned > 0]:  # one side of a closed solid covers the whole shadow
        cv2.fillConvexPoly(mask, corner, 1)
    return cv2.resize(mask.astype(np.float32), (WIDTH_PX, HEIGHT_PX))
