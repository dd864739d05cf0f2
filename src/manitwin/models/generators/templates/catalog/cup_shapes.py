"""Common shapes of cups for tea and coffee: a side that widens from a foot to a lip, and a handle like a question mark."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import Point, lathe
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model

RING = 0.05
"""Height of the ring below the rounded bottom on which a cup stands, relative to the cup's height."""
EAR_SHARE = 0.08
"""Thickness of the handle relative to the cup's width."""
HIGHEST_JOIN = 0.6
"""Largest relative height of the handle's lower end; a handle that joins higher leaves no room for a finger."""
_NECK = 0.94  # of the foot's radius: the upper end of the ring, where the bottom begins
_UNDERSIDE, _SIDE = 10, 12  # points of the profile below and above the widest point
_LEVELS = 24
_FLARED_FROM = 4  # power of the relative height: half of the flare is in the upper tenth
_EAR_TOP = 0.87  # of the height: upper end of the handle at the wall
_LEAST_JOIN = 0.15  # of the height: lower handles would touch the ground beside the foot
_EMBEDDED = 1.5  # of the wall: depth of the handle's ends in it, to join a slanted wall all around


@dataclass(frozen=True)
class CupSide:
    """The side of a cup, in metres.

    Given are the rim's radius and height, the largest radius ``wide`` of the lower half and its height ``belly``, the foot's
    radius, and the outward lean of the lip (``lip``).
    """

    radius_m: float
    height_m: float
    wide_m: float
    belly_m: float
    foot_m: float
    lip_m: float
    wall_m: float

    @property
    def floor_m(self) -> float:
        """Height of the inner floor: the ring plus one wall thickness."""
        return RING * self.height_m + self.wall_m

    def profile(self, *, underside: int = _UNDERSIDE, side: int = _SIDE) -> list[Point]:
        """Return (radius, z) from bottom to top: a ring, a quarter ellipse to the widest point, and a side with its lip."""
        ring, neck = RING * self.height_m, _NECK * self.foot_m
        belly = max(self.belly_m, 2 * ring)
        turn = np.linspace(0.0, np.pi / 2, underside)
        up = np.linspace(0.0, 1.0, side)[1:]
        lower = neck + (self.wide_m - neck) * np.sin(turn), ring + (belly - ring) * (1 - np.cos(turn))
        below_lip = self.radius_m - self.lip_m
        # Vertical at the widest point, then the mean slope of the side below its lip.
        radii = self.wide_m + (below_lip - self.wide_m) * (2 - up) * up**2 + self.lip_m * up**_FLARED_FROM
        upper = radii, belly + (self.height_m - belly) * up
        points = np.concatenate([np.stack(lower, 1), np.stack(upper, 1)])
        return [(self.foot_m, 0.0), *((max(float(radius), 1e-4), float(z)) for radius, z in points)]

    def radius_at(self, z_m: float) -> float:
        """Return the radius at a height, metres."""
        radii, heights = np.array(self.profile()).T
        return float(np.interp(z_m, heights, radii))

    def solids(self) -> tuple[Manifold, Manifold]:
        """Return the outer solid, and the solid to subtract from it so that the wall has the same thickness everywhere."""
        radii, heights = np.array(self.profile(underside=8 * _UNDERSIDE, side=8 * _SIDE)).T
        levels = np.linspace(self.floor_m, self.height_m, _LEVELS)
        # All points one wall thickness away from the profile: balls about its points, cut at each level.
        within = self.wall_m**2 - (heights[None] - levels[:, None]) ** 2
        inner = np.where(within >= 0, radii[None] - np.sqrt(np.maximum(within, 0.0)), np.inf).min(axis=1)
        hollow = [(max(float(r), 0.2 * self.wall_m), float(z)) for r, z in zip(inner, levels, strict=True)]
        above = (hollow[-1][0], self.height_m + 2 * self.wall_m)
        return lathe(self.profile()), lathe([(0.0, self.floor_m), *hollow, above])


def cup_ear(
    model: Model, side: CupSide, *, reach_m: float, join: float, hook: float, thick_m: float
) -> tuple[str, Manifold]:
    """Return a handle towards +X from near the rim down to ``join`` of the height, and add a point at its outermost place.

    ``hook`` is 0 for an even arc and 1 for a question mark, whose lower half returns to the wall obliquely. ``reach_m`` is how
    far the handle protrudes.
    """
    high, low = _EAR_TOP * side.height_m, max(join, _LEAST_JOIN) * side.height_m
    span, bend = high - low, float(np.clip(hook, 0.0, 1.2))
    away = 0.5 * (side.radius_m + side.wide_m)
    begin, end = (side.radius_at(z) - _EMBEDDED * side.wall_m for z in (high, low))
    outermost = low + (0.5 + 0.18 * bend) * span
    path = arc(
        [
            (begin, 0, high),
            (away + 0.72 * reach_m, 0, high + 0.02 * reach_m),
            (away + reach_m, 0, outermost),
            (away + (0.72 - 0.2 * bend) * reach_m, 0, low + (0.06 + 0.24 * bend) * span),
            (end, 0, low),
        ],
        samples=28,
    )
    at = int(path[:, 0].argmax())
    place = (float(path[at, 0]) + 0.35 * thick_m, 0.0, float(path[at, 2]))
    model.point("handle", "surface", "handle", place, (1.0, 0.0, 0.0))
    return "handle", tube(path, 0.7 * thick_m, flatten=0.7)
