"""Size from the volume stated in a name: 'juice 1 l', 'cola can 330 ml'."""

from __future__ import annotations

import trimesh
from scipy.optimize import brentq

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.generators.templates.capacity import CLOSED_WALLS_M
from manitwin.models.generators.templates.stated_amounts import amounts_in
from manitwin.models.generators.templates.stated_lengths import normalise_lengths

HEADSPACE = 1.05
"""Capacity to the brim relative to the sold volume: wine bottles 1.03, cartons 1.05, cans 1.07."""


def stated_volume_m3(name: str | None, prior: Prior | None) -> float | None:
    """Return the single volume stated in the name of a closed vessel; None for other objects, or if several are stated."""
    if name is None or prior is None or not prior.vessel:
        return None
    try:
        said = amounts_in(normalise_lengths(name), prior)
    except UsageError:  # a range of volumes, which a name may contain, counts as not stated
        return None
    volumes = {amount.volume_m3 for amount in said if amount.volume_m3 is not None}
    return volumes.pop() if len(volumes) == 1 else None


def factor_to_hold(solid: trimesh.Trimesh, volume_m3: float, prior: Prior) -> float | None:
    """Return the scale factor that makes a closed ``solid`` hold a volume; None if its wall is unknown.

    The capacity is the enclosed volume minus a wall of the usual material of such objects.
    """
    wall_m = CLOSED_WALLS_M.get(prior.surface)
    outside, area = float(solid.volume), float(solid.area)
    if wall_m is None or outside <= 0:
        return None
    wanted = HEADSPACE * volume_m3
    least = float((wanted / outside) ** (1 / 3))
    most = least + wall_m * area / outside  # there s^3 V - w s^2 A is at least s^2 V (s - w A / V) = s^2 V least
    return float(brentq(lambda s: outside * s**3 - wall_m * area * s**2 - wanted, least, most, xtol=1e-9 * least))
