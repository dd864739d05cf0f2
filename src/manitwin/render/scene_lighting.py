"""The lights of a scene, and the exposure that a camera would choose under them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WHITE_PAPER = 0.86
"""Share of the picture's white that a perfectly white, level surface in full light gets; what faces a light gets more."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # linear sRGB (IEC 61966-2-1)


@dataclass(frozen=True)
class DirectionalLight:
    """Light that falls along ``direction (3,)``, world frame; ``color (3,)`` is its linear RGB irradiance, in any one unit."""

    direction: np.ndarray
    color: np.ndarray
    casts_shadow: bool = False


@dataclass(frozen=True)
class Lighting:
    """Directional lights, and ``ambient (3,)``, what even surroundings would make a white surface send out (linear RGB)."""

    ambient: np.ndarray
    lights: tuple[DirectionalLight, ...]

    def exposed(self) -> Lighting:
        """Return these lights, all by one factor brighter or dimmer, so that level white paper becomes ``WHITE_PAPER``.

        Lambert's law: a white surface under irradiance E at an angle a sends out E cos(a) / pi. Lights from below count
        nothing. Where no light reaches a level surface, they are returned as they are.
        """
        level = np.asarray(self.ambient, float).copy()
        for light in self.lights:
            level += np.asarray(light.color) * max(0.0, -_unit(light.direction)[2]) / np.pi
        seen = float(LUMINANCE @ level)
        factor = WHITE_PAPER / seen if seen > 0 else 1.0
        lights = tuple(
            DirectionalLight(_unit(x.direction), np.asarray(x.color, float) * factor, x.casts_shadow)
            for x in self.lights
        )
        return Lighting(np.asarray(self.ambient, float) * factor, lights)


def _unit(vector: np.ndarray) -> np.ndarray:
    return np.asarray(vector, float) / np.linalg.norm(vector)


STUDIO = Lighting(
    ambient=np.array([0.42, 0.44, 0.47]),
    lights=(
        DirectionalLight(np.array([-0.45, 0.55, -1.0]), np.array([1.95, 1.88, 1.78]), casts_shadow=True),
        DirectionalLight(np.array([-0.7, -0.6, -0.5]), np.array([0.35, 0.37, 0.40])),
    ),
)
"""A warm key light from the front left of a robot's table, a cool fill light, and bright surroundings."""
