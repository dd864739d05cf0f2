"""Mass properties of a partly filled closed vessel: a thin wall, and contents with a level surface."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import trimesh

from manitwin.geometry.interior import columns_of, mass_properties_of
from manitwin.geometry.mass_properties import MassProperties, shell_mass_properties


class Vessel:
    """A closed vessel whose outer surface is the mesh, +Z up. Its wall has uniform thickness and negligible volume."""

    def __init__(self, outer: trimesh.Trimesh, wall_thickness_m: float):
        self._outer = outer
        self._wall_of_1_kg = shell_mass_properties(outer, 1.0, wall_thickness_m)

    def filled(self, wall_kg: float, contents_kg: float, share: float) -> MassProperties:
        """Return the mass properties with contents that fill the lower ``share`` in (0, 1] of the volume.

        Without contents, those of the wall alone. Wall and contents are combined by the parallel-axis theorem.
        """
        one = self._wall_of_1_kg
        wall = MassProperties(one.center_of_mass_m, wall_kg * one.inertia_kg_m2, one.volume_m3)
        if contents_kg <= 0:
            return wall
        contents = mass_properties_of(self._cells[0], contents_kg * self._held(share), wall.volume_m3)
        mass_kg = wall_kg + contents_kg
        center_m = (wall_kg * wall.center_of_mass_m + contents_kg * contents.center_of_mass_m) / mass_kg
        inertia = sum(
            each.inertia_kg_m2 + part_kg * _steiner(each.center_of_mass_m - center_m)
            for each, part_kg in ((wall, wall_kg), (contents, contents_kg))
        )
        return MassProperties(center_m, np.asarray(inertia), wall.volume_m3)

    def center_m(self, wall_kg: float, contents_kg: float, share: float) -> np.ndarray:
        """Return only the centre of mass ``(3,)`` of ``filled``."""
        wall = self._wall_of_1_kg.center_of_mass_m
        if contents_kg <= 0:
            return np.asarray(wall)
        contents = self._held(share) @ self._cells[0]
        return np.asarray((wall_kg * wall + contents_kg * contents) / (wall_kg + contents_kg))

    @cached_property
    def _cells(self) -> tuple[np.ndarray, np.ndarray]:
        """Centres ``(N, 3)`` m and volumes ``(N,)`` m3 of cells of the interior, lowest first."""
        centers_m, volumes_m3 = columns_of(self._outer)
        order = np.argsort(centers_m[:, 2], kind="stable")
        return centers_m[order], volumes_m3[order]

    def _held(self, share: float) -> np.ndarray:
        """Return the share of the contents in each cell ``(N,)``: the lowest cells are full, up to ``share`` of the volume."""
        volumes_m3 = self._cells[1]
        before = np.cumsum(volumes_m3) - volumes_m3
        kept = np.clip(share * volumes_m3.sum() - before, 0, volumes_m3)
        return np.asarray(kept / kept.sum())


def _steiner(arm_m: np.ndarray) -> np.ndarray:
    return np.asarray(arm_m @ arm_m * np.eye(3) - np.outer(arm_m, arm_m))
