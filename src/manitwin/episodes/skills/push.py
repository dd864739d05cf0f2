"""Skill ``push``: slide an object over the table to a marked place with the closed hand, in strokes, without lifting it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.pick_place_tasks import MIN_GAP_M, footprint_at
from manitwin.episodes.skills.skill import Skill, SkillGoal, Surroundings
from manitwin.episodes.skills.strokes import BEHIND_M, HEIGHT_SHARE, touches_near_edge
from manitwin.geometry.boxes import footprint, separation_m
from manitwin.geometry.poses import transform, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.scenes.layouts.pool import Pool, PoolTwin

MARK = "mark"
WAY_M = (0.08, 0.20)
PLACES_TRIED = 60
MOST_INWARD = -0.5  # cosine to the outward direction: the hand does not reach behind an object to pull it in
LEAST_HEIGHT_M, LEAST_WIDTH_M = 0.02, 0.03
# vertices within BASE_M of the table form the base; an object with a narrower base rolls
BASE_M, LEAST_BASE_M = 0.002, 0.025
TIPPING = 0.8  # largest ratio of height to width for which a pushed object slides instead of falling over


def base_width_m(points: np.ndarray) -> float:
    """Return the smallest width (m) of an object's base, given vertices ``(N, 3)``; a lying round object has a narrow base."""
    base = points[points[:, 2] < points[:, 2].min() + BASE_M, :2]
    angles = np.linspace(0, np.pi, 36, endpoint=False)
    return float(np.ptp(base @ np.array([np.cos(angles), np.sin(angles)]), axis=0).min())


def can_be_pushed(points: np.ndarray) -> bool:
    """Tell whether an object with vertices ``(N, 3)`` m is high enough for a fingertip, and neither falls over nor rolls."""
    *across_m, height_m = np.ptp(points, axis=0).tolist()
    broad = min(across_m) >= max(LEAST_WIDTH_M, HEIGHT_SHARE * TIPPING * height_m)
    return height_m >= LEAST_HEIGHT_M and broad and base_width_m(points) >= LEAST_BASE_M


class Push(Skill):
    """Push the target to a place in reach along a free path."""

    name, predicate, has_partner = "push", "pushed_to", False

    def suits(self, pool: Pool, target: PoolTwin, partner: PoolTwin | None) -> bool:
        """Accept an object that is high enough for a fingertip and broad enough neither to fall over nor to roll."""
        pose = self.begins_in(target)[0].object_to_plane
        return can_be_pushed(transform_points(pose, np.concatenate(pool.body(target.twin_id).body.hulls)))

    def goal(self, target: PlacedObject, partner: PlacedObject | None) -> Goal:
        """Return the goal that the target was pushed to the mark."""
        return Goal((Literal(self.predicate, target.name, MARK),))

    def poses(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> Iterator[np.ndarray]:
        """Yield free poses in reach, with a free straight path there for target and fingertips."""
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
            if not around.area.is_reachable(center + way, corners + way) or not around.area.widened().is_reachable(
                hand, corners
            ):
                continue
            if all(separation_m(swept, each) >= MIN_GAP_M for each in taken) and touches_near_edge(moved, way / way_m):
                yield transform(None, np.array([*way, 0.0])) @ moved.object_to_world

    def sample_goal(
        self, around: Surroundings, target: int, partner: int | None, rng: np.random.Generator
    ) -> SkillGoal | None:
        """Return the goal with its mark; None if no place is free, or if the target would roll or fall over as it lies."""
        moved = around.objects[target]
        points = transform_points(moved.object_to_world, np.concatenate(moved.body.hulls))
        pose = next(self.poses(around, target, partner, rng), None) if can_be_pushed(points) else None
        if pose is None:
            return None
        place_m = transform_points(pose, moved.body.center_of_mass_m[None])[0]
        goal = self.goal(moved, None)
        return SkillGoal(goal, (moved.object_to_world,), None, {}, places_m={MARK: place_m}, pushes=True)
