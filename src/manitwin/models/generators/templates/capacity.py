"""Capacity of a generated container, and the scale at which an object has a stated volume or mass."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from manifold3d import CrossSection, Manifold, OpType

from manitwin.errors import UsageError
from manitwin.models.annotators.priors import load_materials, load_priors
from manitwin.models.generators.templates.stated_amounts import Amount
from manitwin.models.generators.templates.template_object import TemplateObject

CLOSED_WALLS_M = {"glass": 0.003, "plastic": 0.0005, "aluminium": 0.0001, "steel": 0.0003, "cardboard": 0.0005}
"""Wall thickness of closed containers by surface material: glass bottles and jars 2 to 4 mm, PET 0.3 to 0.7, cans 0.1 to 0.3,
drink cartons and composite cans 0.4 to 0.9.
"""
TWO_WALLS_M = 0.005
"""Wall thickness of a thermos: two steel sheets and the gap between them."""
LEVELS = 200
"""Number of horizontal sections over which the volume of a cavity is summed."""
MOST_ROUNDS, CLOSE = 8, 0.005
"""Maximum number of iterations of the scale search, and the relative error at which it stops."""
LEAST, MOST = 1e-9, 1e3
"""Bounds on volume (m^3) and mass (kg); no scale is searched for values outside."""


def capacity_m3(made: TemplateObject) -> float | None:
    """Return the capacity of an object: the volume below the lowest point of its rim, or inside the walls of a closed container.

    None for an object that is no container, and for a container without a cavity.
    """
    prior = load_priors()[made.category]
    if prior.vessel:
        solid, _ = made.solids[list(made.masses_kg).index("body")]
        return max(float(solid.volume()) - _closed_wall_m(made) * float(solid.surface_area()), 0.0)
    if not prior.container:
        return None
    solid = Manifold.batch_boolean([each for each, _ in made.solids], OpType.Add)
    low, high = solid.bounding_box()[2], solid.bounding_box()[5]
    step_m = (high - low) / LEVELS
    hollows_m2 = [_hollow_m2(solid.slice(low + (level + 0.5) * step_m)) for level in range(LEVELS)]
    return sum(hollows_m2) * step_m or None


def require_capacity_m3(made: TemplateObject, amount: Amount) -> float:
    """Return ``capacity_m3`` of an object whose volume is stated as an ``amount``; raises UsageError if it is no container."""
    held = capacity_m3(made)
    if held is None:
        raise UsageError(
            f"a {made.category} is not a container, so {amount.said} cannot be its capacity; give a length or a mass"
        )
    return held


def _closed_wall_m(made: TemplateObject) -> float:
    """Return the wall thickness (m) of a closed container; raises UsageError if it is unknown for its material."""
    if made.category == "thermos":
        return TWO_WALLS_M
    surface = made.looks["body"].surface
    open_ware = load_materials()[surface].wall_m
    if surface not in CLOSED_WALLS_M and open_ware is None:
        raise UsageError(
            f"what a {made.category} of {made.looks['body'].material} holds is not known, as the thickness of its wall is not;"
            " say a length"
        )
    return CLOSED_WALLS_M[surface] if open_ware is None else CLOSED_WALLS_M.get(surface, open_ware.typical)


def _hollow_m2(section: CrossSection) -> float:
    """Return the area (m^2) of the largest hole in a horizontal section; 0 if the wall around it is interrupted, as
    at a spout.
    """
    holes = [-area for loop in section.to_polygons() if (area := _area_m2(loop)) < 0]
    return max(holes, default=0.0)


def _area_m2(loop: np.ndarray) -> float:
    """Return the signed area (m^2) of a closed loop ``(N, 2)`` in metres, negative if clockwise, as around a hole."""
    x, y = loop.T
    return 0.5 * float(x @ np.roll(y, -1) - np.roll(x, -1) @ y)


def solve_scale(amount: Amount, made_at: Callable[[float], TemplateObject]) -> float:
    """Return the scale at which the object of ``made_at(scale)`` has a stated volume or mass.

    The search is iterative, since walls and sheets keep their thickness. Raises UsageError for a volume of an object that is no
    container, and for an amount that no scale gives.
    """
    scale, wanted = 1.0, amount.mass_kg if amount.volume_m3 is None else amount.volume_m3
    for _ in range(MOST_ROUNDS):
        made = made_at(scale)
        has = sum(made.masses_kg.values()) if amount.volume_m3 is None else require_capacity_m3(made, amount)
        if wanted is None or not LEAST < wanted < MOST:
            break
        if has > 0 and abs(has / wanted - 1) < CLOSE:
            return scale
        scale *= float((wanted / max(has, 0.05 * wanted)) ** (1 / 3))
    raise UsageError(f"no size gives a {made.category} of {amount.said}; say a length")
