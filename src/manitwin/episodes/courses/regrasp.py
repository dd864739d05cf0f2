"""Regrasp course: if no grasp serves both start and goal, the target is put down at an intermediate pose and grasped again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import islice

import numpy as np

from manitwin.episodes.courses.course import EpisodeEnded, grasp_tiers
from manitwin.episodes.courses.pick_place import PickPlaceCourse, raised
from manitwin.episodes.execution import Execution
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, PickPlacePlan, PickPlaceProblem
from manitwin.physics.sapien.contacts import NONE_MEANT

WAYS, GOALS = 8, 3  # most intermediate poses, and most goal poses for each


class RegraspCourse(PickPlaceCourse):
    """Pick and place, directly or via an intermediate resting pose; replanned from where the target comes to rest there."""

    _way: tuple[PickPlacePlan, PickPlaceProblem] | None = None

    def plan(self) -> bool:
        """Plan directly; otherwise via an intermediate pose: the goal from there, then the way there."""
        return any(self.plan_with(grasps) or self._plan_via_intermediate_pose(grasps) for grasps in self.tiers())

    def _plan_via_intermediate_pose(self, grasps: Sequence[Grasp]) -> bool:
        """Plan the goal from an intermediate pose and the motion to that pose; return whether both were found."""
        start = self.start
        goal = start.skill_goal
        for way in islice(() if goal is None or goal.ways is None else goal.ways, WAYS):
            there = replace(start.problem, target=replace(start.problem.target, object_to_world=way))
            tiers = grasp_tiers(replace(start, problem=there))
            reached = self._goal_from(replace(there, grasps=sum(tiers, ())))
            if reached is None:
                continue
            goal_to_world = raised(way, start.settings.release_height_m)
            problem = replace(start.problem, goal_object_to_world=goal_to_world, grasps=tuple(grasps))
            report = start.planner.plan(problem)
            self.facts.grasps_tried += report.tried
            self.facts.plan_failures += report.failures
            if report.plan is not None:
                self._way = report.plan, problem
                self.goal_object_to_world, self.facts.grasp = reached, report.plan.grasp
                return True
        return False

    def execute(self, execution: Execution) -> None:
        """Pick and place, twice if via an intermediate pose; raises Ended if the target cannot be grasped again."""
        if self._way is not None:
            self._plan, self.problem = self._way
            super().execute(execution)
            self.facts.replans["put_down"] += 1
            self._plan_from_intermediate_pose(execution)
        super().execute(execution)

    def _goal_from(self, problem: PickPlaceProblem) -> np.ndarray | None:
        """Return the first goal pose that can be planned from an intermediate pose, or None."""
        goal, settings = self.start.skill_goal, self.start.settings
        for pose in islice(() if goal is None else goal.poses, GOALS):
            asked = replace(problem, goal_object_to_world=raised(pose, settings.release_height_m))
            if self.start.planner.plan(asked).plan is not None:
                return pose
        return None

    def _plan_from_intermediate_pose(self, execution: Execution) -> None:
        """Let the target settle, bring the arm home, and plan from there; raises Ended if planning fails."""
        settings, planner = self.start.settings, self.start.planner
        execution.wait_for_rest(round(settings.max_rest_s / settings.timestep_s))
        execution.meant = NONE_MEANT
        target = replace(self.problem.target, object_to_world=execution.target_to_world())
        self.start = replace(self.start, problem=replace(self.start.problem, target=target))
        assert isinstance(planner, PickPlacePlanner), "the way home is planned with the models of this planner"
        home = planner.with_opening_of(self.facts.grasp).plan_return_home(self.start.problem, execution.commanded_rad)
        if home is None:
            raise EpisodeEnded("replan_failed")
        execution.follow(home)
        if not super().plan():
            raise EpisodeEnded("replan_failed")
