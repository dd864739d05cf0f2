"""Shapes of plants shared by several builders: smooth bodies of revolution, ribs, stalks, leaves."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.shapes import SIDES, Point, chords, lathe, union
from manitwin.geometry.solids.sweep import arc, tube

Radii = Callable[[np.ndarray], np.ndarray]


def smooth_revolution(
    profile: Sequence[Point], width_m: float, height_m: float, *, samples: int = 36, sides: int = SIDES
) -> Manifold:
    """Return the body of revolution about Z of a smooth curve through points.

    A point is (radius over half the width, z over the height).
    """
    curve = arc([(r * width_m / 2, 0.0, z * height_m) for r, z in profile], samples=samples)
    return lathe(curve[:, [0, 2]], sides=chords(sides))


def lay_along_x(solid: Manifold) -> Manifold:
    """Return a solid rotated so that its axis Z lies along +X."""
    return solid.rotate((0, 90, 0))


def scale_radially(solid: Manifold, scale: Radii) -> Manifold:
    """Return a solid whose distances from the axis Z are scaled by a function of the azimuth ``(N,)`` in rad."""

    def moved(vertices: np.ndarray) -> np.ndarray:
        angle = np.arctan2(vertices[:, 1], vertices[:, 0])
        return np.column_stack([vertices[:, :2] * scale(angle)[:, None], vertices[:, 2]])

    return solid.warp_batch(moved)


def furrow(depth: float, half_width_rad: float, toward_rad: float) -> Radii:
    """Return a scale function for ``scale_radially``: a furrow of ``depth`` (in radii) along the azimuth ``toward_rad``."""

    def scale(angle: np.ndarray) -> np.ndarray:
        off = np.abs(np.angle(np.exp(1j * (angle - toward_rad))))
        return np.asarray(1 - depth * np.exp(-((off / half_width_rad) ** 2)))

    return scale


def stalk(points: Sequence[Sequence[float]], start_m: float, end_m: float, *, sides: int = 10) -> Manifold:
    """Return a thin curved stalk through points, with a radius that changes from ``start_m`` to ``end_m``."""
    path = arc(points, samples=10)
    return tube(path, np.linspace(start_m, end_m, len(path)), sides=sides)


def leaves(count: int, outline: Sequence[Point], half_width_m: float, thick_m: float, *, turn: float = 0.0) -> Manifold:
    """Return pointed leaves around the axis Z, each along a curve of (radius, z) from the axis outwards."""
    curve = arc([(r, 0.0, z) for r, z in outline], samples=12)
    along = np.linspace(0.0, 1.0, len(curve))
    half = half_width_m * np.interp(along, [0, 0.35, 0.7, 1], [0.55, 1.0, 0.7, 0.12])
    leaf = tube(curve, half, flatten=thick_m / (2 * half_width_m), sides=8)
    return union([leaf.rotate((0, 0, 360 * (number + turn) / count)) for number in range(count)])
