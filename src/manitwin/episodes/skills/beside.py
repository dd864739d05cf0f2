"""``left_of``, ``right_of``, ``behind``, ``in_front_of``, ``near``: set an object down beside another one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.goals.spatial import SECTOR_RAD, SIDE_GAP_M, SIDES
from manitwin.episodes.pick_place_tasks import MIN_GAP_M, footprints_of_others, on_its_surface
from manitwin.episodes.skills.skill import Skill, Surroundings
from manitwin.geometry.boxes import separation_m
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.layouts.pool import Pool, PoolTwin

TRIED = 400
INSIDE_SHARE = 0.8  # of the sector and of the gap: what is set down is off by a few millimetres
NEAR_M = 0.10


@dataclass(frozen=True)
class Beside(Skill):
    """Set the target down on one side of its partner, or on any (``near``), on the same surface, turned at random."""

    name: str
    predicate: str
    has_partner: bool = True

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept any two."""
        return partner is not None

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield free poses in the sector, by their centres of mass: in the workspace, then beyond, as far as an arm may come."""
        assert partner is not None
        moved, other = around.objects[target], around.objects[partner]
        object_to_plane, corners = on_its_surface(moved, around.area.support.height_m)
        taken = footprints_of_others(around.objects, target)
        beside = taken[partner if partner < target else partner - 1]
        middle = transform_points(other.object_to_world, other.body.center_of_mass_m[None])[0, :2]
        center = transform_points(object_to_plane, moved.body.center_of_mass_m[None])[0, :2]
        reach_m = _reach_m(beside, middle) + _reach_m(corners, center) + SIDE_GAP_M[1]
        for area in [around.area] * TRIED + [around.area.wider()] * TRIED:
            angle, yaw = self._direction_rad(rng), rng.uniform(-np.pi, np.pi)
            turn = np.array([[np.cos(yaw), -np.sin(yaw)], [np.sin(yaw), np.cos(yaw)]])
            at = middle + rng.uniform(0.02, reach_m) * np.array([np.cos(angle), np.sin(angle)]) - turn @ center
            plane_to_world = transform(_about_z(yaw), np.array([*at, 0.0]))
            placed = corners @ turn.T + at
            gap_m = separation_m(placed, beside)
            if not MIN_GAP_M <= gap_m <= self._most_gap_m * INSIDE_SHARE or not area.reaches(at, placed):
                continue
            if all(separation_m(placed, each) >= MIN_GAP_M for each in taken):
                yield plane_to_world @ object_to_plane

    @property
    def _most_gap_m(self) -> float:
        return NEAR_M if self.name == "near" else SIDE_GAP_M[1]

    def _direction_rad(self, rng: np.random.Generator) -> float:
        if self.name == "near":
            return float(rng.uniform(-np.pi, np.pi))
        side = SIDES[self.name]
        return float(np.arctan2(side[1], side[0]) + INSIDE_SHARE * SECTOR_RAD * rng.uniform(-1, 1))


SIDE_SKILLS = tuple(Beside(name, predicate=name) for name in (*SIDES, "near"))


def _reach_m(corners: np.ndarray, middle: np.ndarray) -> float:
    return float(np.linalg.norm(corners - middle, axis=1).max())


def _about_z(angle_rad: float) -> np.ndarray:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])
