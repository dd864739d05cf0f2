"""Common parts of vessels: a hollow body of revolution with a wall, and handles (an ear or a stick)."""

from __future__ import annotations

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import Point, lathe, rounded
from manitwin.geometry.solids.sweep import arc, tube
from manitwin.models.generators.templates.template import Model

RIM_SHARE = 0.05
"""Share of the height that is the rim of a wall."""
_ROWS = 24


def shell(profile: list[Point], wall_m: float, floor_m: float) -> tuple[Manifold, Manifold]:
    """Return the outer solid of a profile (radius, z) from bottom to top, and the solid to subtract for a wall and a floor."""
    z = np.array([height for _, height in profile])
    levels = np.linspace(z[0] + floor_m, z[-1], _ROWS)
    radii = np.maximum(np.interp(levels, z, [radius for radius, _ in profile]) - wall_m, 0.2 * wall_m)
    wall = [(float(radius), float(level)) for radius, level in zip(radii, levels, strict=True)]
    corner = rounded([(0.0, float(levels[0])), *wall[:1], wall[3]], 3 * wall_m)
    return lathe(profile), lathe([*corner, *wall[4:], (wall[-1][0], float(z[-1]) + 2 * wall_m)])


def assemble_from_profile(
    model: Model, profile: list[Point], wall_m: float, floor_m: float, *handles: tuple[str, Manifold]
) -> Model:
    """Assemble a vessel from a profile, as ``assemble_vessel`` does."""
    outer, inner = shell(profile, wall_m, floor_m)
    return assemble_vessel(model, outer, inner, profile[-1][1], profile[0][0], *handles)


def assemble_vessel(
    model: Model, outer: Manifold, inner: Manifold, height_m: float, foot_m: float, *handles: tuple[str, Manifold]
) -> Model:
    """Assemble a vessel: a ``body`` with ``handles``, hollowed at its ``inside``, with its upper edge as ``rim``.

    ``foot_m`` is the radius on which it stands.
    """
    model.add("body", outer)
    for name, solid in handles:
        model.add(name, solid, "handle" if name == "handle" else "")
    model.cut("inside", inner)
    for part in ("body", "inside"):
        model.region("rim", part, lambda centers: centers[:, 2] > (1 - RIM_SHARE) * height_m)
    model.region("base", "body", lambda centers: centers[:, 2] < 0.02 * height_m)
    model.point("opening", "opening", "rim", (0.0, 0.0, height_m), (0.0, 0.0, 1.0))
    return model.point("base", "face", "base", (0.4 * foot_m, 0.0, 0.0), (0.0, 0.0, -1.0))


def ear(
    model: Model, radius_m: float, high_m: float, low_m: float, reach_m: float, thick_m: float
) -> tuple[str, Manifold]:
    """Return a handle towards +X between two heights of a body of radius ``radius_m``, and add a point at its outermost place."""
    inside = radius_m - 0.5 * thick_m
    path = arc(
        [
            (inside, 0, high_m),
            (radius_m + 0.75 * reach_m, 0, high_m + 0.02 * reach_m),
            (radius_m + reach_m, 0, 0.5 * (high_m + low_m)),
            (radius_m + 0.7 * reach_m, 0, low_m + 0.05 * reach_m),
            (inside, 0, low_m),
        ]
    )
    outermost = float(path[:, 0].max()) + 0.35 * thick_m
    model.point("handle", "surface", "handle", (outermost, 0.0, 0.5 * (high_m + low_m)), (1.0, 0.0, 0.0))
    return "handle", tube(path, 0.7 * thick_m, flatten=0.7)


def stick(
    model: Model, radius_m: float, height_m: float, reach_m: float, rise_m: float, half_m: float
) -> tuple[str, Manifold]:
    """Return a long handle towards +X from a wall at a height, and add a point in its middle."""
    start, end = 0.97 * radius_m, radius_m + reach_m
    path = arc([(start, 0, height_m), (start + 0.2 * reach_m, 0, height_m + 0.4 * rise_m), (end, 0, height_m + rise_m)])
    middle = path[len(path) // 2 + 2]
    model.point(
        "handle", "surface", "handle", (float(middle[0]), 0.0, float(middle[2]) + 0.65 * half_m), (0.0, 0.0, 1.0)
    )
    return "handle", tube(path, half_m, flatten=0.65)


def smooth_profile(points: list[Point], *, rows: int = 20) -> list[Point]:
    """Return a smooth profile through (radius, z) points from bottom to top: a Catmull-Rom spline with positive radii."""
    curve = arc([(radius, 0.0, z) for radius, z in points], samples=rows)
    return [(max(float(radius), 1e-4), float(z)) for radius, _, z in curve]
