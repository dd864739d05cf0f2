"""The collision worlds of one problem: for the whole arm, and for the hand alone, which is cheap to ask first."""

from __future__ import annotations

import numpy as np

from manitwin.episodes.planning.collision_world import CollisionWorld
from manitwin.episodes.planning.convex_shapes import ShapeStore
from manitwin.episodes.planning.kinematic_body import KinematicBody
from manitwin.episodes.planning.libraries import pin
from manitwin.episodes.planning.obstacle_shapes import obstacle_shapes, pose_of
from manitwin.episodes.planning.problem import Phase, PickPlaceProblem
from manitwin.episodes.planning.settings import PlannerSettings


class ProblemWorld:
    """A problem's shapes around an arm and around its hand alone."""

    def __init__(
        self,
        problem: PickPlaceProblem,
        goal_object_to_world: np.ndarray,
        arm: KinematicBody,
        hand: KinematicBody,
        store: ShapeStore,
        settings: PlannerSettings,
    ):
        """Build both worlds."""
        self.problem, self.goal_object_to_world = problem, goal_object_to_world
        shapes = obstacle_shapes(problem, goal_object_to_world, store, settings.margin_m)
        self.arm = CollisionWorld(arm, shapes, margin_m=settings.margin_m, clearance_m=settings.clearance_m)
        self._hand = CollisionWorld(hand, shapes, margin_m=settings.margin_m, clearance_m=settings.clearance_m)

    def is_of(self, problem: PickPlaceProblem, goal_object_to_world: np.ndarray) -> bool:
        """Tell whether this is the world of this very problem with such a goal."""
        return self.problem is problem and np.array_equal(self.goal_object_to_world, goal_object_to_world)

    def hold(self, gripper_to_object: np.ndarray) -> None:
        """Put the held target where a grasp has it."""
        self.arm.hold(gripper_to_object)
        self._hand.hold(gripper_to_object)

    def is_hand_free(self, phase: Phase, *grippers_to_world: np.ndarray) -> bool:
        """Tell whether the hand, wherever its arm, is free at poses in a phase."""
        self._hand.enter(phase)
        return all(self._hand.is_free(pin.SE3ToXYZQUAT(pose_of(pose))) for pose in grippers_to_world)
