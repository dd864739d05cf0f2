"""Mass distribution over parts of different materials, such as a hammer's steel head and wooden handle."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import trimesh

from manitwin.geometry.interior import columns_of, mass_properties_of
from manitwin.geometry.mass_properties import MassProperties, solid_mass_properties
from manitwin.geometry.parts.part_rules import membership
from manitwin.geometry.parts.shape import measure_shape
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_materials


def mass_by_parts(
    solid: trimesh.Trimesh, mass_kg: float, materials: Mapping[str, str], prior: Prior, seed: int
) -> MassProperties | None:
    """Return the mass properties of a solid of ``mass_kg`` whose parts have the given materials, by role.

    The parts are found by the part rule of the prior (``geometry/parts/part_rules.py``). The mass is distributed in proportion
    to volume times the materials' typical densities. None if the shape shows no such parts, or a part's material is not stated.
    """
    if prior.parts is None or len(set(materials.values())) < 2:
        return None
    center_m = solid_mass_properties(solid, mass_kg).center_of_mass_m
    shape = measure_shape(solid, center_m, prior.head_end, prior.stands, np.random.default_rng(seed))
    centers_m, volumes_m3 = columns_of(solid)
    found = membership(prior.parts, shape, centers_m) if len(centers_m) else None
    if found is None or any(found.roles[role] not in materials for role in np.unique(found.index)):
        return None
    known = load_materials()
    # roles that the solid does not have need no material
    density = np.array([known[materials[r]].density_kg_m3.typical if r in materials else 0.0 for r in found.roles])
    masses = volumes_m3 * density[found.index]
    return mass_properties_of(centers_m, masses * (mass_kg / masses.sum()), float(solid.volume))
