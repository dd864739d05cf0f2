"""Scene lighting, and automatic exposure."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

WHITE_PAPER = 0.86
"""Share of the image's white for a level white surface in full light; surfaces facing a light are brighter."""

LUMINANCE = np.array([0.2126, 0.7152, 0.0722])  # linear sRGB (IEC 61966-2-1)


@dataclass(frozen=True)
class DirectionalLight:
    """Light along ``direction (3,)`` in the world frame; ``color (3,)`` is its linear RGB irradiance, in an arbitrary common
    unit.
    """

    direction: np.ndarray
    color: np.ndarray
    casts_shadow: bool = False


@dataclass(frozen=True)
class Lighting:
    """Directional lights, and ``ambient (3,)``, the radiance of a white surface under uniform surroundings (linear RGB)."""

    ambient: np.ndarray
    lights: tuple[DirectionalLight, ...]

    def with_auto_exposure(self) -> Lighting:
        """Return the lights scaled by a common factor so that level white paper has the brightness ``WHITE_PAPER``.

        Lambert's law: a white surface under irradiance E at an angle a has the radiance E cos(a) / pi. Lights from below are
        ignored. If no light reaches a level surface, the lights are unchanged.
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
