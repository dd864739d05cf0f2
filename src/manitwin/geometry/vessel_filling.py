"""Mass properties of a closed vessel that is filled to a share: a thin wall, and contents with a level top."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.geometry.interior import columns_of, mass_properties_of
from manitwin.geometry.mass_properties import MassProperties, shell_mass_properties


def filled_mass_properties(
    outer: trimesh.Trimesh, wall_kg: float, wall_thickness_m: float, contents_kg: float, share: float
) -> MassProperties:
    """Return the mass properties of a wall of ``wall_kg`` whose outer surface is the mesh, with contents up to a level.

    ``contents_kg`` fill the lower ``share`` in (0, 1] of the mesh's volume, +Z up; the wall takes none of it: it is thin. Without
    contents it is the wall alone. The centre of mass is that of both, the inertia by the parallel-axis theorem.
    """
    wall = shell_mass_properties(outer, wall_kg, wall_thickness_m)
    if contents_kg <= 0:
        return wall
    centers_m, volumes_m3 = columns_of(outer)
    contents = mass_properties_of(centers_m, contents_kg * _below(centers_m[:, 2], volumes_m3, share), wall.volume_m3)
    mass_kg = wall_kg + contents_kg
    center_m = (wall_kg * wall.center_of_mass_m + contents_kg * contents.center_of_mass_m) / mass_kg
    inertia = sum(
        each.inertia_kg_m2 + part_kg * _steiner(each.center_of_mass_m - center_m)
        for each, part_kg in ((wall, wall_kg), (contents, contents_kg))
    )
    return MassProperties(center_m, np.asarray(inertia), wall.volume_m3)


def _below(heights_m: np.ndarray, volumes_m3: np.ndarray, share: float) -> np.ndarray:
    """Return of cells ``(N,)`` how much of the contents each has: the lowest are full, up to ``share`` of the whole volume."""
    order = np.argsort(heights_m, kind="stable")
    before = np.cumsum(volumes_m3[order]) - volumes_m3[order]
    kept = np.zeros(len(heights_m))
    kept[order] = np.clip(share * volumes_m3.sum() - before, 0, volumes_m3[order])
    return np.asarray(kept / kept.sum())


def _steiner(arm_m: np.ndarray) -> np.ndarray:
    return np.asarray(arm_m @ arm_m * np.eye(3) - np.outer(arm_m, arm_m))
