"""Pick and place: grasp, lift, carry, lower, let go; the placement is planned again from what is measured in the hand."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.episodes.courses.course import Course, Ended
from manitwin.episodes.execution import Execution
from manitwin.episodes.outcome import moved_m, turned_rad
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Motion, PickPlacePlan
from manitwin.episodes.planning.withdrawal import plan_withdrawal
from manitwin.geometry.poses import inverse
from manitwin.physics.sapien.contacts import NONE_MEANT, MeantContacts

SMALL_SLIP_M, SMALL_SLIP_RAD = 0.004, np.radians(2.0)  # a fifth of what a placement may be off: no reason to give up


@dataclass(frozen=True)
class _Placement:
    """The motions that place an object which is in the hand as ``gripper_to_object`` says."""

    gripper_to_object: np.ndarray
    carry: Motion | None
    lower: Motion
    retreat: Motion


class PickPlaceCourse(Course):
    """Moves the target to the first of the goal's poses that can be planned."""

    def plan(self) -> bool:
        """Plan for the first goal pose that can be reached; the problem becomes that of this pose."""
        facts, start = self.facts, self.start
        poses = (self.goal_object_to_world,) if start.skill_goal is None else start.skill_goal.poses
        for pose in poses:
            raised = _raised(pose, start.settings.release_height_m)
            problem = replace(start.problem, goal_object_to_world=raised)
            report = start.planner.plan(problem)
            facts.grasps_tried += report.tried
            facts.plan_failures += report.failures
            if report.plan is not None:
                self.problem, self.goal_object_to_world = problem, pose
                facts.grasp = report.plan.grasp
                self._plan = report.plan
                return True
        return False

    def execute(self, execution: Execution) -> None:
        """Pick and place; raises Ended where the object is lost or cannot be placed."""
        plan = self._plan
        self.grasp_and_lift(execution, plan.reach, plan.approach, plan.lift)
        placement = _Placement(plan.gripper_to_object, plan.carry, plan.lower, plan.retreat)
        placement = self._placed_anew(plan, execution, with_carry=True) or placement
        self.facts.replans["after_lift" if placement.carry is not plan.carry else "after_lift_failed"] += 1
        if placement.carry is not None:
            execution.follow(placement.carry)
        self.check_held(execution)
        placement = self._placed_late(plan, execution, placement)
        if placement.carry is not None:
            execution.follow(placement.carry)
        execution.follow(placement.lower)
        self.check_held(execution)
        self.measure_slip(plan, execution)
        goal = self.start.skill_goal
        if goal is not None and goal.lets_fall:
            self._let_fall(placement.retreat, execution)
            return
        execution.open()
        execution.follow(placement.retreat)

    def _let_fall(self, retreat: Motion, execution: Execution) -> None:
        """Let go in the air and withdraw, and once more where the target has come to lean on the hand."""
        execution.meant = MeantContacts(palm=True)
        execution.open()
        execution.follow(retreat)
        planner = self.start.planner
        if isinstance(planner, PickPlacePlanner) and execution.touches_target:
            here = execution.target_to_world(), execution.commanded_rad
            away = plan_withdrawal(planner.parts, self.problem, *here, blind=False)
            self.facts.replans["withdrawn" if away is not None else "not_withdrawn"] += 1
            if away is not None:
                execution.follow(away)
        execution.meant = NONE_MEANT

    def _placed_anew(self, plan: PickPlacePlan, execution: Execution, *, with_carry: bool) -> _Placement | None:
        """Plan the placement from the pose in the hand."""
        measured = execution.gripper_to_object()
        found = self.start.planner.plan_place(
            self.problem, plan, execution.commanded_rad, measured, self.problem.goal_object_to_world, with_carry
        )
        return None if found is None else _Placement(measured, *found)

    def _placed_late(self, plan: PickPlacePlan, execution: Execution, before: _Placement) -> _Placement:
        """Plan the lowering anew, by another way where it does not work from here; what was planned ``before`` serves too
        where the object has moved little in the hand since. Raises Ended where nothing does."""
        self.measure_slip(plan, execution)
        for with_carry in (False, True):
            found = self._placed_anew(plan, execution, with_carry=with_carry)
            if found is not None:
                self.facts.replans["late_with_carry" if with_carry else "late"] += 1
                return found
        expected, measured = inverse(before.gripper_to_object), inverse(execution.gripper_to_object())
        center = self.problem.target.body.center_of_mass_m
        if moved_m(expected, measured, center) > SMALL_SLIP_M or turned_rad(expected, measured) > SMALL_SLIP_RAD:
            raise Ended("replan_failed")
        self.facts.replans["late_not_needed"] += 1
        return replace(before, carry=None)


def _raised(pose: np.ndarray, height_m: float) -> np.ndarray:
    raised = np.array(pose, float)
    raised[2, 3] += height_m
    return raised
