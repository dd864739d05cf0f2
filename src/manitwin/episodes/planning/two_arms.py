"""Two-arm planning for handovers, in which one arm moves at a time and the other is an obstacle.

The first arm's part is a held path (``held_path``) to a meeting place. A grasp and a meeting place are accepted if the second
arm has another grasp that it can approach while the first holds the object, and if the first arm can then release it and
withdraw. Deterministic for a problem's seed, with effort limited by counts instead of time.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from manitwin.episodes.planning.arm_obstacles import ArmObstacles
from manitwin.episodes.planning.grasp_pairs import TwoHands
from manitwin.episodes.planning.held_knots import HeldPath
from manitwin.episodes.planning.held_path import HeldPathPlanner, HeldPlan
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.placement_choice import PlacementChoice
from manitwin.episodes.planning.problem import (
    Grasp,
    Motion,
    Phase,
    PickPlaceProblem,
    PlannerSettings,
    PlanReport,
)
from manitwin.episodes.planning.withdrawal import plan_withdrawal
from manitwin.robots.robot import Robot

MOST_TAKEN, MOST_RETAKEN = 6, 24
"""Numbers of the taker's grasps tried beyond the check of its hand: in advance, and at the meeting."""
SETTLED_M = 0.004  # allowance for fingers that stand farther apart than planned


@dataclass(frozen=True)
class TakePlan:
    """The second arm's part: a grasp with its pose as used, and the motions from home to it."""

    grasp: Grasp
    gripper_to_object: np.ndarray
    reach: Motion
    approach: Motion

    @property
    def joints_rad(self) -> np.ndarray:
        """Arm joints when the hand closes, ``(n,)``."""
        return np.asarray(self.approach.positions_rad[-1])


@dataclass(frozen=True)
class HandoverPlan:
    """The first arm's motions until it waits with the object, and the second arm's motions to take it."""

    give: HeldPlan
    take: TakePlan


class TwoArmPlanner(PickPlacePlanner):
    """Planner of the first of two arms, the giver, with that of the second, the ``taker``."""

    def __init__(self, robot: Robot, timestep_s: float = 1 / 120, settings: PlannerSettings | None = None):
        """Build the models of both arms and hands; ``robot`` has two ``arms``."""
        giver, taker = robot.arms
        super().__init__(giver, timestep_s, settings)
        self.taker = PickPlacePlanner(taker, timestep_s, settings)
        self._giver_shapes, self._taker_shapes = ArmObstacles(giver), ArmObstacles(taker)
        self._hands = TwoHands(self.parts, self.taker.parts, self._giver_shapes)

    @cached_property
    def giver_planner(self) -> PickPlacePlanner:
        """Planner for tasks of the first arm alone, with the second at home and its hand open."""
        resting = self._taker_shapes.at(self.taker.arm.home, (self._open_m,))
        return PickPlacePlanner(self.robot, self.parts.timestep_s, self.settings, resting)

    def plan_handover(
        self, problem: PickPlaceProblem, meetings: Sequence[HeldPath], put_down: PlacementChoice, *, longest_s: float
    ) -> tuple[HandoverPlan | None, PlanReport]:
        """Plan with the first grasp that leaves room for a second one, and the first meeting place that both arms reach.

        The second grasp must allow ``put_down``. The report contains no plan, only the number of grasps tried and their
        failures.
        """
        grasps = self._hands.giver_grasps(problem)
        asked = replace(self.with_taker_at(problem, self.taker.arm.home, None), grasps=grasps)
        found: list[TakePlan] = []

        def can_be_taken(grasp: Grasp, path: HeldPath, joints_rad: np.ndarray) -> bool:
            take = self.plan_take(problem, path.poses[-1], joints_rad, grasp.width_m, grasp.gripper_to_object, put_down)
            if take is None:
                return False
            found.append(take)
            return True

        def can_be_taken_somewhere(grasp: Grasp) -> bool:
            others = self._hands.taker_grasps(problem, grasp.gripper_to_object)
            return any(put_down.first_feasible_goal(other) is not None for other in others)

        held = HeldPathPlanner(self.parts, accepts=can_be_taken, serves=can_be_taken_somewhere)
        give, report = held.plan(asked, meetings, as_hulls=False, longest_s=longest_s)
        return (None if give is None else HandoverPlan(give, found[-1])), report

    def plan_take(
        self,
        problem: PickPlaceProblem,
        object_to_world: np.ndarray,
        giver_rad: np.ndarray,
        opening_m: float,
        giver_to_object: np.ndarray,
        put_down: PlacementChoice,
        first: Sequence[Grasp] = (),
    ) -> TakePlan | None:
        """Plan how the second arm, at home, takes the object that the first holds at ``object_to_world (4, 4)``.

        ``opening_m`` is the first hand's opening, ``giver_to_object (4, 4)`` its pose. Grasps in ``first`` are tried before
        all others. Returns None if no grasp can be approached, none allows putting the object down, or the first hand could
        withdraw from none.
        """
        parts, ends = self.taker.parts, self.taker.parts.ends
        asked = self._at_meeting(problem, object_to_world, giver_rad, opening_m)
        world, rng = parts.problem_world(asked, object_to_world), np.random.default_rng((problem.seed, 6))
        tried, most = 0, MOST_RETAKEN if first else MOST_TAKEN
        for other in (
            *self._hands.apart_grasps(first, giver_to_object),
            *self._hands.taker_grasps(problem, giver_to_object),
        ):
            if parts.candidates.approach_failure(world, other.gripper_to_object) is not None:
                continue
            if put_down.first_feasible_goal(other) is None:
                continue
            tried += 1
            there = object_to_world @ other.gripper_to_object
            solutions, _ = parts.solutions.solve(world.arm, Phase.APPROACH, there, parts.arm.home)
            for at_grasp in solutions:
                line = parts.motions.plan_line(world.arm, Phase.APPROACH, at_grasp, ends.approach_start(there))
                if line is None:
                    continue
                approach = parts.motions.time_path(Phase.APPROACH, line, backwards=True)
                if self.plan_withdrawal(problem, object_to_world, giver_rad, at_grasp, other.grasp) is None:
                    continue
                start = approach.positions_rad[0]
                reach = parts.motions.plan_free(world.arm, Phase.REACH, parts.arm.home, start, rng)
                if isinstance(reach, Motion):
                    return TakePlan(other.grasp, other.gripper_to_object, reach, approach)
            if tried == most:
                return None
        return None

    def plan_withdrawal(
        self,
        problem: PickPlaceProblem,
        object_to_world: np.ndarray,
        giver_rad: np.ndarray,
        taker_rad: np.ndarray,
        grasp: Grasp,
    ) -> Motion | None:
        """Plan the first hand's straight retreat from the object that the second arm holds by ``grasp``; None if blocked."""
        asked = self.with_taker_at(problem, taker_rad, grasp)
        return plan_withdrawal(self.parts, asked, object_to_world, giver_rad, blind=False)

    def plan_home(
        self,
        problem: PickPlaceProblem,
        object_to_world: np.ndarray,
        giver_rad: np.ndarray,
        taker_rad: np.ndarray,
        grasp: Grasp,
    ) -> Motion | None:
        """Plan the first arm's motion home around the second arm, which holds the object; None if there is none."""
        asked = self.with_taker_at(problem, taker_rad, grasp)
        asked = replace(asked, target=replace(problem.target, object_to_world=object_to_world))
        world, rng = self.parts.problem_world(asked, object_to_world), np.random.default_rng((problem.seed, 7))
        found = self.parts.motions.plan_free(world.arm, Phase.REACH, giver_rad, self.arm.home, rng)
        return replace(found, phase=Phase.RETURN) if isinstance(found, Motion) else None

    def plan_taker_home(self, problem: PickPlaceProblem, taker_rad: np.ndarray, giver_rad: np.ndarray) -> Motion | None:
        """Plan the second arm's motion home with its hand empty and open; None if there is none."""
        asked, parts = self.with_giver_at(problem, giver_rad), self.taker.parts
        world, rng = (
            parts.problem_world(asked, problem.target.object_to_world),
            np.random.default_rng((problem.seed, 10)),
        )
        found = parts.motions.plan_free(world.arm, Phase.REACH, taker_rad, parts.arm.home, rng)
        return replace(found, phase=Phase.RETURN) if isinstance(found, Motion) else None

    def placement_choice(self, problem: PickPlaceProblem, goals: Sequence[np.ndarray]) -> PlacementChoice:
        """Return the placement choice of the second arm among ``goals (4, 4)``, with the first arm at home."""
        return PlacementChoice(self.taker, self.with_giver_at(problem, self.arm.home), goals)

    def plan_bring_home(
        self, problem: PickPlaceProblem, gripper_to_object: np.ndarray, taker_rad: np.ndarray, giver_rad: np.ndarray
    ) -> Motion | None:
        """Plan the second arm's motion home with the held object, or else straight up; None if there is none."""
        parts = self.taker.parts
        asked = self.with_giver_at(problem, giver_rad)
        world, rng = (
            parts.problem_world(asked, problem.target.object_to_world),
            np.random.default_rng((problem.seed, 8)),
        )
        world.hold(gripper_to_object)
        home = parts.motions.plan_free(world.arm, Phase.CARRY, taker_rad, parts.arm.home, rng)
        if isinstance(home, Motion):
            return home
        line = parts.motions.plan_line(
            world.arm, Phase.CARRY, taker_rad, parts.ends.lift_end(parts.arm.gripper_pose(taker_rad))
        )
        return None if line is None else parts.motions.time_path(Phase.CARRY, line)

    def with_giver_at(self, problem: PickPlaceProblem, giver_rad: np.ndarray) -> PickPlaceProblem:
        """Return the second arm's problem with the first arm, hand open, as an obstacle."""
        return replace(problem, obstacles=(*problem.obstacles, *self._giver_shapes.at(giver_rad, (self._open_m,))))

    def with_taker_at(self, problem: PickPlaceProblem, taker_rad: np.ndarray, grasp: Grasp | None) -> PickPlaceProblem:
        """Return the first arm's problem with the second arm as an obstacle, its hand open or closed on a grasp."""
        opening_m = self._open_m if grasp is None else grasp.width_m + SETTLED_M
        return replace(problem, obstacles=(*problem.obstacles, *self._taker_shapes.at(taker_rad, (opening_m,))))

    def _at_meeting(
        self, problem: PickPlaceProblem, object_to_world: np.ndarray, giver_rad: np.ndarray, opening_m: float
    ) -> PickPlaceProblem:
        """Return the second arm's problem: the object in the air, and the first arm, its hand closed and open, as obstacles."""
        giver = self._giver_shapes.at(giver_rad, (opening_m, self._open_m))
        return replace(
            problem,
            target=replace(problem.target, object_to_world=object_to_world),
            goal_object_to_world=object_to_world,
            obstacles=(*problem.obstacles, *giver),
        )

    @property
    def _open_m(self) -> float:
        return float(self.robot.gripper.opening_m)


def planner_of(robot: Robot, timestep_s: float) -> PickPlacePlanner:
    """Return the planner of a one-arm or two-arm robot."""
    return (TwoArmPlanner if robot.arms else PickPlacePlanner)(robot, timestep_s=timestep_s)


def single_arm_planner(planner: PickPlacePlanner) -> PickPlacePlanner:
    """Return the planner for tasks of a single arm: for two arms that of the first."""
    return planner.giver_planner if isinstance(planner, TwoArmPlanner) else planner
