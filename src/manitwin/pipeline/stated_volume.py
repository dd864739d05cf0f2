"""How large a thing of unknown size is by what its name says that it holds: 'juice 1 l', 'cola can 330 ml'."""

from __future__ import annotations

import trimesh
from scipy.optimize import brentq

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.generators.templates.capacity import CLOSED_WALLS_M
from manitwin.models.generators.templates.stated_amounts import amounts_in
from manitwin.models.generators.templates.stated_lengths import in_figures

HEADSPACE = 1.05
"""Of the volume that is sold, what a package holds to the brim: bottles of wine 1.03, cartons 1.05, cans 1.07."""


def stated_volume_m3(name: str | None, prior: Prior | None) -> float | None:
    """Return the one volume that the name of a closed vessel states; None of other things, or where it states several."""
    if name is None or prior is None or not prior.vessel:
        return None
    try:
        said = amounts_in(in_figures(name), prior)
    except UsageError:  # from which to which volume: a name may say that, and states none then
        return None
    volumes = {amount.volume_m3 for amount in said if amount.volume_m3 is not None}
    return volumes.pop() if len(volumes) == 1 else None


def factor_to_hold(solid: trimesh.Trimesh, volume_m3: float, prior: Prior) -> float | None:
    """Return the factor that makes a closed ``solid`` of any size a package of a volume; None where its wall is not known.

    What it holds is what is within its outside, less a wall of the material that is usual of such things.
    """
    wall_m = CLOSED_WALLS_M.get(prior.surface)
    outside, area = float(solid.volume), float(solid.area)
    if wall_m is None or outside <= 0:
        return None
    wanted = HEADSPACE * volume_m3
    least = float((wanted / outside) ** (1 / 3))
    most = least + wall_m * area / outside  # there s^3 V - w s^2 A is at least s^2 V (s - w A / V) = s^2 V least
    return float(brentq(lambda s: outside * s**3 - wall_m * area * s**2 - wanted, least, most, xtol=1e-9 * least))
