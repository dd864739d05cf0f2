"""What a name says of a thing's shape, by its category's prior."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from manitwin.models.annotators.prior_names import lookup
from manitwin.models.annotators.prior_records import Prior

MOST_OUT_OF_ROUND = 1.3
"""Of a ball's longest side over its shortest, and of a plate's over its second."""
LEAST_ELLIPSE_IOU, ELLIPSE_IN_RECTANGLE = 0.92, 0.85
"""An ellipse fills 0.785 of its rectangle, a rectangle overlaps by 0.84 with the ellipse of its moments."""
_CYLINDERS = frozenset({"cylindrical", "short cylindrical"})
_NO_BALLS = frozenset({"rugby ball"})


@dataclass(frozen=True)
class ShapeHint:
    """``stands``: put down upright (None: unknown); ``container``: open at the top; ``hollow_below``: open at the bottom; the
    others describe its shape.

    ``volume_share`` is the usual volume of its matter over the cube of the usual longest side.
    """

    stands: bool | None = None
    container: bool = False
    round: bool = False
    boxy: bool = False
    flat: bool = False
    hollow_below: bool = False
    volume_share: float | None = None


def hint_from_name(name: str | None) -> ShapeHint:
    """Return the hint of the prior that ``name`` finds; an empty hint where it finds none."""
    prior = lookup(name)
    if prior is None:
        return ShapeHint()
    words = prior.shape.replace("-", " ").split()
    return ShapeHint(
        stands=prior.stands,
        container=prior.container,
        round=bool({"cylindrical", "round", "bottle", "bowl"} & set(words)),
        boxy=bool({"box", "rectangular", "block"} & set(words)),
        flat=bool({"flat", "shallow"} & set(words)),
        hollow_below="bowl" in words and not prior.container,
        volume_share=_volume_share(prior),
    )


def why_not_round(name: str | None, extents: np.ndarray) -> str | None:
    """Return why sides of lengths ``(3,)`` are those of no such thing, where its name says that it is round; else None.

    A ball is as wide as it is high, and a plate round from above: one that is seen at an angle has an ellipse for its outline,
    and beside a mirror image a ball has that of a dumbbell.
    """
    prior = lookup(name)
    if prior is None:
        return None
    longest, second, shortest = np.sort(np.asarray(extents, float))[::-1]
    ball = prior.shape == "round" and prior.category.endswith("ball") and prior.category not in _NO_BALLS
    if ball and longest > MOST_OUT_OF_ROUND * shortest:
        return f"it would be {longest / shortest:.1f} times as long as wide, as no {prior.category} is"
    if prior.shape == "flat and round" and longest > MOST_OUT_OF_ROUND * second:
        return f"it would be {longest / second:.1f} times as long as wide, as no {prior.category} is: it is seen at an angle"
    return None


def is_cylinder(name: str | None) -> bool:
    """Tell whether a name's category is a cylinder and nothing else."""
    prior = lookup(name)
    return prior is not None and prior.shape in _CYLINDERS


def why_no_cylinder(name: str | None, silhouette: Mapping[str, float]) -> str | None:
    """Return why an outline of these scores is that of no such thing seen from the side, where its name says cylinder; else None.

    From the side a cylinder is a rectangle; an ellipse is its end, seen at an angle.
    """
    prior = lookup(name)
    if prior is None or not is_cylinder(name):
        return None
    if silhouette["rectangle_iou"] > ELLIPSE_IN_RECTANGLE or silhouette["ellipse_iou"] < LEAST_ELLIPSE_IOU:
        return None
    return f"its outline is an ellipse, as a {prior.category} has none from the side: it is seen at an angle"


def _volume_share(prior: Prior) -> float | None:
    """Return the volume of a category's things by their mass, over the cube of their length; None for hollow ones."""
    density = prior.bulk_density_kg_m3
    if density is None or prior.container:
        return None
    return prior.mass_kg.typical / density.typical / prior.longest_axis_m.typical**3
