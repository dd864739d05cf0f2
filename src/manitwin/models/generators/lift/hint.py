"""Shape hints from an object's name, by the prior of its category."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Prior

MOST_OUT_OF_ROUND = 1.3
"""Maximum ratio of the longest to the shortest side of a ball, and of the longest to the second side of a plate."""
LEAST_ELLIPSE_IOU, ELLIPSE_IN_RECTANGLE = 0.92, 0.85
"""An ellipse fills 0.785 of its bounding rectangle; a rectangle overlaps the ellipse of its moments by 0.84."""
_CYLINDERS = frozenset({"cylindrical", "short cylindrical"})
_NON_SPHERICAL_BALLS = frozenset({"rugby ball"})


@dataclass(frozen=True)
class ShapeHint:
    """Shape properties of a category.

    ``stands``: put down upright (None: unknown); ``container``: open at the top; ``hollow_below``: open at the bottom;
    ``round``, ``boxy`` and ``flat`` describe the shape. ``volume_share`` is the usual volume of the material over the cube of
    the usual longest side.
    """

    stands: bool | None = None
    container: bool = False
    round: bool = False
    boxy: bool = False
    flat: bool = False
    hollow_below: bool = False
    volume_share: float | None = None


def hint_from_name(name: str | None) -> ShapeHint:
    """Return the hint of the prior found for ``name``; an empty hint if there is none."""
    prior = find_prior(name)
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


def roundness_conflict(name: str | None, extents: np.ndarray) -> str | None:
    """Return why sides ``(3,)`` contradict a name that says round; None if they do not.

    A ball is as wide as high, and a plate is round from above. A plate seen at an angle has an elliptic silhouette, and a
    ball beside its mirror image that of a dumbbell.
    """
    prior = find_prior(name)
    if prior is None:
        return None
    longest, second, shortest = np.sort(np.asarray(extents, float))[::-1]
    ball = prior.shape == "round" and prior.category.endswith("ball") and prior.category not in _NON_SPHERICAL_BALLS
    if ball and longest > MOST_OUT_OF_ROUND * shortest:
        return f"it would be {longest / shortest:.1f} times as long as wide, as no {prior.category} is"
    if prior.shape == "flat and round" and longest > MOST_OUT_OF_ROUND * second:
        return f"it would be {longest / second:.1f} times as long as wide, as no {prior.category} is: it is seen at an angle"
    return None


def is_cylinder(name: str | None) -> bool:
    """Tell whether a name's category is simply a cylinder."""
    prior = find_prior(name)
    return prior is not None and prior.shape in _CYLINDERS


def cylinder_conflict(name: str | None, silhouette: Mapping[str, float]) -> str | None:
    """Return why the scores of a silhouette contradict a cylinder seen from the side, for a name that says cylinder; else None.

    From the side a cylinder is a rectangle; an ellipse is its end, seen at an angle.
    """
    prior = find_prior(name)
    if prior is None or not is_cylinder(name):
        return None
    if silhouette["rectangle_iou"] > ELLIPSE_IN_RECTANGLE or silhouette["ellipse_iou"] < LEAST_ELLIPSE_IOU:
        return None
    return f"its outline is an ellipse, as a {prior.category} has none from the side: it is seen at an angle"


def _volume_share(prior: Prior) -> float | None:
    """Return the usual volume of a category from mass and density, over the cube of its length; None for hollow ones."""
    density = prior.bulk_density_kg_m3
    if density is None or prior.container:
        return None
    return prior.mass_kg.typical / density.typical / prior.longest_axis_m.typical**3
