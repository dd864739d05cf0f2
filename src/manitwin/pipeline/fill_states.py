"""Fill states of bottles, cans and jars: mass properties when empty, half full and full."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.mass_properties import MassProperties
from manitwin.geometry.vessel_filling import Vessel
from manitwin.models.annotators.prior_records import Prior
from manitwin.twin.fill_records import Filling, FillState
from manitwin.twin.record_values import Estimate

SHARES = (0.0, 0.5, 1.0)
HEAVIEST_EMPTY = 0.75
"""Fraction of the stated mass: if an empty vessel would be heavier, the stated mass is hardly that of a full one."""
KNOWN = ("measured", "user", "human:", "imported:")
"""Sources of a mass that holds for one object in an unknown fill state."""
UNEVEN_WALL = 0.2
"""Share of the wall's mass that may be in its cap or in its base instead of being uniform: an assumption of the magnitude of
caps, necks and bottoms of bottles.
"""
WALL_FACTORS = (0.5, 2.0)
"""The wall's weight may differ by these factors from that given by the prior's least bulk density."""
LEVELS = 20  # fill levels at which the centre of mass is computed


def filling_of(
    solid: trimesh.Trimesh,
    mass: Estimate,
    full: MassProperties,
    full_uncertainty_m: float,
    prior: Prior | None,
    wall_thickness_m: float,
) -> Filling | None:
    """Return the fill states of a vessel whose mass is that of a full one; None for other objects, or if the state is unknown.

    ``full`` are the twin's mass properties, ``full_uncertainty_m`` the uncertainty of its centre of mass. That of the other
    states follows from a wall of another weight that is not uniform. The empty mass is the volume times the prior's least bulk
    density (docs/priors.md: the lower end of the interval is the empty vessel), in a uniform wall. The contents of the
    half-full vessel fill the lower half of the volume in the object frame.
    """
    if prior is None or not prior.vessel or prior.bulk_density_kg_m3 is None or mass.source.startswith(KNOWN):
        return None
    least_kg_m3 = prior.bulk_density_kg_m3.low
    empty_kg = max(least_kg_m3 * float(solid.volume), prior.mass_kg.low)
    if empty_kg > HEAVIEST_EMPTY * mass.value:
        return None
    contents_kg = mass.value - empty_kg
    vessel = Vessel(solid, wall_thickness_m)
    states = []
    for share in SHARES:
        found = vessel.filled(empty_kg, share * contents_kg, share) if share < 1 else full
        states.append(
            FillState(
                share=share,
                mass_kg=empty_kg + share * contents_kg,
                center_of_mass_m=found.center_of_mass_m.tolist(),
                center_of_mass_uncertainty_m=_uncertainty_m(vessel, solid, empty_kg, mass.value, share)
                if share < 1
                else full_uncertainty_m,
                inertia_kg_m2=found.inertia_kg_m2.tolist(),
            )
        )
    centers_m = [vessel.center_m(empty_kg, share * contents_kg, share) for share in np.arange(LEVELS) / LEVELS]
    return Filling(
        assumption=f"the twin is a full {prior.category}; an empty one has {least_kg_m3:g} kg/m3 of its volume in an even"
        " wall, and contents are level, standing as in the object frame",
        states=states,
        center_of_mass_shift_m=float(np.linalg.norm(np.array(centers_m) - full.center_of_mass_m, axis=1).max()),
    )


def _uncertainty_m(vessel: Vessel, solid: trimesh.Trimesh, empty_kg: float, full_kg: float, share: float) -> float:
    """Return the uncertainty (m) of the centre of mass due to a wall of another weight that is not uniform."""

    def center_m(wall_kg: float) -> np.ndarray:
        return vessel.center_m(wall_kg, share * (full_kg - wall_kg), share)

    middle_m, wall_m = center_m(empty_kg), vessel.center_m(empty_kg, 0.0, 0.0)
    others = [min(factor * empty_kg, HEAVIEST_EMPTY * full_kg) for factor in WALL_FACTORS]
    off_m = [float(np.linalg.norm(center_m(wall_kg) - middle_m)) for wall_kg in others]
    wall_share = empty_kg / (empty_kg + share * (full_kg - empty_kg))
    arm_m = float(np.abs(solid.bounds[:, 2] - wall_m[2]).max())
    return max(off_m) + UNEVEN_WALL * wall_share * arm_m
