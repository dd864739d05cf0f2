"""Declared properties that an import drops, with a reason for each."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import trimesh
from scipy.spatial import QhullError

from manitwin.assets.asset import Asset, Inertial
from manitwin.assets.audit.measured import MeasuredAsset
from manitwin.assets.audit.rules import center_of_mass, inertia
from manitwin.pipeline.annotated_mass import OUTSIDE_SHARE

CENTER, INERTIA = "centre of mass", "inertia"

_LEAST_DENSITY_KG_M3 = 0.1  # of the convex hull: a tenth of the density of air
_CENTER_RULES = (center_of_mass.outside, center_of_mass.left_at_origin)
_INERTIA_RULES = (inertia.not_positive_definite, inertia.violates_triangle, inertia.placeholder, inertia.magnitude)


def impossible_mass_properties(asset: Asset) -> dict[str, str]:
    """Return why the declared centre of mass or inertia is impossible for the object, keyed by ``CENTER`` and ``INERTIA``.

    Applies the audit rules INE002 to INE005, COM002 and COM003, which find values that engines refuse or simulate wrongly.
    """
    measured = MeasuredAsset(asset)
    found = {}
    for what, rules, declared in (
        (CENTER, _CENTER_RULES, asset.inertial.center_of_mass_m),
        (INERTIA, _INERTIA_RULES, asset.inertial.inertia_kg_m2),
    ):
        said = [complaint.message for rule in rules for complaint in measured.complaints(rule)]
        if declared is not None and said:
            found[what] = said[0]
    return found


def inertia_without_mass(inertial: Inertial) -> dict[str, str]:
    """Return why an inertia is dropped if there is no positive mass, in the form of ``impossible_mass_properties``.

    PyBullet uses a mass of 0 kg for fixed bodies, whose inertia is then that of a template; without a mass, an inertia cannot
    be scaled.
    """
    mass_kg = inertial.mass_kg
    if inertial.inertia_kg_m2 is None or (mass_kg is not None and mass_kg > 0):
        return {}
    return {INERTIA: "there is no mass that it is of" if mass_kg is None else f"it is that of {mass_kg:g} kg"}


def center_outside_visual(center_m: np.ndarray, points_m: np.ndarray) -> str | None:
    """Return why a centre of mass ``(3,)`` is impossible for the visual points ``(N, 3)``, in metres; None if it is possible.

    COM002 tolerates the rounding of collision hulls, but a build refuses a centre outside the solid by more than
    ``OUTSIDE_SHARE`` of its largest extent.
    """
    try:
        hull = trimesh.convex.convex_hull(points_m)
    except QhullError:  # a flat sheet, which has no inside
        return None
    beyond_m = float((hull.face_normals * (center_m - hull.triangles[:, 0])).sum(1).max())
    if beyond_m <= OUTSIDE_SHARE * float(np.ptp(points_m, axis=0).max()):
        return None
    place = ", ".join(f"{1000 * value:.3g}" for value in center_m)
    return f"the centre of mass ({place}) mm lies {1000 * beyond_m:.3g} mm outside of what is seen of the object"


def without_placeholder_mass(asset: Asset) -> tuple[Asset, list[str]]:
    """Return the asset without a placeholder mass, and the reason; the asset unchanged if the mass may be real.

    Simulators refuse a mass of 0, so bodies without a known mass often declare a tiny one such as 1e-9 kg. Centre, inertia and
    the masses of links are dropped with it.
    """
    mass_kg, volume_m3 = asset.inertial.mass_kg, float(MeasuredAsset(asset).hull.volumes_m3.sum())
    if mass_kg is None or not 0 < mass_kg < _LEAST_DENSITY_KG_M3 * volume_m3:
        return asset, []
    moving = asset.articulation
    if moving is not None:
        moving = replace(moving, links=tuple(replace(link, inertial=Inertial()) for link in moving.links))
    why = f"mass, centre of mass and inertia: {mass_kg:.3g} kg in a hull of {1000 * volume_m3:.3g} l is a placeholder"
    return replace(asset, inertial=Inertial(), articulation=moving), [why]


def unused_content(asset: Asset) -> list[str]:
    """Return descriptions of further content of an asset that a build does not use."""
    words = []
    if asset.collision:
        count = len(asset.collision)
        words.append(f"{count} collision shape{'' if count == 1 else 's'}: a build makes and checks its own")
    if asset.format == "twin" and asset.joints:
        count = len(asset.joints)
        words.append(f"{count} joint{'' if count == 1 else 's'}: export the twin as URDF or MJCF, and import that")
    turns = sum(frame.kind == "orientation" for frame in asset.frames)
    if turns:
        words.append(f"{turns} orientation frame{'' if turns == 1 else 's'}: they are no place on the object")
    return words
