"""Joint positions along held paths, knot by knot: inverse kinematics extrapolated from the previous knots."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.collision_world import STANDING, ProblemWorld
from manitwin.episodes.planning.path_timing import joint_spline
from manitwin.episodes.planning.problem import Phase, PlanFailure, later_failure

STARTS = 4  # known configurations from which the first pose is solved
LARGEST_KNOT_RAD = 0.6  # a larger change between knots is a jump to another branch
ITERATIONS = 30
SAME_RAD = 0.05


@dataclass(frozen=True)
class HeldPath:
    """Poses ``(K, 4, 4)`` in the world, of the held object, or of the grasp frame for an empty closed hand.

    From knot ``meant_from`` on, the held object (or the fingers of an empty hand) may touch the bodies named ``meant``.
    """

    poses: np.ndarray
    meant: frozenset[str] = frozenset()
    meant_from: int = 0

    def part(self, first: int, end: int) -> HeldPath:
        """Return the knots from ``first`` up to, but not including, ``end``."""
        return replace(self, poses=self.poses[first:end], meant_from=max(0, self.meant_from - first))


class HeldKnots:
    """Solves joint positions of held paths for one arm; the world holds the target, or nothing."""

    def __init__(self, parts: ArmPlanning, phase: Phase):
        """Take the models of an arm, and the phase of the collision filter: CARRY, or REACH of an empty hand."""
        self._parts, self._phase = parts, phase

    def solve_path(
        self,
        world: ProblemWorld,
        path: HeldPath,
        gripper_to_object: np.ndarray,
        near_rad: np.ndarray,
        spare_m: float = 0.0,
    ) -> CubicSpline | PlanFailure:
        """Return the joint spline of a path, or the failure.

        It starts at the solution nearest to ``near_rad`` or to known configurations, and the arm keeps ``spare_m`` of
        additional clearance.
        """
        if not self.is_hand_free(world, path, gripper_to_object, spare_m):
            return "path_blocked"
        return self.solve_joints(world, path, gripper_to_object, near_rad, spare_m)

    def solve_joints(
        self,
        world: ProblemWorld,
        path: HeldPath,
        gripper_to_object: np.ndarray,
        near_rad: np.ndarray,
        spare_m: float = 0.0,
    ) -> CubicSpline | PlanFailure:
        """Do the same as ``follow`` for a path along which the hand is known to be free."""
        parts, hands = self._parts, path.poses @ gripper_to_object
        if any(parts.known.is_out_of_reach(hands[k]) for k in (0, len(hands) // 2, -1)):
            return "path_unreachable"
        failure: PlanFailure = "path_unreachable"
        seen: list[np.ndarray] = []
        for start in (near_rad, *parts.known.nearest(hands[0], STARTS)):
            first = parts.arm.inverse(hands[0], start)
            if first is None or any(np.abs(first - other).max() < SAME_RAD for other in seen):
                continue
            seen.append(first)
            knots = self._begin(world, path, hands, first, spare_m)
            if isinstance(knots, np.ndarray):
                return joint_spline(knots)
            failure = later_failure(failure, knots)
        return failure

    def is_hand_free(
        self, world: ProblemWorld, path: HeldPath, gripper_to_object: np.ndarray, spare_m: float = 0.0
    ) -> bool:
        """Tell whether the hand with the held object is free at each pose, regardless of the arm.

        Far cheaper than solving the joints. Tested from the end, where most paths come close to obstacles.
        """
        hands, margin_m = path.poses @ gripper_to_object, self._parts.settings.clearance_m
        return all(
            world.is_hand_free(
                self._phase,
                hands[number],
                margin_m=margin_m,
                meant=_allowed_contacts(world, path, number),
                spare_m=spare_m,
            )
            for number in reversed(range(len(hands)))
        )

    def continue_knots(
        self,
        world: ProblemWorld,
        path: HeldPath,
        hands: np.ndarray,
        knots: list[np.ndarray],
        *,
        largest_rad: float = LARGEST_KNOT_RAD,
        spare_m: float = 0.0,
    ) -> np.ndarray | PlanFailure:
        """Return knots ``(K, n)`` continued from the last of ``knots``; every new knot and the midpoint before it are free."""
        arm, knots = self._parts.arm, list(knots)
        for number, hand in enumerate(hands):
            guess = knots[-1] if len(knots) == 1 else np.clip(2 * knots[-1] - knots[-2], arm.lower, arm.upper)
            knot = arm.inverse(hand, guess, ITERATIONS)
            if knot is None or np.abs(knot - knots[-1]).max() > largest_rad:
                return "path_unreachable"
            self._enter(world, path, number, spare_m)
            middle_counts = len(knots) > 1 or largest_rad == LARGEST_KNOT_RAD
            if not world.arm.is_free(knot) or (middle_counts and not world.arm.is_free((knot + knots[-1]) / 2)):
                return "path_blocked"
            knots.append(knot)
        return np.array(knots)

    def _begin(
        self, world: ProblemWorld, path: HeldPath, hands: np.ndarray, first_rad: np.ndarray, spare_m: float
    ) -> np.ndarray | PlanFailure:
        """Return free knots ``(K, n)`` that start at ``first_rad``."""
        self._enter(world, path, 0, spare_m)
        if not world.arm.is_free(first_rad):
            return "path_blocked"
        return self.continue_knots(world, path.part(1, len(path.poses)), hands[1:], [first_rad], spare_m=spare_m)

    def _enter(self, world: ProblemWorld, path: HeldPath, number: int, spare_m: float) -> None:
        world.arm.enter(self._phase, self._parts.settings.clearance_m, _allowed_contacts(world, path, number), spare_m)


def _allowed_contacts(world: ProblemWorld, path: HeldPath, number: int) -> frozenset[str]:
    """Return the names of the bodies that may be touched at a knot of a path."""
    meant = path.meant if number >= path.meant_from else frozenset[str]()
    return meant | {STANDING} if world.problem.target.name in meant else meant
