"""Candidate poses of grasps, and collision checks of the hand alone that are independent of the arm."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull

from manitwin.episodes.planning.arm_solutions import SampledPoses
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.convex_shapes import corners_of
from manitwin.episodes.planning.kinematic_body import KinematicBody
from manitwin.episodes.planning.problem import Grasp, Phase, PlanFailure, PlannerSettings
from manitwin.episodes.planning.straight_lines import HALF_TURN, LineEnds
from manitwin.geometry.poses import inverse
from manitwin.geometry.rigid_body import StaticBox
from manitwin.robots.grippers.gripper import Gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.grippers.suction import SuctionGripper

CLOSED = (0.15, 0.3, 0.5)  # fractions of the closing motion: the object stops the fingers before its end
QUARTER_TURN = np.array([[0.0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])


def equivalent_rotations(gripper: Gripper) -> np.ndarray:
    """Return the rotations about the approach axis ``(K, 4, 4)`` that leave a grasp equivalent.

    Jaws are interchangeable, a cup is round (with a square body), and fingers of a multi-finger hand are all different.
    """
    if isinstance(gripper, SuctionGripper):
        return np.array([np.linalg.matrix_power(QUARTER_TURN, number) for number in range(4)])
    return np.array([np.eye(4), HALF_TURN] if isinstance(gripper, ParallelGripper) else [np.eye(4)])


class HandVertices:
    """Vertices of a hand's shapes in the grasp frame, for a fast test against boxes.

    The test is necessary but not sufficient: a hand that passes may still overlap a box with an edge.
    """

    def __init__(self, hand: KinematicBody, moving: frozenset[int] = frozenset()):
        """Take the vertices of the convex hull of all shapes with vertices, except those ``moving`` with a grasp's joints."""
        shapes = (shape for index, shape in enumerate(hand.geometry.geometryObjects) if index not in moving)
        pieces = [points for shape in shapes if (points := corners_of(shape)) is not None]
        points = np.concatenate(pieces)
        self._corners = np.concatenate([points[ConvexHull(points).vertices]])

    def is_inside(self, gripper_to_world: np.ndarray, boxes: tuple[StaticBox, ...], clearance_m: float) -> np.ndarray:
        """Tell for each pose ``(N, 4, 4)`` whether a vertex is closer to a box than ``clearance_m``."""
        inside = np.zeros(len(gripper_to_world), dtype=bool)
        for box in boxes:
            to_box = inverse(box.box_to_world) @ gripper_to_world
            reach = np.asarray(box.half_extents_m) + clearance_m
            deep = np.ones((len(to_box), len(self._corners)), dtype=bool)
            for axis in (2, 0, 1):
                along = to_box[:, axis, :3] @ self._corners.T + to_box[:, axis, 3, None]
                deep &= np.abs(along) < reach[axis]
            inside |= deep.any(1)
        return inside


@dataclass(frozen=True)
class GraspCandidate:
    """A pose ``gripper_to_object (4, 4)`` of grasp ``index``, and why the hand cannot be there, if so."""

    index: int
    gripper_to_object: np.ndarray
    failure: PlanFailure | None


class GraspCandidates:
    """Checks grasps with the hand alone, which is cheap compared with any motion of the arm."""

    def __init__(self, room: HandVertices, known: SampledPoses, settings: PlannerSettings, turns: np.ndarray):
        """Take hand and reach models, and the equivalent rotations ``turns (K, 4, 4)`` of a grasp."""
        self.turns = turns
        self._room, self._known, self._settings = room, known, settings
        self._ends = LineEnds(settings)

    def check_grasps(self, world: ProblemWorld) -> Iterator[GraspCandidate]:
        """Yield all turns of each grasp; the world's hand has the grasp's shape at that time."""
        grasps = world.problem.grasps
        if not grasps:
            return
        poses = np.array([grasp.gripper_to_object for grasp in grasps])[:, None] @ self.turns
        at_start = self._without_room(world, world.problem.target.object_to_world @ poses)
        at_goal = self._without_room(world, world.goal_object_to_world @ poses)
        for index in range(len(grasps)):
            world.shape_hand(grasps[index])
            for turn in range(len(self.turns)):
                failure: PlanFailure | None = None
                if at_start[index, turn]:
                    failure = "approach_blocked"
                elif at_goal[index, turn]:
                    failure = "lower_blocked"
                else:
                    failure = self.hand_failure(world, poses[index, turn])
                    if failure is None and grasps[index].joints_rad is not None:
                        failure = self._look_at_closing(world, grasps[index], poses[index, turn])
                yield GraspCandidate(index, poses[index, turn], failure)

    def _without_room(self, world: ProblemWorld, gripper_to_world: np.ndarray) -> np.ndarray:
        flat = gripper_to_world.reshape(-1, 4, 4)
        boxes = (*world.problem.static_boxes, *world.problem.fixtures)
        inside = self._room.is_inside(flat, boxes, self._settings.clearance_m)
        return inside.reshape(gripper_to_world.shape[:2])

    def hand_failure(self, world: ProblemWorld, gripper_to_object: np.ndarray) -> PlanFailure | None:
        """Return why a pose is infeasible: out of reach, or the hand collides at the ends of its straight lines; or None.

        The world then holds the target in this pose.
        """
        world.hold(gripper_to_object)
        failure = self.approach_failure(world, gripper_to_object)
        if failure is not None:
            return failure
        grasped = world.problem.target.object_to_world @ gripper_to_object
        if not world.is_hand_free(Phase.LIFT, grasped, self._ends.lift_end(grasped)):
            return "lift_blocked"
        placed = world.goal_object_to_world @ gripper_to_object
        if self._known.is_out_of_reach(placed):
            return "place_unreachable"
        if not world.is_hand_free(Phase.LOWER, placed, self._ends.lift_end(placed)):
            return "lower_blocked"
        if not world.is_hand_free(Phase.RETREAT, placed, self._ends.approach_start(placed)):
            return "retreat_blocked"
        return None

    def _look_at_closing(self, world: ProblemWorld, grasp: Grasp, gripper_to_object: np.ndarray) -> PlanFailure | None:
        """Return why a multi-finger hand cannot close, since its fingers may curl into the support; otherwise None."""
        grasped = world.problem.target.object_to_world @ gripper_to_object
        for closed in CLOSED:
            world.shape_hand(grasp, closed)
            if not world.is_hand_free(Phase.LIFT, grasped):
                world.shape_hand(grasp)
                return "approach_blocked"
        world.shape_hand(grasp)
        return None

    def approach_failure(self, world: ProblemWorld, gripper_to_object: np.ndarray) -> PlanFailure | None:
        """Return why a pose cannot be approached: out of reach, or the hand collides at an end of the line; or None."""
        grasped = world.problem.target.object_to_world @ gripper_to_object
        if self._known.is_out_of_reach(grasped):
            return "outside_workspace"
        if not world.is_hand_free(Phase.APPROACH, grasped, self._ends.approach_start(grasped)):
            return "approach_blocked"
        return None
