"""Centre of mass and inertia stated by an imported asset: used if they are physically possible."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.errors import Rejected
from manitwin.geometry.mass_properties import MassProperties, shell_mass_properties, solid_mass_properties
from manitwin.twin.import_record import ImportRecord

ROUNDING = 1e-4
"""Relative to the largest moment; files often have six digits."""
OUTSIDE_SHARE = 1e-3
"""Fraction of the longest side: tolerated distance of a centre of mass outside the convex hull, for rounding."""
FACTOR = 3.0
"""Tolerated factor beyond the moments of a solid and of a thin-walled body, as in audit rule INE005."""


def annotated_mass(
    given: ImportRecord, solid: trimesh.Trimesh, mass_kg: float, scale: float, computed: MassProperties
) -> MassProperties | None:
    """Return ``computed`` mass properties with an asset's stated centre of mass and inertia; None if it states neither.

    ``scale`` is the factor by which the object has been scaled since: the centre of mass scales with it, the inertia with its
    square and with the mass. An inertia without a stated mass cannot be compared and is ignored. Raises Rejected
    (``implausible_mass``) for a centre of mass outside the convex hull, and for an impossible inertia.
    """
    center = None if given.center_of_mass_m is None else scale * np.array(given.center_of_mass_m)
    inertia = None
    if given.inertia_kg_m2 is not None and given.mass_kg is not None:
        inertia = scale**2 * mass_kg / given.mass_kg * np.array(given.inertia_kg_m2)
    if center is None and inertia is None:
        return None
    if center is not None:
        _check_center(center, solid, given.source)
    if inertia is not None:
        _check_inertia(inertia, given.source)
        inertia = (inertia + inertia.T) / 2
    return MassProperties(
        computed.center_of_mass_m if center is None else center,
        computed.inertia_kg_m2 if inertia is None else inertia,
        computed.volume_m3,
    )


def moments_apart(
    annotated: MassProperties, solid: trimesh.Trimesh, mass_kg: float, wall_thickness_m: float, source: str
) -> list[str]:
    """Return a finding if the stated moments are far from those of a solid and of a thin-walled body; otherwise an empty list."""
    bodies = (solid_mass_properties(solid, mass_kg), shell_mass_properties(solid, mass_kg, wall_thickness_m))
    band = np.array([np.linalg.eigvalsh(body.inertia_kg_m2) for body in bodies])
    moments = np.linalg.eigvalsh(annotated.inertia_kg_m2)
    if (moments >= band.min(0) / FACTOR).all() and (moments <= band.max(0) * FACTOR).all():
        return []
    typical, said = (", ".join(f"{moment:.2g}" for moment in each) for each in (band.mean(0), moments))
    return [f"principal moments {said} kg m2 ({source}) are not near {typical} kg m2 of this shape and mass"]


def _check_center(center: np.ndarray, solid: trimesh.Trimesh, source: str) -> None:
    hull = trimesh.convex.convex_hull(solid.vertices)
    beyond_m = float((hull.face_normals * (center - hull.triangles[:, 0])).sum(1).max())
    longest_m = float(np.ptp(solid.vertices, axis=0).max())
    if beyond_m > OUTSIDE_SHARE * longest_m:
        raise Rejected(
            "implausible_mass",
            f"the centre of mass of {source} lies {1000 * beyond_m:.3g} mm outside of the object, which is"
            f" impossible; give it in the object frame, or leave it out of import.json",
        )


def _check_inertia(inertia: np.ndarray, source: str) -> None:
    largest = float(np.abs(inertia).max())
    symmetric = bool(np.abs(inertia - inertia.T).max() <= ROUNDING * largest)
    moments = np.linalg.eigvalsh((inertia + inertia.T) / 2)
    if symmetric and moments[0] > 0 and moments[2] <= (moments[0] + moments[1]) * (1 + ROUNDING):
        return
    listed = ", ".join(f"{moment:.3g}" for moment in moments)
    raise Rejected(
        "implausible_mass",
        f"the inertia of {source} is physically impossible (principal moments {listed} kg m2): each must be"
        f" positive, and at most the sum of the other two; correct it, or leave it out of import.json",
    )
