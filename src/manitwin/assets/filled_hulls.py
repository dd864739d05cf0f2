"""Mass properties of convex hulls of collision shapes, filled with given densities."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.spatial import QhullError

from manitwin.assets.asset import Inertial, combined_inertial
from manitwin.geometry.hulls.reduction import hull_mesh
from manitwin.geometry.mass_properties import solid_mass_properties


def filled_hulls(shapes: Iterable[tuple[np.ndarray, float]]) -> Inertial:
    """Return the inertial, marked ``computed``, of convex hulls of vertices ``(V, 3)`` m, each filled with a density in kg/m3.

    Flat shapes have no volume and are skipped; if all are flat, the inertial is empty.
    """
    bodies = []
    for vertices, density_kg_m3 in shapes:
        try:
            solid = solid_mass_properties(hull_mesh(np.asarray(vertices, float)), 1.0)
        except (QhullError, ValueError):
            continue
        mass_kg = density_kg_m3 * solid.volume_m3
        bodies.append(Inertial(mass_kg, solid.center_of_mass_m, mass_kg * solid.inertia_kg_m2))
    return replace(combined_inertial(bodies), computed=True) if bodies else Inertial()
