"""Compatibility of two hands' grasps on one object, independent of the arms."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from manitwin.episodes.grasp_stability import LEAST_APART_M, any_orientation_loads, pad_distances_m
from manitwin.episodes.planning.arm_obstacles import ArmObstacles
from manitwin.episodes.planning.arm_planning import ArmPlanning
from manitwin.episodes.planning.placement_choice import HeldGrasp
from manitwin.episodes.planning.problem import Grasp, Phase, PickPlaceProblem
from manitwin.geometry.poses import inverse

APART_M = 0.06  # distance between the pads of two hands; closer hands fit only if they come from two sides


class TwoHands:
    """Open hands of a giver and a taker around one object; results for the last problem are cached."""

    def __init__(self, giver: ArmPlanning, taker: ArmPlanning, giver_shapes: ArmObstacles):
        """Take the models of both arms, and the giver's links as obstacles."""
        self._gripper, self._taker = giver.robot.gripper, taker
        open_m = (float(giver.robot.gripper.opening_m),)
        at_home = giver_shapes.at(giver.arm.home, open_m)
        self._hand = tuple(each for each in at_home if each.name in giver.hand.links)
        self._to_gripper = inverse(giver.arm.gripper_pose(giver.arm.home))
        self._problem: PickPlaceProblem | None = None
        self._found: dict[bytes, tuple[HeldGrasp, ...]] = {}

    def giver_grasps(self, problem: PickPlaceProblem) -> tuple[Grasp, ...]:
        """Return the grasps that hold the target in any orientation and have another such grasp apart from them.

        Grasps that are well apart from at least a quarter of the others come first. Within each group they are sorted by
        load: the larger of their own and the smallest of a grasp apart from them (``steady_grasps``).
        """
        grasps, loads = self._weight_bearing_grasps(problem)
        ranked = []
        for place, grasp in enumerate(grasps):
            apart_m = pad_distances_m(grasp, grasps, self._gripper)
            others = [loads[other] for other in np.flatnonzero(apart_m >= LEAST_APART_M)]
            if others:
                crowded = int((apart_m >= APART_M).sum()) < len(grasps) / 4
                ranked.append((crowded, max(loads[place], min(others)), place))
        return tuple(grasps[place] for *_, place in sorted(ranked))

    def apart_grasps(self, grasps: Sequence[Grasp], giver_to_object: np.ndarray) -> list[HeldGrasp]:
        """Return the grasps that are apart from the first hand, each in all its equivalent turns."""
        apart_m = pad_distances_m(Grasp("", giver_to_object, 0.0), grasps, self._gripper)
        apart = [each for each, m in zip(grasps, apart_m, strict=True) if m >= LEAST_APART_M]
        return [
            HeldGrasp(each, each.gripper_to_object @ turn) for each in apart for turn in self._taker.candidates.turns
        ]

    def taker_grasps(self, problem: PickPlaceProblem, giver_to_object: np.ndarray) -> tuple[HeldGrasp, ...]:
        """Return the second hand's grasps that it can approach past the open first hand, smallest load first."""
        if self._problem is not problem:
            self._problem, self._found = problem, {}
        key = giver_to_object.tobytes()
        if key not in self._found:
            to_object, here = giver_to_object @ self._to_gripper, np.eye(4)
            hand = tuple(replace(each, object_to_world=to_object @ each.object_to_world) for each in self._hand)
            target = replace(problem.target, object_to_world=here)
            alone = replace(
                problem, target=target, goal_object_to_world=here, obstacles=hand, static_boxes=(), fixtures=()
            )
            world, before = self._taker.problem_world(alone, here), self._taker.ends.approach_start
            bearing, loads = self._weight_bearing_grasps(problem)
            grasps = [bearing[place] for place in sorted(range(len(bearing)), key=lambda place: loads[place])]
            self._found[key] = tuple(
                held
                for held in self.apart_grasps(grasps, giver_to_object)
                if world.is_hand_free(Phase.APPROACH, held.gripper_to_object, before(held.gripper_to_object))
            )
        return self._found[key]

    def _weight_bearing_grasps(self, problem: PickPlaceProblem) -> tuple[list[Grasp], list[int]]:
        """Return the grasps that hold the target in any orientation, and their loads."""
        loads = any_orientation_loads(problem.grasps, problem.target.body, self._gripper)
        both = [(grasp, load) for grasp, load in zip(problem.grasps, loads, strict=True) if load is not None]
        return [grasp for grasp, _ in both], [load for _, load in both]
