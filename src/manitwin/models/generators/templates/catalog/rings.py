"""Rings that lie: what a donut and a toy's ring have in common."""

from __future__ import annotations

import numpy as np

from manitwin.models.generators.templates.template import Model


def ring_radii(width_m: float, hole: float) -> tuple[float, float]:
    """Return the radius of a ring's middle line and half the width of its band; ``hole`` is the hole's width over the ring's."""
    return 0.25 * width_m * (1 + hole), 0.25 * width_m * (1 - hole)


def with_both_sides(model: Model, width_m: float, hole: float, *, hole_share: float) -> Model:
    """Name the hole's wall of a ring about Z, ``hole_share`` of half its band, note the sides by which it is held, and lay it."""
    ring, half = ring_radii(width_m, hole)
    model.region("hole", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) < ring - (1 - hole_share) * half)
    model.point("inner side", "hole", "hole", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    return model.point("outer side", "surface", "body", (0.0, -0.5 * width_m, 0.0), (0.0, -1.0, 0.0)).laid()
