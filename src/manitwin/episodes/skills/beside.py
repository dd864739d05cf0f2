"""Skills ``left_of``, ``right_of``, ``behind``, ``in_front_of``, ``near``: set an object down beside another one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from manitwin.episodes.goals.spatial import SECTOR_RAD, SIDE_GAP_M, SIDES
from manitwin.episodes.pick_place_tasks import MIN_GAP_M, footprints_of_others, on_its_surface
from manitwin.episodes.skills.skill import Skill, Surroundings
from manitwin.geometry.boxes import separations_m
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.layouts.pool import Pool, PoolTwin

YAWS, PLACES = 48, 128  # headings tried in each area, and places for each heading
INSIDE_SHARES = (0.8, 0.93)
"""Shares of the sector and of the gap, the smaller first, because placements are off by a few millimetres."""
NEAR_M = 0.10


@dataclass(frozen=True)
class Beside(Skill):
    """Set the target down on one side of its partner, or on any (``near``), on the same surface, with random heading."""

    name: str
    predicate: str
    has_partner: bool = True

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept any pair."""
        return partner is not None

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield free poses with the centre of mass in the sector: in the workspace, then beyond it as far as an arm may reach.

        The same is then repeated closer to the sector's border.
        """
        assert partner is not None
        moved, other = around.objects[target], around.objects[partner]
        object_to_plane, corners = on_its_surface(moved, around.area.support.height_m)
        taken = footprints_of_others(around.objects, target)
        beside = taken[partner if partner < target else partner - 1]
        middle = transform_points(other.object_to_world, other.body.center_of_mass_m[None])[0, :2]
        center = transform_points(object_to_plane, moved.body.center_of_mass_m[None])[0, :2]
        reach_m = _reach_m(beside, middle) + _reach_m(corners, center) + SIDE_GAP_M[1]
        for share in INSIDE_SHARES:
            for area in (around.area, around.area.extended()):
                for yaw in rng.uniform(-np.pi, np.pi, YAWS):
                    turn = _rotation_about_z(yaw)
                    turned = corners @ turn[:2, :2].T
                    places = middle + self._offsets_m(rng, share, reach_m) - turn[:2, :2] @ center
                    near = separations_m(turned, beside, places) <= share * self._most_gap_m
                    free = np.all([separations_m(turned, each, places) >= MIN_GAP_M for each in taken], axis=0)
                    at = next((at for at in places[near & free] if area.is_reachable(at, turned + at)), None)
                    if at is not None:  # one pose per heading: if it cannot be planned, another heading is tried
                        yield transform(turn, np.array([*at, 0.0])) @ object_to_plane

    @property
    def _most_gap_m(self) -> float:
        return NEAR_M if self.name == "near" else SIDE_GAP_M[1]

    def _offsets_m(self, rng: np.random.Generator, share: float, reach_m: float) -> np.ndarray:
        """Draw offsets ``(N, 2)`` m from the partner's centre of mass to the target's, in a share of the sector."""
        if self.name == "near":
            angles = rng.uniform(-np.pi, np.pi, PLACES)
        else:
            side = SIDES[self.name]
            angles = np.arctan2(side[1], side[0]) + share * SECTOR_RAD * rng.uniform(-1, 1, PLACES)
        return np.asarray(rng.uniform(0.02, reach_m, (PLACES, 1)) * np.column_stack([np.cos(angles), np.sin(angles)]))


SIDE_SKILLS = tuple(Beside(name, predicate=name) for name in (*SIDES, "near"))


def _reach_m(corners: np.ndarray, middle: np.ndarray) -> float:
    return float(np.linalg.norm(corners - middle, axis=1).max())


def _rotation_about_z(angle_rad: float) -> np.ndarray:
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.array([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1.0]])
