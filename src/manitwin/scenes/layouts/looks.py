"""Lights and cameras of a layout: seeded, and named so that a picture says which one took it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.scenes.scene import Light, SceneCamera

FOV_Y_RAD = 0.7
LEAST_REACH_M = 0.2
"""A single dice is not all of a picture."""


def make_lights(rng: np.random.Generator) -> tuple[tuple[float, float, float], tuple[Light, ...]]:
    """Return the ambient light and one to three directional lights from above; the first, strongest one casts shadows."""
    count = int(rng.integers(1, 4))
    ambient = tuple(round(float(v), 4) for v in np.full(3, rng.uniform(0.25, 0.45)))
    lights = []
    for number in range(count):
        steep, around = rng.uniform(0.6, 1.3), rng.uniform(-np.pi, np.pi)  # elevation of 34 to 74 degrees
        toward = -np.array([np.cos(steep) * np.cos(around), np.cos(steep) * np.sin(around), np.sin(steep)])
        strength = rng.uniform(1.6, 2.4) / (1 if number == 0 else 3) / count**0.5
        warmth = rng.uniform(-0.08, 0.08)
        color = strength * np.array([1 + warmth, 1.0, 1 - warmth])
        lights.append(Light(direction=_triple(toward), color=_triple(color), casts_shadow=number == 0))
    return (ambient[0], ambient[1], ambient[2]), tuple(lights)


def make_cameras(kind: str, low_m: np.ndarray, high_m: np.ndarray, rng: np.random.Generator) -> tuple[SceneCamera, ...]:
    """Return ``front`` (from beyond the table, towards the robot's place), ``oblique`` and ``overview`` (from above).

    Each sees all of the box of the objects, from ``low_m (3,)`` to ``high_m (3,)``; the first two look at a shelf from its
    open side.
    """
    target = (low_m + high_m) / 2
    reach = max(float(np.linalg.norm(high_m - low_m)) / 2, LEAST_REACH_M)
    front = np.pi if kind == "shelf" else 0.0
    cameras = []
    for name, azimuth, elevation in (("front", front, 0.55), ("oblique", front + 0.8, 0.75), ("overview", front, 1.45)):
        around, up = azimuth + rng.uniform(-0.1, 0.1), elevation + rng.uniform(-0.08, 0.08)
        away = np.array([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])
        distance = reach / np.sin(FOV_Y_RAD / 2) * rng.uniform(1.0, 1.1)
        cameras.append(
            SceneCamera(
                name=name, position_m=_triple(target + distance * away), target_m=_triple(target), fov_y_rad=FOV_Y_RAD
            )
        )
    return tuple(cameras)


def camera_axes(position_m: Sequence[float], target_m: Sequence[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions ``(3,)`` to the right and upward of a picture that looks from a position at a target."""
    forward = np.subtract(target_m, position_m)
    right = np.cross(forward, [0.0, 0.0, 1.0])
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    return right, up / np.linalg.norm(up)


def _triple(values: np.ndarray) -> tuple[float, float, float]:
    x, y, z = (round(float(v), 6) for v in values)
    return x, y, z
