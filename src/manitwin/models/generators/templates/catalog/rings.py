"""Common parts of lying rings, such as a donut and a toy ring."""

from __future__ import annotations

import numpy as np

from manitwin.models.generators.templates.template import Model


def ring_radii(width_m: float, hole: float) -> tuple[float, float]:
    """Return the radius of a ring's centre line and half the width of its band; ``hole`` is the hole's relative width."""
    return 0.25 * width_m * (1 + hole), 0.25 * width_m * (1 - hole)


def finish_ring(model: Model, width_m: float, hole: float, *, hole_share: float) -> Model:
    """Name the inner wall of a ring about Z (``hole_share`` of half its band), add grasp points at its sides, and lay it down."""
    ring, half = ring_radii(width_m, hole)
    model.region("hole", "body", lambda c: np.hypot(c[:, 0], c[:, 1]) < ring - (1 - hole_share) * half)
    model.point("inner side", "hole", "hole", (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    return model.point("outer side", "surface", "body", (0.0, -0.5 * width_m, 0.0), (0.0, -1.0, 0.0)).rest_on_ground()
