"""The pick-and-place planner: for each grasp in turn, backwards from the grasp, then on to the placement."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.arm_solutions import ArmSolutions, KnownPoses
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.convex_shapes import ShapeStore
from manitwin.episodes.planning.grasp_candidates import TURNS, GraspCandidates, HandRoom
from manitwin.episodes.planning.kinematic_body import floating_hand_of
from manitwin.episodes.planning.motions import Motions
from manitwin.episodes.planning.placement import Placement, PlacementPlanner, goals_after_slip
from manitwin.episodes.planning.problem import (
    Grasp,
    Motion,
    Phase,
    PickPlacePlan,
    PickPlaceProblem,
    PlanFailure,
    PlannerSettings,
    PlanReport,
    later,
)
from manitwin.episodes.planning.straight_lines import LineEnds
from manitwin.robots.robot import Robot


class PickPlacePlanner:
    """Plans for one robot; deterministic for a problem's seed, with work counted and never timed."""

    def __init__(self, robot: Robot, timestep_s: float = 1 / 120, settings: PlannerSettings | None = None):
        """Build the models of arm and hand; the shapes of bodies are kept from one problem to the next."""
        self.robot, self.settings = robot, settings or PlannerSettings()
        self.arm = ArmKinematics(robot)
        self._hand = floating_hand_of(self.arm.body)
        known, self._ends = KnownPoses(self.arm), LineEnds(self.settings)
        self._candidates = GraspCandidates(HandRoom(self._hand), known, self.settings)
        self._solutions = ArmSolutions(self.arm, known, self.settings)
        self._motions = Motions(robot, self.arm, timestep_s, self.settings)
        self._placements = PlacementPlanner(self.arm, self._solutions, self._motions, self._ends)
        self._shapes = ShapeStore()
        self._world: ProblemWorld | None = None

    def tip_pose(self, joint_positions_rad: np.ndarray) -> np.ndarray:
        """Return the twin's grasp frame in the world ``(4, 4)`` (+Z approach, X closing)."""
        return self.arm.gripper_pose(np.asarray(joint_positions_rad, float))

    def plan(self, problem: PickPlaceProblem) -> PlanReport:
        """Plan with the first grasp that can be, itself or turned by 180 degrees about the approach axis.

        At most ``settings.max_grasps`` are tried beyond a look at the hand alone. What a grasp fails of is the latest stage
        that it came to.
        """
        world, rng = self._world_of(problem, problem.goal_object_to_world), np.random.default_rng(problem.seed)
        tally = _Tally()
        for candidate in self._candidates.of(world):
            grasp, failure = problem.grasps[candidate.index], candidate.failure
            if failure is None:
                if tally.is_new(candidate.index) and len(tally.beyond_a_look) == self.settings.max_grasps:
                    return tally.report(None)
                tally.beyond_a_look.add(candidate.index)
                outcome = self._plan_grasp(world, grasp, candidate.gripper_to_object, rng)
                if isinstance(outcome, PickPlacePlan):
                    tally.failures.pop(candidate.index, None)
                    tally.tried.add(candidate.index)
                    return tally.report(outcome)
                failure = outcome
            tally.count(candidate.index, failure)
        return tally.report(None)

    def plan_place(
        self,
        problem: PickPlaceProblem,
        plan: PickPlacePlan,
        joint_positions_rad: np.ndarray,
        gripper_to_object: np.ndarray,
        goal_object_to_world: np.ndarray,
        with_carry: bool,
    ) -> Placement | None:
        """Plan the placement anew from where the arm is, and from the pose in the hand ``(4, 4)`` that was measured.

        With ``with_carry`` the arm is somewhere above the start, and (carry, lower, retreat) are returned; without, it is
        above the goal, and lowers from there on a straight line: (None, lower, retreat). Where the hand has no room to make
        up for all that the object has turned since ``plan`` grasped it, it is let go a little higher or with some tilt.
        None: there is no way.
        """
        world = self._world_of(problem, goal_object_to_world)
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

    def reachable(self, problem: PickPlaceProblem) -> float:
        """Return the share of grasps with a collision-free inverse kinematics and a straight approach, in either turn."""
        world = self._world_of(problem, problem.goal_object_to_world)
        good = sum(
            any(self._can_approach(world, grasp.gripper_to_object @ turn) for turn in TURNS) for grasp in problem.grasps
        )
        return good / max(1, len(problem.grasps))

    def _world_of(self, problem: PickPlaceProblem, goal_object_to_world: np.ndarray) -> ProblemWorld:
        """Return the world of a problem; that of the last one is kept, for what is planned anew in it."""
        last = self._world
        if last is None or not last.is_of(problem, goal_object_to_world):
            self._world = last = ProblemWorld(
                problem, goal_object_to_world, self.arm.body, self._hand, self._shapes, self.settings
            )
        return last

    def _can_approach(self, world: ProblemWorld, gripper_to_object: np.ndarray) -> bool:
        if self._candidates.look_at_approach(world, gripper_to_object) is not None:
            return False
        gripper_to_world = world.problem.target.object_to_world @ gripper_to_object
        before = self._ends.before(gripper_to_world)
        solutions, _ = self._solutions.of(world.arm, Phase.APPROACH, gripper_to_world, self.arm.home)
        return any(self._motions.line(world.arm, Phase.APPROACH, found, before) is not None for found in solutions)

    def _plan_grasp(
        self, world: ProblemWorld, grasp: Grasp, gripper_to_object: np.ndarray, rng: np.random.Generator
    ) -> PickPlacePlan | PlanFailure:
        """Return the plan of one pose of a grasp, or the latest stage that failed."""
        gripper_to_world = world.problem.target.object_to_world @ gripper_to_object
        solutions, converged = self._solutions.of(world.arm, Phase.APPROACH, gripper_to_world, self.arm.home)
        failure: PlanFailure = "approach_blocked" if converged else "no_inverse_kinematics"
        for at_grasp in solutions:
            outcome = self._plan_from(world, grasp, gripper_to_object, at_grasp, rng)
            if isinstance(outcome, PickPlacePlan):
                return outcome
            failure = later(failure, outcome)
        return failure

    def _plan_from(
        self,
        world: ProblemWorld,
        grasp: Grasp,
        gripper_to_object: np.ndarray,
        at_grasp: np.ndarray,
        rng: np.random.Generator,
    ) -> PickPlacePlan | PlanFailure:
        """Plan with the arm at one solution of the grasp."""
        gripper_to_world = self.arm.gripper_pose(at_grasp)
        approach = self._motions.line(world.arm, Phase.APPROACH, at_grasp, self._ends.before(gripper_to_world))
        if approach is None:
            return "approach_blocked"
        lift = self._motions.line(world.arm, Phase.LIFT, at_grasp, self._ends.above(gripper_to_world))
        if lift is None:
            return "lift_blocked"
        lifted = self._motions.timed(Phase.LIFT, lift)
        placed = world.goal_object_to_world @ gripper_to_object
        placement = self._placements.plan(world, lifted.positions_rad[-1], placed, rng)
        if not isinstance(placement, tuple):
            return placement
        carry, lower, retreat = placement
        assert carry is not None, "a placement from above the start has a carry"
        approached = self._motions.timed(Phase.APPROACH, approach, backwards=True)
        reach = self._motions.free(world.arm, Phase.REACH, self.arm.home, approached.positions_rad[0], rng)
        if not isinstance(reach, Motion):
            return reach
        return PickPlacePlan(grasp, gripper_to_object, reach, approached, lifted, carry, lower, retreat)


@dataclass
class _Tally:
    """The grasps that were tried, beyond a look or not, and what they failed of."""

    tried: set[int] = field(default_factory=set)
    beyond_a_look: set[int] = field(default_factory=set)
    failures: dict[int, PlanFailure] = field(default_factory=dict)

    def is_new(self, index: int) -> bool:
        return index not in self.beyond_a_look

    def count(self, index: int, failure: PlanFailure) -> None:
        self.tried.add(index)
        self.failures[index] = later(failure, self.failures.get(index, failure))

    def report(self, plan: PickPlacePlan | None) -> PlanReport:
        return PlanReport(plan, len(self.tried), Counter(self.failures.values()))
