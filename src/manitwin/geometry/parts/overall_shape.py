"""One word for the overall shape of an object, from its proportions, box fill and roundness."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh

from manitwin.geometry.parts.protrusions import round_body
from manitwin.geometry.sampling import sample_surface

_SAMPLES = 4000
_LONG, _FLAT = 2.2, 3.0  # ratio of longest to second, and of second to shortest side of the box
_BOX_FILL = 0.85  # fraction of the box: a box fills 1, an aligned cylinder 0.785, a ball 0.524
_ROUND_RESIDUAL = 0.05  # fraction of the radius: deviation from a body of revolution


@dataclass(frozen=True)
class OverallShape:
    """Proportions of a tight box (longest / second, second / shortest), its filled share, and roundness.

    ``revolution_residual`` is the median distance of the surface from the best body of revolution about an axis of the box,
    relative to its radius: 0 for a perfect one.
    """

    elongation: float
    flatness: float
    box_fill: float
    revolution_residual: float

    @property
    def proportion(self) -> str:
        """'long', 'flat' or 'compact'."""
        if self.elongation >= _LONG:
            return "long"
        return "flat" if self.flatness >= _FLAT else "compact"

    @property
    def is_box(self) -> bool:
        """Whether it fills its box more than any round object."""
        return self.box_fill > _BOX_FILL

    @property
    def word(self) -> str:
        """An adjective for an unnamed object of this shape."""
        if self.is_box:
            return {"long": "bar-shaped", "flat": "slab-shaped", "compact": "box-shaped"}[self.proportion]
        if self.revolution_residual < _ROUND_RESIDUAL:
            if self.flatness >= _FLAT:
                return "disc-shaped"
            near_ball = self.elongation < 1.15 and self.flatness < 1.15
            return "round" if near_ball and self.box_fill < 0.62 else "cylindrical"
        return {"long": "elongated", "flat": "flat", "compact": "irregular"}[self.proportion]


def overall_shape(mesh: trimesh.Trimesh, rng: np.random.Generator) -> OverallShape:
    """Measure proportions, fill and roundness of a watertight mesh in the smaller of the boxes along its own and principal
    axes.
    """
    surface, _, _ = sample_surface(mesh, _SAMPLES, rng)
    boxes = [surface @ axes.T for axes in (np.eye(3), np.asarray(mesh.principal_inertia_vectors))]
    local = min(boxes, key=lambda points: float(np.prod(np.ptp(points, axis=0))))
    longest, second, shortest = sorted((float(e) for e in np.ptp(local, axis=0)), reverse=True)
    return OverallShape(
        elongation=longest / max(second, 1e-9),
        flatness=second / max(shortest, 1e-9),
        box_fill=float(mesh.volume) / max(longest * second * shortest, 1e-12),
        revolution_residual=min(_residual(np.roll(local - local.mean(0), turn, axis=1)) for turn in range(3)),
    )


def _residual(local_m: np.ndarray) -> float:
    """Return the median relative distance from the outline about the third axis, ignoring samples near the end faces."""
    width, depth, height = np.ptp(local_m, axis=0)
    if min(width, depth) < 0.85 * max(width, depth):
        return 1.0
    body = round_body(local_m, local_m[:, :2].min(0) + np.array([width, depth]) / 2)
    middle = np.abs(local_m[:, 2] - local_m[:, 2].min() - height / 2) < 0.45 * height
    radius = np.hypot(*(local_m[middle, :2] - body.axis_xy_m).T)
    outline = body.radius_at(local_m[middle])
    outer = radius > 0.7 * outline
    return float(np.median(np.abs(radius[outer] / outline[outer] - 1))) if outer.any() else 1.0
