"""Pick-and-place course: grasp, lift, carry, lower, release; the placement is replanned from the measured pose in the hand."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from manitwin.episodes.courses.course import Course, EpisodeEnded
from manitwin.episodes.events import ContactWatch, EventWatch
from manitwin.episodes.execution import Execution
from manitwin.episodes.outcome import moved_m, turned_rad
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, Motion, Phase, PickPlacePlan
from manitwin.episodes.planning.withdrawal import plan_withdrawal
from manitwin.geometry.poses import inverse
from manitwin.physics.sapien.contacts import NONE_MEANT, AllowedContacts
from manitwin.physics.sapien.world import RobotWorld

# a fifth of the tolerance of a placement: a smaller slip is no reason to give up
SMALL_SLIP_M, SMALL_SLIP_RAD = 0.004, np.radians(2.0)

# wait of at most 0.6 s until the object lies still, and the motion per row that counts as still
LIES_ROWS, STILL_M, STILL_RAD = 12, 0.001, np.radians(1.0)
ARRIVED_N = 3.0  # contact force at which an object to be dropped into a vessel counts as arrived, and is released


@dataclass(frozen=True)
class _Placement:
    """Motions that place the object, for its pose in the hand ``gripper_to_object (4, 4)``."""

    gripper_to_object: np.ndarray
    carry: Motion | None
    lower: Motion
    retreat: Motion


class PickPlaceCourse(Course):
    """Moves the target to the first feasible goal pose."""

    _touch: ContactWatch | None = None

    def watches(self, world: RobotWorld) -> Sequence[EventWatch]:
        """Return a contact watch for a target that is to be released in the air."""
        goal, problem = self.start.skill_goal, self.problem
        if goal is None or not goal.lets_fall:
            return ()
        others = {each.name for each in problem.obstacles}
        others |= {each.name for each in (*problem.static_boxes, *problem.fixtures)}
        self._touch = ContactWatch(problem.target.name, frozenset(others))
        return (self._touch,)

    def plan(self) -> bool:
        """Plan for the first reachable goal pose; the problem becomes that of this pose."""
        return any(self.plan_with(grasps) for grasps in self.tiers())

    def plan_with(self, grasps: Sequence[Grasp]) -> bool:
        """Plan with a subset of the grasps."""
        facts, start = self.facts, self.start
        poses = (self.goal_object_to_world,) if start.skill_goal is None else start.skill_goal.poses
        for pose in poses:
            above = raised(pose, start.settings.release_height_m)
            problem = replace(start.problem, goal_object_to_world=above, grasps=tuple(grasps))
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
        """Pick and place; raises Ended if the object is lost or cannot be placed."""
        plan = self._plan
        self.grasp_and_lift(execution, plan.reach, plan.approach, plan.lift)
        placement = _Placement(plan.gripper_to_object, plan.carry, plan.lower, plan.retreat)
        anew = self._replan_placement(plan, execution, with_carry=True)
        self.facts.replans["after_lift" if anew is not None else "after_lift_failed"] += 1
        if anew is None:
            self.put_back_if_turned(plan, execution)
        placement = anew or placement
        if placement.carry is not None:
            execution.follow(placement.carry)
        self.check_held(execution)
        placement = self._replan_lowering(plan, execution, placement)
        if placement.carry is not None:
            execution.follow(placement.carry)
        arrived = self._lower(placement.lower, execution)
        self.check_held(execution)
        self.measure_slip(plan, execution)
        if self._touch is not None:
            self._let_fall(placement.retreat if arrived else None, execution)
            return
        execution.open_hand()
        execution.follow(placement.retreat)

    def _lower(self, lower: Motion, execution: Execution) -> bool:
        """Lower the target, for a drop until it touches something; return whether the motion was completed."""
        touch = self._touch
        if touch is None:
            return execution.follow(lower)
        touch.asked = True
        arrived = execution.follow(lower, until=lambda: touch.force_n > ARRIVED_N)
        touch.asked = False
        return arrived

    def _let_fall(self, retreat: Motion | None, execution: Execution) -> None:
        """Release the target, wait until it lies still so that the moving hand does not drag it along, and withdraw.

        ``retreat`` None: lowering ended early, so the planned retreat does not apply. The hand withdraws a second time if the
        object leans on it.
        """
        execution.meant = AllowedContacts(palm=True)
        execution.open_hand()
        self._wait_until_it_lies(execution)
        if retreat is not None:
            execution.follow(retreat)
        if retreat is None or execution.touches_target:
            self._withdraw(execution, blind=retreat is None)
        execution.meant = NONE_MEANT

    def _wait_until_it_lies(self, execution: Execution) -> None:
        last = execution.target_to_world()
        for _ in range(LIES_ROWS):
            execution.wait(Phase.OPEN, 1)
            now = execution.target_to_world()
            if (
                turned_rad(last, now) < STILL_RAD
                and moved_m(last, now, self.problem.target.body.center_of_mass_m) < STILL_M
            ):
                return
            last = now

    def _withdraw(self, execution: Execution, *, blind: bool) -> None:
        planner = self.start.planner
        if isinstance(planner, PickPlacePlanner):
            here = execution.target_to_world(), execution.commanded_rad
            away = plan_withdrawal(planner.with_opening_of(self.facts.grasp).parts, self.problem, *here, blind=blind)
            self.facts.replans["withdrawn" if away is not None else "not_withdrawn"] += 1
            if away is not None:
                execution.follow(away)

    def _replan_placement(
        self, plan: PickPlacePlan, execution: Execution, *, with_carry: bool, at: np.ndarray | None = None
    ) -> _Placement | None:
        """Replan the placement with the measured pose in the hand; ``at`` replaces the planned goal pose of the target."""
        measured = execution.gripper_to_object()
        goal = self.problem.goal_object_to_world if at is None else raised(at, self.start.settings.release_height_m)
        found = self.start.planner.plan_place(self.problem, plan, execution.commanded_rad, measured, goal, with_carry)
        return None if found is None else _Placement(measured, *found)

    def _replan_lowering(self, plan: PickPlacePlan, execution: Execution, before: _Placement) -> _Placement:
        """Replan the lowering from here, then with another carry, then to another pose that reaches the goal.

        The plan ``before`` is kept if the object has moved little in the hand since. Raises Ended if nothing is feasible.
        """
        self.measure_slip(plan, execution)
        for with_carry in (False, True):
            found = self._replan_placement(plan, execution, with_carry=with_carry)
            if found is not None:
                self.facts.replans["late_with_carry" if with_carry else "late"] += 1
                return found
        expected, measured = inverse(before.gripper_to_object), inverse(execution.gripper_to_object())
        center = self.problem.target.body.center_of_mass_m
        if moved_m(expected, measured, center) <= SMALL_SLIP_M and turned_rad(expected, measured) <= SMALL_SLIP_RAD:
            self.facts.replans["late_not_needed"] += 1
            return replace(before, carry=None)
        for pose in () if self.start.skill_goal is None else self.start.skill_goal.poses:
            found = self._replan_placement(plan, execution, with_carry=True, at=pose)
            if found is not None:
                self.facts.replans["late_elsewhere"] += 1
                self.goal_object_to_world = pose
                return found
        raise EpisodeEnded("replan_failed")


def raised(pose: np.ndarray, height_m: float) -> np.ndarray:
    """Return a pose ``(4, 4)`` translated upwards by ``height_m``."""
    result = np.array(pose, float)
    result[2, 3] += height_m
    return result
