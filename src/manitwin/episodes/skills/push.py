"""``push``: slide an object over the table to a marked place with the closed hand, stroke by stroke, never lifting it."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.pick_place_tasks import MIN_GAP_M, footprint_at
from manitwin.episodes.planning.collision_world import STANDING
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.skills.skill import Skill, SkillGoal, Surroundings
from manitwin.geometry.boxes import footprint, separation_m
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin

MARK = "mark"
WAY_M = (0.08, 0.20)
PLACES_TRIED = 60
MOST_INWARD = -0.5  # cosine to the way from the robot: no hand comes from behind to push things up to its own foot
LEAST_HEIGHT_M, LEAST_WIDTH_M = 0.02, 0.03
BASE_M, LEAST_BASE_M = 0.002, 0.025  # what is no higher over the table bears the object; narrower, and it rolls
TIPPING = 0.8  # of its width: how high what is pushed may be, that it slides and does not fall
HEIGHT_SHARE, HEIGHTS_M = 0.35, (0.012, 0.04)  # of the object's height: where it is pushed
LEANS_RAD = np.radians([30.0, 15, 45, 0])  # the palm is behind the fingertips, not over the object
ROLLS_RAD = np.radians([0.0, 180, 90, -90, 45, -45, 135, -135])  # the broad side of the fingertips first
BEHIND_M, BEYOND_M, KNOT_M = 0.025, 0.015, 0.025
DOWN = np.array([1.0, 0.7, 0.4, 0.2])  # of an arc that ends level: a corner would make the joints' spline dip
DOWN_M, DOWN_BACK_M = 0.10, 0.06
BAND_M = 0.012  # to either side of the line: half of what the closed fingertips are wide


def base_width_m(points: np.ndarray) -> float:
    """Return the least width of what an object stands on, of its corners ``(N, 3)``: of what is round only a strip."""
    base = points[points[:, 2] < points[:, 2].min() + BASE_M, :2]
    angles = np.linspace(0, np.pi, 36, endpoint=False)
    return float(np.ptp(base @ np.array([np.cos(angles), np.sin(angles)]), axis=0).min())


def can_be_pushed(points: np.ndarray) -> bool:
    """Tell whether a fingertip finds an object of corners ``(N, 3)``, and whether that neither falls over nor rolls."""
    *across_m, height_m = np.ptp(points, axis=0).tolist()
    broad = min(across_m) >= max(LEAST_WIDTH_M, HEIGHT_SHARE * TIPPING * height_m)
    return height_m >= LEAST_HEIGHT_M and broad and base_width_m(points) >= LEAST_BASE_M


class Push(Skill):
    """Push the target to a place in reach, along a way that is free."""

    name, predicate, has_partner = "push", "pushed_to", False

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept what is high enough for a fingertip, and stands broadly enough neither to fall over nor to roll."""
        pose = self.begins_in(target)[0].object_to_plane
        return can_be_pushed(transform_points(pose, np.concatenate(pool.body(target.twin_id).body.hulls)))

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return: pushed to the mark."""
        return Goal((Literal(self.predicate, target.name, MARK),))

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield free poses in reach that the target may be slid to, the way there free too."""
        moved = around.objects[target]
        corners = footprint_at(moved.body, moved.object_to_world)
        taken = [footprint_at(o.body, o.object_to_world) for i, o in enumerate(around.objects) if i != target]
        for _ in range(PLACES_TRIED):
            angle, way_m = rng.uniform(-np.pi, np.pi), rng.uniform(*WAY_M)
            way = way_m * np.array([np.cos(angle), np.sin(angle)])
            center = transform_points(moved.object_to_world, moved.body.center_of_mass_m[None])[0, :2]
            swept = np.concatenate([corners, corners + way])
            swept = footprint(np.column_stack([swept, np.zeros(len(swept))]))
            if float(way @ center) < MOST_INWARD * way_m * float(np.linalg.norm(center)):
                continue
            hand = center - (np.linalg.norm(corners - center, axis=1).max() + BEHIND_M) * way / way_m
            if not around.area.reaches(center + way, corners + way) or not around.area.wider().reaches(hand, corners):
                continue
            if all(separation_m(swept, each) >= MIN_GAP_M for each in taken):
                yield transform(None, np.array([*way, 0.0])) @ moved.object_to_world

    def set_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal with its mark; None where nothing is free, or the target lies so that it would roll or fall over."""
        moved = around.objects[target]
        points = transform_points(moved.object_to_world, np.concatenate(moved.body.hulls))
        pose = next(self.poses(around, target, partner, rng), None) if can_be_pushed(points) else None
        if pose is None:
            return None
        place_m = transform_points(pose, moved.body.center_of_mass_m[None])[0]
        goal = self.goal(moved, None)
        return SkillGoal(goal, (moved.object_to_world,), None, {}, places_m={MARK: place_m}, pushes=True)


def strokes(moved: PlacedObject, place_m: np.ndarray, fingertips_m: np.ndarray, level_m: float) -> tuple[HeldPath, ...]:
    """Return ways of the closed hand from behind an object through its centre of mass towards a place, by how it leans.

    Down behind the object, then along the line a little beyond what brings the centre of mass ``(3,)`` to the place: whoever
    follows it stops there. ``fingertips_m (N, 3)`` are the corners of the closed fingers in the grasp frame.
    """
    center = transform_points(moved.object_to_world, moved.body.center_of_mass_m[None])[0]
    way = place_m[:2] - center[:2]
    along = way / max(float(np.linalg.norm(way)), 1e-9)
    points = transform_points(moved.object_to_world, np.concatenate(moved.body.hulls))
    height_m = float(np.clip(HEIGHT_SHARE * (points[:, 2].max() - level_m), *HEIGHTS_M))
    behind_m = _behind(points, center, along, level_m + 2 * height_m)
    first_m, last_m = -behind_m - BEHIND_M, float(np.linalg.norm(way)) - behind_m + BEYOND_M
    knots = np.linspace(first_m, last_m, max(4, int(np.ceil((last_m - first_m) / KNOT_M)) + 1))
    paths = []
    for roll in ROLLS_RAD:
        for lean in LEANS_RAD:
            turn = _hand(along, lean, roll)
            tips = fingertips_m @ turn.T
            front = np.array([*along, 0.0]) * float((tips[:, :2] @ along).max())
            across = tips.mean(0)
            across[:2] -= (across[:2] @ along) * along
            origin = np.array([*center[:2], level_m + height_m - tips[:, 2].min()]) - front
            origin[:2] -= across[:2]
            line = [transform(turn, origin + np.array([*(along * each), 0.0])) for each in knots]
            arc = arc_to(line[0], along)
            meant = frozenset({STANDING, moved.name})
            paths.append(HeldPath(np.array([*arc, *line]), meant, meant_from=len(arc) + 1))
    return tuple(paths)


def arc_to(low: np.ndarray, along: np.ndarray) -> list[np.ndarray]:
    """Return poses that come down to a low one of the hand from behind, level at the end."""
    return [transform(None, np.array([*(-along * DOWN_BACK_M * each), DOWN_M * each**2])) @ low for each in DOWN]


def _behind(points_m: np.ndarray, center_m: np.ndarray, along: np.ndarray, below_m: float) -> float:
    """Return how far an object reaches behind its centre of mass at the fingertips, in the band that these are wide."""
    flat = footprint(points_m[points_m[:, 2] <= below_m] if (points_m[:, 2] <= below_m).sum() > 3 else points_m)
    corners = (flat - center_m[:2]) @ np.column_stack([along, [-along[1], along[0]]])
    sides = np.concatenate([np.linspace(a, b, 20) for a, b in pairwise([*corners, corners[0]])])
    in_band = np.abs(sides[:, 1]) <= BAND_M
    return float(-(sides[in_band] if in_band.any() else sides)[:, 0].min())


def _hand(along: np.ndarray, lean_rad: float, roll_rad: float) -> np.ndarray:
    """Return the hand's rotation ``(3, 3)``: pointing down and forward, closing across the way and turned from there."""
    forward, down = np.array([*along, 0.0]), np.array([0.0, 0.0, -1.0])
    z = np.cos(lean_rad) * down + np.sin(lean_rad) * forward
    across = np.array([-along[1], along[0], 0.0])
    x = np.cos(roll_rad) * across + np.sin(roll_rad) * np.cross(z, across)
    return np.column_stack([x, np.cross(z, x), z])
