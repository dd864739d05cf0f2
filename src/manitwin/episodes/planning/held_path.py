"""Planning of held paths: a held object, or the closed hand itself, moves through a sequence of poses.

A skill provides ``HeldPath``s, ``object_to_world`` poses from its frames (one path for each choice of the free parameters),
and ranks grasps. ``plan`` finds the first grasp and path that can be reached, lifted and followed, preferably with spare
clearance. After the lift, ``again`` replans carry and path for the measured pose in the hand; ``onward`` replans the
remainder from the current joints; ``timed`` computes a motion. If replanning fails, the previous path is still used.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.grasp_tally import GraspTally
from manitwin.episodes.planning.held_knots import HeldKnots, HeldPath
from manitwin.episodes.planning.level_space import LEVEL_RAD, LevelSpace, tilts_rad
from manitwin.episodes.planning.path_timing import joint_spline, time_quintic
from manitwin.episodes.planning.problem import (
    Grasp,
    Motion,
    Phase,
    PickPlaceProblem,
    PlanFailure,
    PlanReport,
    later_failure,
)
from manitwin.geometry.poses import transform

FROM_WHERE_IT_IS_RAD = 0.9  # to the first knot from the arm's current joints
WITHDRAWN_M = 0.05
MOST_PAIRS = 400  # pairs of a grasp and a path beyond the check of the hand: 1 to 5 ms each
SPARE_M = 0.015  # objects move by this much as the jaws close and take their weight


Accepts = Callable[[Grasp, HeldPath, np.ndarray], bool]
"""Tells whether a grasp as used, a path and the arm's joints ``(n,)`` at its end are acceptable."""
Serves = Callable[[Grasp], bool]
"""Tells whether a grasp as used can be acceptable, wherever a path ends."""


@dataclass(frozen=True)
class HeldPlan:
    """Motions of one grasp: reach, approach, (close), lift, carry to the path's start; and the path's joint spline, not timed."""

    grasp: Grasp
    gripper_to_object: np.ndarray
    reach: Motion
    approach: Motion
    lift: Motion
    carry: Motion
    held: HeldPath
    joints: CubicSpline


class HeldPathPlanner:
    """Plans held paths for one arm; deterministic for a problem's seed.

    ``as_hulls`` (in the methods): the held object consists of its own hulls, for functions of its holes and cavities.
    ``longest_s``: a path that takes longer at the joint limits is rejected (some near singularities take 20 s).
    """

    def __init__(
        self,
        parts: ArmPlanning,
        *,
        empty: bool = False,
        lets_go: bool = False,
        level_rad: float | None = None,
        accepts: Accepts | None = None,
        serves: Serves | None = None,
    ):
        """Take the models of an arm; ``empty``: its hand holds nothing, and must not touch the target.

        ``lets_go``: the object is released at the path's end, where the hand must have room to retreat. ``level_rad``:
        largest tilt on the way to the path, relative to how the object stood. ``accepts`` decides whether another arm can
        take the object at the path's end, ``serves`` beforehand whether it could at any place; without them there is no
        handover.
        """
        self._accepts, self._serves = accepts, serves
        self.parts, self._lets_go, self._level_rad = parts, lets_go, level_rad
        self._knots = HeldKnots(parts, Phase.REACH if empty else Phase.CARRY)

    def plan(
        self, problem: PickPlaceProblem, paths: Sequence[HeldPath], *, as_hulls: bool, longest_s: float
    ) -> tuple[HeldPlan | None, PlanReport]:
        """Plan with the first feasible pair of a grasp (or an equivalent turn of it) and a path.

        Pairs are tried with ``SPARE_M`` of clearance around the arm, because the target's pose in the hand is never exact,
        then without. The report contains no plan, only the number of grasps tried and their failures.
        """
        world = self.parts.problem_world(problem, problem.target.object_to_world, as_hulls=as_hulls)
        rng, tally, pairs = np.random.default_rng(problem.seed), GraspTally(), 0
        tight = list[tuple[int, np.ndarray, HeldPath]]()
        for candidate in self.parts.candidates.check_grasps(world):
            failure: PlanFailure | None = candidate.failure
            if failure is None and self._accepts is not None:
                failure = self._look_at_lift(world, candidate.gripper_to_object)
            if failure is None and self._serves is not None:
                used = replace(problem.grasps[candidate.index], gripper_to_object=candidate.gripper_to_object)
                failure = None if self._serves(used) else "taker_blocked"
            world.hold(candidate.gripper_to_object)
            for path in paths if failure is None else ():
                if not self._knots.is_hand_free(world, path, candidate.gripper_to_object):
                    failure = "path_blocked" if failure is None else later_failure(failure, "path_blocked")
                    continue
                pairs += 1
                pair = candidate.index, candidate.gripper_to_object, path
                outcome = self._plan_pair(world, *pair, longest_s, rng, SPARE_M)
                if isinstance(outcome, HeldPlan):
                    tally.record_success(candidate.index)
                    return outcome, PlanReport(None, tally.count_tried, tally.reasons)
                if outcome is None:
                    tight.append(pair)
                    outcome = "path_blocked"
                failure = outcome if failure is None else later_failure(failure, outcome)
                if pairs == MOST_PAIRS:
                    break
            tally.record_failure(candidate.index, failure or "path_unreachable")
            if pairs == MOST_PAIRS:
                break
        for index, gripper_to_object, path in tight:
            world.shape_hand(problem.grasps[index])
            outcome = self._plan_pair(world, index, gripper_to_object, path, longest_s, rng)
            if isinstance(outcome, HeldPlan):
                tally.record_success(index)
                return outcome, PlanReport(None, tally.count_tried, tally.reasons)
            tally.record_failure(index, outcome or "path_blocked")
        return None, PlanReport(None, tally.count_tried, tally.reasons)

    def plan_empty(
        self,
        problem: PickPlaceProblem,
        paths: Sequence[HeldPath],
        *,
        longest_s: float,
        start_rad: np.ndarray | None = None,
        moved_to: np.ndarray | None = None,
    ) -> tuple[Motion, HeldPath, CubicSpline] | Sequence[PlanFailure]:
        """Plan reach and path of the empty hand for the first feasible path, and return them with the joints; or the failures.

        The motion starts at home, or at ``start_rad``. ``moved_to (4, 4)``: the path pushes the target there, through where
        it stood.
        """
        pushed = problem
        if moved_to is not None:
            pushed = replace(problem, target=replace(problem.target, object_to_world=moved_to))
        start = self.parts.arm.home if start_rad is None else np.asarray(start_rad, float)
        rng, failures = np.random.default_rng(problem.seed), list[PlanFailure]()
        for path in paths:
            world = self.parts.problem_world(pushed, pushed.target.object_to_world)
            joints = self._knots.solve_path(world, path, np.eye(4), start)
            if isinstance(joints, CubicSpline):
                if self._shortest_s(joints) > longest_s:
                    failures.append("path_slow")
                    continue
                world = self.parts.problem_world(problem, problem.target.object_to_world)
                reach = self.parts.motions.plan_free(world.arm, Phase.REACH, start, joints(0.0), rng)
                if isinstance(reach, Motion):
                    return reach, path, joints
                failures.append(reach)
            else:
                failures.append(joints)
        return failures

    def replan(
        self,
        problem: PickPlaceProblem,
        paths: Sequence[HeldPath],
        gripper_to_object: np.ndarray,
        joints_rad: np.ndarray,
        near_rad: np.ndarray,
        *,
        as_hulls: bool,
        longest_s: float,
    ) -> tuple[Motion, HeldPath, CubicSpline] | None:
        """Replan carry and path for the measured pose in the hand from the current joints, with the first feasible path.

        ``near_rad`` is the previous start of the path. Returns None if no path is feasible.
        """
        world = self.parts.problem_world(problem, problem.target.object_to_world, as_hulls=as_hulls)
        world.hold(gripper_to_object)
        rng = np.random.default_rng((problem.seed, 2))
        for path in paths:
            joints = self._knots.solve_path(world, path, gripper_to_object, near_rad)
            if not isinstance(joints, CubicSpline) or self._path_rejection(world, joints, longest_s):
                continue
            carry = self._carry(world, path, gripper_to_object, np.asarray(joints_rad, float), joints(0.0), rng)
            if isinstance(carry, Motion):
                return carry, path, joints
        return None

    def plan_spline(
        self,
        problem: PickPlaceProblem,
        path: HeldPath,
        gripper_to_object: np.ndarray,
        joints_rad: np.ndarray,
        *,
        as_hulls: bool,
    ) -> CubicSpline | None:
        """Plan from the current joints through all poses of a path for the measured pose in the hand; None if infeasible."""
        world = self.parts.problem_world(problem, problem.target.object_to_world, as_hulls=as_hulls)
        world.hold(gripper_to_object)
        hands = path.poses @ gripper_to_object
        here = np.asarray(joints_rad, float)
        knots = self._knots.continue_knots(world, path, hands, [here], largest_rad=FROM_WHERE_IT_IS_RAD)
        return joint_spline(knots) if isinstance(knots, np.ndarray) else None

    def time_path(self, joints: CubicSpline, duration_s: float, phase: Phase, *, beyond: float = 1.0) -> Motion:
        """Time a path over ``duration_s``, or longer if the joint limits require it (``path_timing.time_quintic``)."""
        parts = self.parts
        positions, velocities = time_quintic(joints, parts.motions.limits, duration_s, parts.timestep_s, beyond)
        return Motion(phase, positions, velocities)

    def _plan_pair(
        self,
        world: ProblemWorld,
        index: int,
        gripper_to_object: np.ndarray,
        path: HeldPath,
        longest_s: float,
        rng: np.random.Generator,
        spare_m: float = 0.0,
    ) -> HeldPlan | PlanFailure | None:
        """Plan one pose of a grasp with one path along which the hand is free; None: there is no spare clearance.

        Cheapest first: path, approach, lift, carry, reach.
        """
        parts = self.parts
        world.hold(gripper_to_object)
        joints = self._knots.solve_joints(world, path, gripper_to_object, parts.arm.home)
        if not isinstance(joints, CubicSpline):
            return joints
        if spare_m:
            joints = self._knots.solve_path(world, path, gripper_to_object, parts.arm.home, spare_m)
            if not isinstance(joints, CubicSpline):
                return None
        drawback = self._path_rejection(world, joints, longest_s)
        if drawback is not None:
            return drawback
        grasp = replace(world.problem.grasps[index], gripper_to_object=gripper_to_object)
        if self._accepts is not None and not self._accepts(grasp, path, joints(1.0)):
            return "taker_blocked"
        grasped = world.problem.target.object_to_world @ gripper_to_object
        solutions, converged = parts.solutions.solve(world.arm, Phase.APPROACH, grasped, joints(0.0))
        failure: PlanFailure = "approach_blocked" if converged else "no_inverse_kinematics"
        for at_grasp in solutions:
            there = parts.arm.gripper_pose(at_grasp)
            approach = parts.motions.plan_line(world.arm, Phase.APPROACH, at_grasp, parts.ends.approach_start(there))
            if approach is None:
                continue
            lift = parts.motions.plan_line(world.arm, Phase.LIFT, at_grasp, parts.ends.lift_end(there))
            if lift is None:
                failure = later_failure(failure, "lift_blocked")
                continue
            lifted = parts.motions.time_path(Phase.LIFT, lift)
            lifted_rad, only = lifted.positions_rad[-1], spare_m > 0
            carry = self._carry(world, path, gripper_to_object, lifted_rad, joints(0.0), rng, level_only=only)
            if carry is None:
                return None
            if not isinstance(carry, Motion):
                failure = later_failure(failure, carry)
                continue
            approached = parts.motions.time_path(Phase.APPROACH, approach, backwards=True)
            reach = parts.motions.plan_free(world.arm, Phase.REACH, parts.arm.home, approached.positions_rad[0], rng)
            if isinstance(reach, Motion):
                grasp = world.problem.grasps[index]
                return HeldPlan(grasp, gripper_to_object, reach, approached, lifted, carry, path, joints)
            failure = later_failure(failure, reach)
        return failure

    def _look_at_lift(self, world: ProblemWorld, gripper_to_object: np.ndarray) -> PlanFailure | None:
        """Return why the arm cannot grasp and lift with a pose of a grasp, or None; cheap compared with ``accepts``."""
        parts, grasped = self.parts, world.problem.target.object_to_world @ gripper_to_object
        solutions, converged = parts.solutions.solve(world.arm, Phase.APPROACH, grasped, parts.arm.home)
        failure: PlanFailure = "approach_blocked" if converged else "no_inverse_kinematics"
        for at_grasp in solutions:
            there = parts.arm.gripper_pose(at_grasp)
            if parts.motions.plan_line(world.arm, Phase.APPROACH, at_grasp, parts.ends.approach_start(there)) is None:
                continue
            if parts.motions.plan_line(world.arm, Phase.LIFT, at_grasp, parts.ends.lift_end(there)) is not None:
                return None
            failure = later_failure(failure, "lift_blocked")
        return failure

    def _carry(
        self,
        world: ProblemWorld,
        path: HeldPath,
        gripper_to_object: np.ndarray,
        start: np.ndarray,
        end: np.ndarray,
        rng: np.random.Generator,
        *,
        level_only: bool = False,
    ) -> Motion | PlanFailure | None:
        """Return the motion to the path: within the task's tilt limit, else little more tilted than its start, else any.

        None: it must be ``level_only``, and only a tilted motion exists.
        """
        target, arm, free = world.problem.target, self.parts.arm, self.parts.motions.plan_free
        upright = target.object_to_world[:3, :3]
        level = upright @ gripper_to_object[:3, :3]
        if self._level_rad is not None:
            return free(LevelSpace(world.arm, arm.gripper_pose, level, self._level_rad), Phase.CARRY, start, end, rng)
        if target.name in world.problem.level:
            most_rad = float(tilts_rad(path.poses[:1, :3, :3], upright)[0]) + LEVEL_RAD
            found = free(LevelSpace(world.arm, arm.gripper_pose, level, most_rad), Phase.CARRY, start, end, rng)
            if isinstance(found, Motion) or level_only:
                return found if isinstance(found, Motion) else None
        return free(world.arm, Phase.CARRY, start, end, rng)

    def _path_rejection(self, world: ProblemWorld, joints: CubicSpline, longest_s: float) -> PlanFailure | None:
        """Return why a feasible path is rejected: too slow, or no room for the hand to retreat at its end; otherwise None."""
        if self._shortest_s(joints) > longest_s:
            return "path_slow"
        if not self._lets_go:
            return None
        motions, end = self.parts.motions, joints(1.0)
        back = self.parts.arm.gripper_pose(end) @ transform(translation=np.array([0.0, 0, -WITHDRAWN_M]))
        return "retreat_blocked" if motions.plan_line(world.arm, Phase.RETREAT, end, back) is None else None

    def _shortest_s(self, joints: CubicSpline) -> float:
        return len(self.time_path(joints, 1.0, Phase.ACT).positions_rad) * self.parts.timestep_s
