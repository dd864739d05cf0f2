"""Primitive solids: bodies of revolution, rounded boxes, prisms, ellipsoids.

Metres, Z up. A full circle has ``SIDES`` chords regardless of its radius, or fewer within ``coarser``.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from itertools import product

import numpy as np
from manifold3d import CrossSection, FillRule, JoinType, Manifold

from manitwin.errors import ManiTwinError

SIDES = 48
"""Chords of a full circle; their polygon has 0.3 % less area than the circle."""
CORNER_SIDES = 16
"""Chords of a full circle in rounded edges and tube sections."""
_coarseness: ContextVar[float] = ContextVar("coarseness", default=1.0)

Point = tuple[float, float]


class SolidError(ManiTwinError):
    """Dimensions that do not give a closed solid."""


@contextmanager
def coarser(share: float) -> Iterator[None]:
    """Reduce circles to a share of their usual chords and omit small holes, for solids that are only drawn in small size."""
    token = _coarseness.set(share)
    try:
        yield
    finally:
        _coarseness.reset(token)


def is_coarse() -> bool:
    """Return whether solids are currently made coarser (``coarser``)."""
    return _coarseness.get() < 1.0


def chords(usual: int) -> int:
    """Return the number of chords of a circle with ``usual`` ones under ``coarser``: a multiple of four, which keeps its
    extents.
    """
    return usual if _coarseness.get() == 1.0 else max(8, 4 * round(usual * _coarseness.get() / 4))


def box(x_m: float, y_m: float, z_m: float, *, radius_m: float = 0.0) -> Manifold:
    """Return a box standing on z = 0, centred in x and y, with edges rounded by ``radius_m``."""
    radius_m = min(radius_m, 0.499 * min(x_m, y_m, z_m))
    if radius_m <= 0:
        return require_solid(Manifold.cube((x_m, y_m, z_m), True).translate((0, 0, z_m / 2)), "box")
    ball = Manifold.sphere(radius_m, CORNER_SIDES)
    centers = product(*((-extent / 2 + radius_m, extent / 2 - radius_m) for extent in (x_m, y_m, z_m)))
    solid = Manifold.batch_hull([ball.translate(center) for center in centers])
    return require_solid(solid.translate((0, 0, z_m / 2)), "box")


def prism(outline: CrossSection, height_m: float, *, radius_m: float = 0.0, top: float = 1.0) -> Manifold:
    """Return an outline in x and y extruded from z = 0, with upper and lower edges rounded by ``radius_m``.

    ``top`` scales the outline about the origin towards the upper end, for prisms without rounding only.
    """
    if radius_m <= 0:
        return require_solid(outline.extrude(height_m, 0, 0.0, (top, top)), "prism")
    radius_m = min(radius_m, 0.499 * height_m)
    angles = np.linspace(0.0, np.pi / 2, 5)
    # nested prisms, the narrowest highest: overlapping solids unite reliably, touching ones may not
    slabs = []
    for angle in (angles[:-1] + angles[1:]) / 2:
        inset, low = radius_m * (1 - np.sin(angle)), radius_m * (1 - np.cos(angle))
        inner = outline.offset(-inset, JoinType.Round, 2.0, CORNER_SIDES)
        slabs.append(inner.extrude(height_m - 2 * low + 2e-6).translate((0, 0, low - 1e-6)))
    slabs.append(outline.extrude(height_m - 2 * radius_m).translate((0, 0, radius_m)))
    slabs.append(outline.offset(-radius_m, JoinType.Round, 2.0, CORNER_SIDES).extrude(height_m))
    return require_solid(union(slabs), "prism")


def polygon(points: Sequence[Point] | np.ndarray, *, radius_m: float = 0.0) -> CrossSection:
    """Return a filled polygon ``(K, 2)`` in metres, with convex and concave corners rounded by ``radius_m``."""
    outline = CrossSection([np.asarray(points, dtype=float)], FillRule.NonZero)
    if radius_m > 0:
        outline = outline.offset(-radius_m, JoinType.Round, 2.0, CORNER_SIDES)
        outline = outline.offset(2 * radius_m, JoinType.Round, 2.0, CORNER_SIDES)
        outline = outline.offset(-radius_m, JoinType.Round, 2.0, CORNER_SIDES)
    return outline


def rectangle(x_m: float, y_m: float, *, radius_m: float = 0.0) -> CrossSection:
    """Return a rectangle about the origin with rounded corners."""
    radius_m = min(radius_m, 0.499 * min(x_m, y_m))
    if radius_m <= 0:
        return CrossSection.square((x_m, y_m), True)
    inner = CrossSection.square((x_m - 2 * radius_m, y_m - 2 * radius_m), True)
    return inner.offset(radius_m, JoinType.Round, 2.0, CORNER_SIDES)


def lathe(profile: Sequence[Point] | np.ndarray, *, sides: int | None = None) -> Manifold:
    """Return the solid of revolution about Z of a profile ``(K, 2)`` of (radius, z), closed along the axis."""
    points = [(max(0.0, float(r)), float(z)) for r, z in profile]
    first, last = points[0], points[-1]
    points = [*([(0.0, first[1])] if first[0] > 0 else []), *points, *([(0.0, last[1])] if last[0] > 0 else [])]
    return require_solid(CrossSection([np.array(points)], FillRule.NonZero).revolve(sides or chords(SIDES)), "lathe")


def cylinder(
    radius_m: float, height_m: float, *, top_radius_m: float | None = None, sides: int | None = None
) -> Manifold:
    """Return a cylinder or frustum standing on z = 0."""
    top = radius_m if top_radius_m is None else top_radius_m
    return require_solid(Manifold.cylinder(height_m, radius_m, top, sides or chords(SIDES)), "cylinder")


def ellipsoid(x_m: float, y_m: float, z_m: float, *, sides: int | None = None) -> Manifold:
    """Return an ellipsoid with these full extents about the origin."""
    return require_solid(Manifold.sphere(0.5, sides or chords(SIDES)).scale((x_m, y_m, z_m)), "ellipsoid")


def torus(ring_radius_m: float, tube_radius_m: float, *, sides: int | None = None) -> Manifold:
    """Return a torus about Z, centred at the origin."""
    circle = CrossSection.circle(tube_radius_m, chords(CORNER_SIDES)).translate((ring_radius_m, 0))
    return require_solid(circle.revolve(sides or chords(SIDES)), "torus")


def union(solids: Sequence[Manifold]) -> Manifold:
    """Return the union of solids."""
    from manifold3d import OpType

    return Manifold.batch_boolean(list(solids), OpType.Add)


def rounded(profile: Sequence[Point], radius_m: float, *, steps: int = 4) -> list[Point]:
    """Return an open profile ``(K, 2)`` m with inner corners rounded by quadratic arcs that start at most ``radius_m`` from
    them.
    """
    points = [np.array(p, dtype=float) for p in profile]
    out = [points[0]]
    for before, corner, after in zip(points[:-2], points[1:-1], points[2:], strict=True):
        arms = [before - corner, after - corner]
        lengths = [float(np.linalg.norm(arm)) for arm in arms]
        cut = min(radius_m, 0.45 * min(lengths))
        if cut <= 0:
            out.append(corner)
            continue
        start, end = (corner + arm / length * cut for arm, length in zip(arms, lengths, strict=True))
        out += [(1 - t) ** 2 * start + 2 * t * (1 - t) * corner + t**2 * end for t in np.linspace(0, 1, steps + 1)]
    return [(float(r), float(z)) for r, z in [*out, points[-1]]]


def require_solid(solid: Manifold, what: str) -> Manifold:
    """Return the solid. Raises SolidError if it is empty or has no positive volume."""
    if solid.is_empty() or solid.volume() <= 0:
        raise SolidError(f"{what}: its measures give no solid; give others")
    return solid
