"""One pick-and-place episode: plan, execute in physics, re-plan from what is measured, judge (docs/trajectories.md)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from manitwin.episodes.execution import FRAME_S, Execution
from manitwin.episodes.goals.evaluation import Evaluation, evaluate
from manitwin.episodes.goals.world_state import ObjectState, WorldState
from manitwin.episodes.outcome import (
    PlacementErrors,
    is_at_rest,
    is_disturbed,
    moved_m,
    placement_errors,
    placement_outcome,
    turned_rad,
)
from manitwin.episodes.planning.problem import Grasp, Motion, PickPlacePlan, PickPlaceProblem, PlanFailure, PlanReport
from manitwin.episodes.recording import Recording
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.world import RobotWorld
from manitwin.physics.trial import TrialSettings
from manitwin.robots.robot import Robot

SMALL_SLIP_M, SMALL_SLIP_RAD = 0.004, np.radians(2.0)  # a fifth of what a placement may be off: no reason to give up
LEAST_LIFT_SHARE = 0.5  # of what the hand rose: less, and the object was left behind


class Planner(Protocol):
    """The protocol of an episode's planner (``planning.pick_place.PickPlacePlanner``)."""

    def plan(self, problem: PickPlaceProblem) -> PlanReport:
        """Plan all of it."""
        ...

    def plan_place(
        self, problem: PickPlaceProblem, plan: PickPlacePlan, joint_positions_rad: np.ndarray,
        gripper_to_object_measured: np.ndarray, goal: np.ndarray, with_carry: bool,
    ) -> tuple[Motion | None, Motion, Motion] | None:  # fmt: skip
        """Plan carry, lower and retreat again."""
        ...

    def tip_pose(self, q: np.ndarray) -> np.ndarray:
        """Return the pose ``(4, 4)`` of the grasp frame in the world."""
        ...


@dataclass
class EpisodeFacts:
    """The result of an episode: the part of an ``Attempt`` that the execution knows."""

    outcome: str = "no_plan"
    grasp: Grasp | None = None
    grasps_tried: int = 0
    plan_failures: Counter[PlanFailure] = field(default_factory=Counter)
    errors: PlacementErrors | None = None
    slip_m: float | None = None
    length_s: float | None = None
    unplanned: tuple[tuple[str, str], ...] = ()
    evaluation: Evaluation | None = None
    replans: Counter[str] = field(default_factory=Counter)


@dataclass(frozen=True)
class _Placement:
    """The motions that place an object which is in the hand as ``gripper_to_object`` says."""

    gripper_to_object: np.ndarray
    carry: Motion | None
    lower: Motion
    retreat: Motion


class _Ended(Exception):
    """The episode ends here, with its outcome."""


def run_episode(
    problem: PickPlaceProblem,
    planner: Planner,
    robot: Robot,
    settings: EpisodeSettings,
    skill_goal: SkillGoal | None = None,
) -> tuple[EpisodeFacts, Recording | None]:
    """Run one episode and return what became of it, and its recording where it was executed.

    The objects settle first, and the plan is made from where they came to rest. Without a ``skill_goal`` the target's pose is
    judged against that of the problem; with one the first of its poses that can be planned is taken, and its goal is judged.
    The same arguments give the same bytes.
    """
    return _Episode(problem, planner, robot, settings, skill_goal).run()


def world_of(problem: PickPlaceProblem, robot: Robot, settings: EpisodeSettings, closing_force_n: float) -> RobotWorld:
    """Put a problem into physics."""
    return RobotWorld(
        robot,
        problem.target,
        problem.obstacles,
        problem.static_boxes,
        problem.fixtures,
        closing_force_n=closing_force_n,
        timestep_s=settings.timestep_s,
        contact_offset_m=settings.contact_offset_m,
        solver_iterations=settings.solver_iterations,
        solver_iterations_held=settings.solver_iterations_held,
        max_contact_force_n=settings.max_contact_force_n,
        furniture_friction=settings.furniture_friction,
    )


class _Episode:
    def __init__(
        self,
        problem: PickPlaceProblem,
        planner: Planner,
        robot: Robot,
        settings: EpisodeSettings,
        skill_goal: SkillGoal | None,
    ):
        self.problem, self.planner, self.robot, self.settings = problem, planner, robot, settings
        self.skill_goal = skill_goal
        self.goal_object_to_world = problem.goal_object_to_world
        self.facts = EpisodeFacts()

    def run(self) -> tuple[EpisodeFacts, Recording | None]:
        recording, closing = None, self._closing()
        with world_of(self.problem, self.robot, self.settings, closing.force_n) as world:
            if not self._settle(world):
                self.facts.outcome = "unsettled"
            elif self._is_reached_already(world):
                self.facts.outcome = "reached_already"
            elif plan := self._plan(world):
                execution = Execution(world, self.robot, closing, self.planner.tip_pose)
                try:
                    self._execute(plan, execution)
                    self._judge(world, execution)
                except _Ended as end:
                    self.facts.outcome = str(end)
                self.facts.length_s = execution.length_s
                self.facts.unplanned = tuple(sorted(execution.unplanned))
                recording = execution.recording()
                del execution
        return self.facts, recording

    def _settle(self, world: RobotWorld) -> bool:
        """Let the objects come to rest and make the problem that of where they are; False where one does not stand."""
        settings = self.settings
        world.settle(settings.max_settle_s)
        rested = [
            replace(placed, object_to_world=world.object_to_world(number)) for number, placed in enumerate(world.placed)
        ]
        for before, after in zip(world.placed, rested, strict=True):
            moved = moved_m(before.object_to_world, after.object_to_world, before.body.center_of_mass_m)
            turned = turned_rad(before.object_to_world, after.object_to_world)
            if moved > settings.max_start_m or turned > np.radians(settings.max_start_deg):
                return False
        self.problem = replace(
            self.problem,
            target=rested[world.target],
            obstacles=tuple(placed for number, placed in enumerate(rested) if number != world.target),
        )
        self.rested = rested
        return True

    def _is_reached_already(self, world: RobotWorld) -> bool:
        """Tell whether a goal is true of the start."""
        if self.skill_goal is None:
            return False
        touching = frozenset(world.contacts.pressing(world.contacts.read()))
        return evaluate(
            self._state([each.object_to_world for each in self.rested], touching), self.skill_goal.goal
        ).reached

    def _plan(self, world: RobotWorld) -> PickPlacePlan | None:
        """Plan for the first goal pose that can be reached; the settled problem becomes that of this pose."""
        facts, height_m = self.facts, self.settings.release_height_m
        poses = (self.goal_object_to_world,) if self.skill_goal is None else self.skill_goal.poses
        for pose in poses:
            problem = replace(self.problem, goal_object_to_world=_raised(pose, height_m))
            report = self.planner.plan(problem)
            facts.grasps_tried += report.tried
            facts.plan_failures += report.failures
            if report.plan is not None:
                self.problem, self.goal_object_to_world = problem, pose
                facts.grasp = report.plan.grasp
                return report.plan
        return None

    def _state(
        self,
        object_to_world: Sequence[np.ndarray],
        touching: frozenset[frozenset[str]],
        at_rest: Sequence[bool] | None = None,
    ) -> WorldState:
        """Return what a goal is judged on, from the objects' poses ``(4, 4)`` in the order of the world."""
        assert self.skill_goal is not None
        rests = at_rest if at_rest is not None else [True] * len(self.rested)
        objects = {
            start.name: ObjectState(
                start.body, pose, start.object_to_world, still, self.skill_goal.openings.get(start.name)
            )
            for start, pose, still in zip(self.rested, object_to_world, rests, strict=True)
        }
        return WorldState(objects, touching, frozenset(box.name for box in self.problem.static_boxes))

    def _closing(self) -> TrialSettings:
        gripper, settings = self.robot.gripper, self.settings
        force_n = gripper.force_n if settings.closing_force_n is None else settings.closing_force_n
        return TrialSettings(
            force_n,
            gripper.finger_friction,
            timestep_s=settings.timestep_s,
            steps_per_frame=max(1, round(FRAME_S / settings.timestep_s)),
        )

    def _execute(self, plan: PickPlacePlan, execution: Execution) -> None:
        """Pick and place; raises _Ended where the object is lost or cannot be placed."""
        execution.follow(plan.reach)
        execution.follow(plan.approach)
        execution.close()
        closed_height_m = self._height_m(execution)
        hand_height_m = self.planner.tip_pose(execution.commanded_rad)[2, 3]
        execution.follow(plan.lift)
        rise_m = self.planner.tip_pose(execution.commanded_rad)[2, 3] - hand_height_m
        if self._height_m(execution) - closed_height_m < LEAST_LIFT_SHARE * rise_m:
            raise _Ended("not_lifted")
        placement = _Placement(plan.gripper_to_object, plan.carry, plan.lower, plan.retreat)
        placement = self._placed_anew(plan, execution, with_carry=True) or placement
        self.facts.replans["after_lift" if placement.carry is not plan.carry else "after_lift_failed"] += 1
        if placement.carry is not None:
            execution.follow(placement.carry)
        self._check_held(execution)
        placement = self._placed_late(plan, execution, placement)
        if placement.carry is not None:
            execution.follow(placement.carry)
        execution.follow(placement.lower)
        self._check_held(execution)
        self._measure_slip(plan, execution)
        execution.open()
        execution.follow(placement.retreat)

    def _placed_anew(self, plan: PickPlacePlan, execution: Execution, *, with_carry: bool) -> _Placement | None:
        """Plan the placement from the pose in the hand."""
        measured = execution.gripper_to_object()
        found = self.planner.plan_place(
            self.problem, plan, execution.commanded_rad, measured, self.problem.goal_object_to_world, with_carry
        )
        return None if found is None else _Placement(measured, *found)

    def _placed_late(self, plan: PickPlacePlan, execution: Execution, before: _Placement) -> _Placement:
        """Plan the lowering anew, by another way where it does not work from here; what was planned ``before`` serves too
        where the object has moved little in the hand since. Raises _Ended where nothing does."""
        self._measure_slip(plan, execution)
        for with_carry in (False, True):
            found = self._placed_anew(plan, execution, with_carry=with_carry)
            if found is not None:
                self.facts.replans["late_with_carry" if with_carry else "late"] += 1
                return found
        expected, measured = inverse(before.gripper_to_object), inverse(execution.gripper_to_object())
        center = self.problem.target.body.center_of_mass_m
        if moved_m(expected, measured, center) > SMALL_SLIP_M or turned_rad(expected, measured) > SMALL_SLIP_RAD:
            raise _Ended("replan_failed")
        self.facts.replans["late_not_needed"] += 1
        return replace(before, carry=None)

    def _height_m(self, execution: Execution) -> float:
        center = self.problem.target.body.center_of_mass_m[None]
        return float(transform_points(execution.target_to_world(), center)[0, 2])

    def _check_held(self, execution: Execution) -> None:
        if not min(execution.touches.finger_forces_n) > 0:
            raise _Ended("dropped")

    def _measure_slip(self, plan: PickPlacePlan, execution: Execution) -> None:
        planned, measured = inverse(plan.gripper_to_object), inverse(execution.gripper_to_object())
        self.facts.slip_m = moved_m(planned, measured, self.problem.target.body.center_of_mass_m)

    def _judge(self, world: RobotWorld, execution: Execution) -> None:
        settings, target = self.settings, self.problem.target
        last = execution.rest(round(settings.max_rest_s / settings.timestep_s))
        errors = placement_errors(execution.target_to_world(), self.goal_object_to_world, target.body.center_of_mass_m)
        self.facts.errors = errors
        at_rest = [
            is_at_rest([row[number] for row in last], placed.body.center_of_mass_m, settings)
            for number, placed in enumerate(world.placed)
        ]
        if self.skill_goal is None:
            released = max(execution.touches.finger_forces_n) == 0
            failure = placement_outcome(errors, at_rest=at_rest[world.target], released=released, settings=settings)
        else:
            state = self._state(last[-1], execution.pressing, at_rest)
            self.facts.evaluation = evaluate(state, self.skill_goal.goal)
            failure = None if self.facts.evaluation.reached else "goal_missed"
        if failure is None and any(
            self._is_disturbed(placed, last[-1][number])
            for number, placed in enumerate(self.rested)
            if number != world.target
        ):
            failure = "disturbed"
        if failure in (None, "disturbed") and execution.unplanned:
            failure = "unplanned_contact"
        self.facts.outcome = failure or "kept"

    def _is_disturbed(self, placed: PlacedObject, after: np.ndarray) -> bool:
        """Tell whether an object that was to stay moved; a partner that something is put on or into may move a little more."""
        settings, center = self.settings, placed.body.center_of_mass_m
        if self.skill_goal is not None and placed.name == self.skill_goal.partner:
            return moved_m(placed.object_to_world, after, center) > settings.max_partner_moved_m
        return is_disturbed(placed.object_to_world, after, center, settings)


def _raised(pose: np.ndarray, height_m: float) -> np.ndarray:
    raised = np.array(pose, float)
    raised[2, 3] += height_m
    return raised
