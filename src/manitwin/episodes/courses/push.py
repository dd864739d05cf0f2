"""Pushing course: guarded strokes of the closed hand, each planned from where the object came to rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.interpolate import CubicSpline

from manitwin.episodes.courses.course import Course, EpisodeEnded, EpisodeStart
from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.events import EventWatch
from manitwin.episodes.execution import Execution
from manitwin.episodes.planning.closed_hand import fingertip_corners
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.held_path import HeldPathPlanner
from manitwin.episodes.planning.path_timing import joint_spline
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Motion, Phase
from manitwin.episodes.skills.push import MARK
from manitwin.episodes.skills.strokes import arc_to, strokes
from manitwin.episodes.tool_watches import PushWatch
from manitwin.geometry.poses import transform, transform_points
from manitwin.physics.sapien.contacts import NONE_MEANT, AllowedContacts
from manitwin.physics.sapien.world import RobotWorld

STROKES = 8
NEAR_M = 0.012  # distance to the place at which no further stroke is made
NEAR_ENOUGH_M = 0.018  # accepted distance if no further stroke can be planned
STOP_SHORT_M = 0.002
ASTRAY_M = 0.012  # lateral deviation at which a stroke ends, so that the next one corrects it
TOPPLING_RAD = np.radians(20)
SPEED_M_S, LONGEST_S = 0.06, 12.0
SETTLES_S, BACK_S = 0.25, 1.0


class PushCourse(Course):
    """Strokes until the object has arrived, or none can be planned."""

    def __init__(self, start: EpisodeStart, facts: EpisodeFacts):
        """Take the place that the goal marks."""
        super().__init__(start, facts)
        assert start.skill_goal is not None
        assert isinstance(start.planner, PickPlacePlanner), "strokes are planned with the models of this planner"
        self._place_m = start.skill_goal.places_m[MARK]
        self._planner = HeldPathPlanner(start.planner.closed_hand, empty=True)
        self._fingertips_m = fingertip_corners(start.planner.closed_hand)
        target = self.problem.target
        corners = transform_points(target.object_to_world, np.concatenate(target.body.hulls))
        self._level_m = float(corners[:, 2].min())

    @property
    def planned_end_pose(self) -> np.ndarray | None:
        """Planned final pose of the target: at the place, with its current orientation."""
        target = self.problem.target
        way = self._place_m - transform_points(target.object_to_world, target.body.center_of_mass_m[None])[0]
        return transform(translation=np.array([*way[:2], 0.0])) @ target.object_to_world

    def watches(self, world: RobotWorld) -> Sequence[EventWatch]:
        """Return the watch of the hand's contacts."""
        target = self.problem.target

        def center() -> np.ndarray:
            return transform_points(world.pose_of(target.name), target.body.center_of_mass_m[None])[0]

        return (PushWatch(target.name, frozenset(world.robot.links), center),)

    def plan(self) -> bool:
        """Plan the first stroke."""
        found = self._stroke(None)
        if found is None:
            return False
        self._first = found
        return True

    def execute(self, execution: Execution) -> None:
        """Push, measure, and push again; raises Ended if the object topples or no stroke can be planned."""
        execution.close_empty_hand()
        found: tuple[Motion, HeldPath, CubicSpline] | None = self._first
        for number in range(STROKES):
            if found is None:
                if self._off_m(execution) <= NEAR_ENOUGH_M:
                    return
                raise EpisodeEnded("replan_failed")
            self._push(execution, *found)
            execution.wait_s(Phase.HOLD, SETTLES_S)
            self.facts.replans["strokes"] = number + 1
            here = execution.target_to_world()
            self.problem = replace(self.problem, target=replace(self.problem.target, object_to_world=here))
            if self._off_m(execution) <= NEAR_M:
                return
            found = self._stroke(execution.commanded_rad)

    def _stroke(self, joints_rad: np.ndarray | None) -> tuple[Motion, HeldPath, CubicSpline] | None:
        paths = strokes(self.problem.target, self._place_m, self._fingertips_m, self._level_m)
        there = self.problem.target.object_to_world.copy()
        there[:2, 3] += (self._place_m - transform_points(there, self.problem.target.body.center_of_mass_m[None])[0])[
            :2
        ]
        found = self._planner.plan_empty(self.problem, paths, longest_s=LONGEST_S, start_rad=joints_rad, moved_to=there)
        if isinstance(found, tuple):
            return found
        self.facts.plan_failures.update(found)
        return None

    def _push(self, execution: Execution, reach: Motion, path: HeldPath, joints: CubicSpline) -> None:
        """Move behind the object, push until it has arrived or deviates, and go back."""
        execution.follow(reach)
        execution.meant = AllowedContacts(fingers=path.meant)
        upright = execution.target_to_world()[:3, :3]
        begun_m, way = self._center_m(execution), self._place_m[:2] - self._center_m(execution)[:2]
        length_m = float(np.linalg.norm(way))
        along = way / max(length_m, 1e-9)

        def ends() -> bool:
            offset = self._center_m(execution)[:2] - begun_m[:2]
            aside_m = abs(float(offset @ [-along[1], along[0]]))
            return float(offset @ along) >= length_m - STOP_SHORT_M or aside_m > ASTRAY_M

        tip = self.start.planner.tip_pose
        way_m = float(np.linalg.norm(tip(joints(1.0))[:3, 3] - tip(joints(0.0))[:3, 3]))
        motion = self._planner.time_path(joints, 1.9 * way_m / SPEED_M_S, Phase.ACT)
        execution.follow(motion, until=ends)
        leant = np.arccos(np.clip((upright.T @ execution.target_to_world()[:3, :3])[2, 2], -1, 1))
        if leant > TOPPLING_RAD:
            raise EpisodeEnded("toppled")
        self._back(execution, path, joints)
        execution.meant = NONE_MEANT

    def _back(self, execution: Execution, path: HeldPath, joints: CubicSpline) -> None:
        """Move back behind the object and up, replanned from here, or else along the way there."""
        here = replace(self.problem, target=replace(self.problem.target, object_to_world=execution.target_to_world()))
        now = self.start.planner.tip_pose(execution.commanded_rad)
        away = HeldPath(np.array(arc_to(now, _direction(path))[::-1]), path.meant)
        way = self._planner.plan_spline(here, away, np.eye(4), execution.commanded_rad, as_hulls=False)
        self.facts.replans["back" if way is not None else "back_as_it_came"] += 1
        if way is None:
            places = np.linspace(0, 1, 200)
            been = joints(places)
            last = int(np.linalg.norm(been - execution.commanded_rad, axis=1).argmin())
            way = joint_spline(np.array([execution.commanded_rad, *been[: max(last, 1)][::-20], been[0]]))
        execution.follow(self._planner.time_path(way, BACK_S, Phase.RETURN))

    def _center_m(self, execution: Execution) -> np.ndarray:
        center = self.problem.target.body.center_of_mass_m[None]
        return np.asarray(transform_points(execution.target_to_world(), center)[0])

    def _off_m(self, execution: Execution) -> float:
        return float(np.linalg.norm(self._center_m(execution)[:2] - self._place_m[:2]))


def _direction(path: HeldPath) -> np.ndarray:
    """Return the unit direction ``(2,)`` of a stroke."""
    way = path.poses[-1, :2, 3] - path.poses[-2, :2, 3]
    return np.asarray(way / max(float(np.linalg.norm(way)), 1e-9))
