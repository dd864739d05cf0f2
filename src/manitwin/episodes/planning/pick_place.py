"""Pick-and-place planner: tries each grasp in turn, planning backwards from the grasp, then on to the placement."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.grasp_tally import GraspTally
from manitwin.episodes.planning.narrowed_jaws import group_by_opening
from manitwin.episodes.planning.placement import Placement, PlacementPlanner, goals_after_slip, goes_level
from manitwin.episodes.planning.problem import (
    Grasp,
    GraspingPlan,
    Motion,
    Phase,
    PickPlacePlan,
    PickPlaceProblem,
    PlanFailure,
    PlannerSettings,
    PlanReport,
    later_failure,
)
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.robot import Robot

HAND_IN_THE_WAY = frozenset[PlanFailure](("approach_blocked", "lift_blocked", "lower_blocked", "retreat_blocked"))


class PickPlacePlanner:
    """Plans pick-and-place for one robot; deterministic for a problem's seed, with effort limited by counts instead of time."""

    def __init__(
        self,
        robot: Robot,
        timestep_s: float = 1 / 120,
        settings: PlannerSettings | None = None,
        standing: tuple[PlacedObject, ...] = (),
        opening_m: float | None = None,
    ):
        """Build the models of arm and hand; ``standing`` are obstacles of every problem, such as another, stationary arm.

        ``opening_m`` is the opening of empty jaws; None: fully open.
        """
        self.parts = parts = ArmPlanning(robot, timestep_s, settings, opening_m, standing)
        self._standing, self._opening_m = standing, opening_m
        self._narrowed = dict[float, PickPlacePlanner]()
        self.robot, self.settings, self.arm = robot, parts.settings, parts.arm
        self._ends, self._candidates, self._solutions = parts.ends, parts.candidates, parts.solutions
        self._motions, self._world_of = parts.motions, parts.problem_world
        self._placements = PlacementPlanner(self.arm, self._solutions, self._motions, self._ends)

    @cached_property
    def closed_hand(self) -> ArmPlanning:
        """Planning models of the same arm with a closed hand, for pressing and pushing."""
        return ArmPlanning(self.robot, self.parts.timestep_s, self.settings, opening_m=0.0, standing=self._standing)

    def tip_pose(self, joint_positions_rad: np.ndarray) -> np.ndarray:
        """Return the grasp frame in the world ``(4, 4)`` (+Z approach, X closing)."""
        return self.arm.gripper_pose(np.asarray(joint_positions_rad, float))

    def with_opening_of(self, grasp: Grasp | None) -> PickPlacePlanner:
        """Return the planner whose jaws have the opening of a grasp."""
        opening_m = None if grasp is None else grasp.opening_m
        if opening_m == self._opening_m or opening_m is None:
            return self
        if opening_m not in self._narrowed:
            self._narrowed[opening_m] = PickPlacePlanner(
                self.robot, self.parts.timestep_s, self.settings, self._standing, opening_m
            )
        return self._narrowed[opening_m]

    def plan(self, problem: PickPlaceProblem) -> PlanReport:
        """Plan with the first feasible grasp, as given or rotated about the approach axis (``grasp_candidates.turns_of``).

        At most ``settings.max_grasps`` are tried beyond the check of the hand alone. The failure of a grasp is the latest
        stage that it reached. If no grasp is feasible and the hand collided for some, jaws are opened only as far as each
        grasp needs (``narrowed_jaws``). If the target should be carried level, level plans for all grasps are tried first.
        """
        report = self._plan_as_open(problem)
        if report.plan is None and report.failures.keys() & HAND_IN_THE_WAY:
            for grasps in group_by_opening(problem.grasps, self.robot.gripper):
                found = self.with_opening_of(grasps[0])._plan_as_open(replace(problem, grasps=grasps))
                if found.plan is not None:
                    return replace(report, plan=found.plan)
        return report

    def _plan_as_open(self, problem: PickPlaceProblem) -> PlanReport:
        if goes_level(problem, problem.goal_object_to_world):
            report = self._plan_grasps(problem, level_only=True)
            if report.plan is not None:
                return report
        return self._plan_grasps(problem, level_only=False)

    def _plan_grasps(self, problem: PickPlaceProblem, *, level_only: bool) -> PlanReport:
        world, rng = self._world_of(problem, problem.goal_object_to_world), np.random.default_rng(problem.seed)
        tally = GraspTally()
        for candidate in self._candidates.check_grasps(world):
            grasp, failure = problem.grasps[candidate.index], candidate.failure
            if failure is None:
                if tally.is_new(candidate.index) and len(tally.beyond_a_look) == self.settings.max_grasps:
                    return PlanReport(None, tally.count_tried, tally.reasons)
                tally.beyond_a_look.add(candidate.index)
                outcome = self._plan_grasp(world, grasp, candidate.gripper_to_object, rng, level_only)
                if isinstance(outcome, PickPlacePlan):
                    tally.record_success(candidate.index)
                    return PlanReport(outcome, tally.count_tried, tally.reasons)
                failure = outcome
            tally.record_failure(candidate.index, failure)
        return PlanReport(None, tally.count_tried, tally.reasons)

    def plan_place(
        self,
        problem: PickPlaceProblem,
        plan: GraspingPlan,
        joint_positions_rad: np.ndarray,
        gripper_to_object: np.ndarray,
        goal_object_to_world: np.ndarray,
        with_carry: bool,
    ) -> Placement | None:
        """Replan the placement from the current joints, for the measured pose in the hand ``(4, 4)``.

        With ``with_carry`` the arm is above the start, and (carry, lower, retreat) are returned. Otherwise it is above the
        goal and lowers from there on a straight line: (None, lower, retreat). If the hand has no room to correct the object's
        rotation since ``plan`` grasped it, the object is released slightly higher or tilted. Returns None if there is no
        plan.
        """
        fitting = self.with_opening_of(plan.grasp)
        if fitting is not self:
            return fitting.plan_place(
                problem, plan, joint_positions_rad, gripper_to_object, goal_object_to_world, with_carry
            )
        world = self._world_of(problem, goal_object_to_world)
        world.shape_hand(plan.grasp)
        world.hold(gripper_to_object)
        start = np.array(joint_positions_rad, float)
        rng = np.random.default_rng((problem.seed, 1))
        for goal in goals_after_slip(
            problem.target.body, goal_object_to_world, plan.gripper_to_object, gripper_to_object
        ):
            if with_carry:
                outcome = self._placements.plan(world, start, goal @ gripper_to_object, rng)
            else:
                outcome = self._placements.plan_from_above(world, start, goal @ gripper_to_object)
            if isinstance(outcome, tuple):
                return outcome
        return None

    def plan_return_home(self, problem: PickPlaceProblem, joints_rad: np.ndarray) -> Motion | None:
        """Plan the motion of the empty open hand to the home configuration; None if there is none."""
        world, rng = self._world_of(problem, problem.goal_object_to_world), np.random.default_rng((problem.seed, 5))
        found = self._motions.plan_free(world.arm, Phase.REACH, joints_rad, self.arm.home, rng)
        return replace(found, phase=Phase.RETURN) if isinstance(found, Motion) else None

    def reachable_share(self, problem: PickPlaceProblem) -> float:
        """Return the share of grasps with a collision-free inverse kinematics and a straight approach, in any turn."""
        return sum(self.reachable_grasps(problem)) / max(1, len(problem.grasps))

    def reachable_grasps(self, problem: PickPlaceProblem) -> list[bool]:
        """Tell for each grasp whether it has a collision-free inverse kinematics and a straight approach, in any turn."""
        world = self._world_of(problem, problem.goal_object_to_world)
        return [self._can_be_reached(world, grasp) for grasp in problem.grasps]

    def _can_be_reached(self, world: ProblemWorld, grasp: Grasp) -> bool:
        world.shape_hand(grasp)
        return any(self._can_approach(world, grasp.gripper_to_object @ turn) for turn in self._candidates.turns)

    def _can_approach(self, world: ProblemWorld, gripper_to_object: np.ndarray) -> bool:
        if self._candidates.approach_failure(world, gripper_to_object) is not None:
            return False
        gripper_to_world = world.problem.target.object_to_world @ gripper_to_object
        before = self._ends.approach_start(gripper_to_world)
        solutions, _ = self._solutions.solve(world.arm, Phase.APPROACH, gripper_to_world, self.arm.home)
        return any(self._motions.plan_line(world.arm, Phase.APPROACH, found, before) is not None for found in solutions)

    def _plan_grasp(
        self,
        world: ProblemWorld,
        grasp: Grasp,
        gripper_to_object: np.ndarray,
        rng: np.random.Generator,
        level_only: bool,
    ) -> PickPlacePlan | PlanFailure:
        """Return the plan of one pose of a grasp, or the latest stage that failed."""
        gripper_to_world = world.problem.target.object_to_world @ gripper_to_object
        solutions, converged = self._solutions.solve(world.arm, Phase.APPROACH, gripper_to_world, self.arm.home)
        failure: PlanFailure = "approach_blocked" if converged else "no_inverse_kinematics"
        for at_grasp in solutions:
            outcome = self._plan_from(world, grasp, gripper_to_object, at_grasp, rng, level_only)
            if isinstance(outcome, PickPlacePlan):
                return outcome
            failure = later_failure(failure, outcome)
        return failure

    def _plan_from(
        self,
        world: ProblemWorld,
        grasp: Grasp,
        gripper_to_object: np.ndarray,
        at_grasp: np.ndarray,
        rng: np.random.Generator,
        level_only: bool,
    ) -> PickPlacePlan | PlanFailure:
        """Plan with the arm at one inverse kinematics solution of the grasp."""
        gripper_to_world = self.arm.gripper_pose(at_grasp)
        approach = self._motions.plan_line(
            world.arm, Phase.APPROACH, at_grasp, self._ends.approach_start(gripper_to_world)
        )
        if approach is None:
            return "approach_blocked"
        lift = self._motions.plan_line(world.arm, Phase.LIFT, at_grasp, self._ends.lift_end(gripper_to_world))
        if lift is None:
            return "lift_blocked"
        lifted = self._motions.time_path(Phase.LIFT, lift)
        placed = world.goal_object_to_world @ gripper_to_object
        placement = self._placements.plan(world, lifted.positions_rad[-1], placed, rng, level_only=level_only)
        if not isinstance(placement, tuple):
            return placement
        carry, lower, retreat = placement
        assert carry is not None, "a placement from above the start has a carry"
        approached = self._motions.time_path(Phase.APPROACH, approach, backwards=True)
        reach = self._motions.plan_free(world.arm, Phase.REACH, self.arm.home, approached.positions_rad[0], rng)
        if not isinstance(reach, Motion):
            return reach
        return PickPlacePlan(grasp, gripper_to_object, reach, approached, lifted, carry, lower, retreat)
