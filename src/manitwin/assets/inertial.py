"""Mass properties that an asset declares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Inertial:
    """Declared mass, centre of mass and inertia tensor ``inertia_kg_m2 (3, 3)`` about the centre of mass, in the asset's axes.

    ``computed``: centre and inertia are not written in the file, but computed by the format's engine from masses or densities
    of the shapes. ``engine_kg``: the mass that this engine uses, where it is larger than the declared mass; else None.
    """

    mass_kg: float | None = None
    center_of_mass_m: np.ndarray | None = None
    inertia_kg_m2: np.ndarray | None = None
    computed: bool = False
    engine_kg: float | None = None
