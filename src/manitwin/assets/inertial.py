"""The mass properties that an asset declares."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Inertial:
    """The declared mass properties: the centre of mass and ``inertia_kg_m2 (3, 3)`` about it, both along the asset's axes.

    ``computed``: centre and inertia are what the format's engine computes of masses or densities of shapes, and not written.
    ``engine_kg`` is what that engine weighs, where it weighs more than the file declares; None where it does not.
    """

    mass_kg: float | None = None
    center_of_mass_m: np.ndarray | None = None
    inertia_kg_m2: np.ndarray | None = None
    computed: bool = False
    engine_kg: float | None = None
