"""What a bottle, can or jar weighs empty, half full and full: its mesh is the same, its mass is not."""

from __future__ import annotations

import trimesh

from manitwin.geometry.mass_properties import MassProperties
from manitwin.geometry.vessel_filling import filled_mass_properties
from manitwin.models.annotators.priors import Prior
from manitwin.twin.fill_records import Filling, FillState
from manitwin.twin.record_values import Estimate

SHARES = (0.0, 0.5, 1.0)
HEAVIEST_EMPTY = 0.75
"""Of the mass said: with an empty vessel that heavy, what was said is hardly that of a full one, and nothing is known of it."""
KNOWN = ("measured", "user", "human:", "imported:")
"""Sources whose mass is that of one thing in one state, which they do not tell."""


def filling_of(
    solid: trimesh.Trimesh, mass: Estimate, full: MassProperties, prior: Prior | None, wall_thickness_m: float
) -> Filling | None:
    """Return the states of a vessel whose mass is that of a full one; None for what is none, or where that is not known.

    ``full`` are its mass properties as the twin has them. The empty one weighs what the prior's least bulk density makes of the
    volume (docs/priors.md: there the interval begins with the empty one), its wall is even. The contents of the half-full one
    fill the lower half of the volume, the object standing as in its frame.
    """
    if prior is None or not prior.vessel or prior.bulk_density_kg_m3 is None or mass.source.startswith(KNOWN):
        return None
    least_kg_m3 = prior.bulk_density_kg_m3.low
    empty_kg = max(least_kg_m3 * float(solid.volume), prior.mass_kg.low)
    if empty_kg > HEAVIEST_EMPTY * mass.value:
        return None
    states = []
    for share in SHARES:
        contents_kg = share * (mass.value - empty_kg)
        found = filled_mass_properties(solid, empty_kg, wall_thickness_m, contents_kg, share) if share < 1 else full
        states.append(
            FillState(
                share=share,
                mass_kg=empty_kg + contents_kg,
                center_of_mass_m=found.center_of_mass_m.tolist(),
                inertia_kg_m2=found.inertia_kg_m2.tolist(),
            )
        )
    return Filling(
        assumption=f"the twin is a full {prior.category}; an empty one has {least_kg_m3:g} kg/m3 of its volume in an even"
        " wall, and contents are level, standing as in the object frame",
        states=states,
    )
