"""Components shared by the planners of one arm: its models, single-motion planners, and the world of the last problem."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from manitwin.episodes.planning.arm_kinematics import ArmKinematics
from manitwin.episodes.planning.arm_solutions import ArmSolutions, SampledPoses
from manitwin.episodes.planning.collision_world import ProblemWorld
from manitwin.episodes.planning.convex_shapes import ShapeStore
from manitwin.episodes.planning.grasp_candidates import GraspCandidates, HandVertices, equivalent_rotations
from manitwin.episodes.planning.hand_shaping import HandShaping
from manitwin.episodes.planning.kinematic_body import floating_hand_of
from manitwin.episodes.planning.motions import Motions
from manitwin.episodes.planning.problem import PickPlaceProblem, PlannerSettings
from manitwin.episodes.planning.straight_lines import LineEnds
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.robot import Robot


class ArmPlanning:
    """Planning models of an arm and its hand at a given opening; collision shapes are cached between problems."""

    def __init__(
        self,
        robot: Robot,
        timestep_s: float = 1 / 120,
        settings: PlannerSettings | None = None,
        opening_m: float | None = None,
        standing: tuple[PlacedObject, ...] = (),
    ):
        """Build the models of arm and hand; ``opening_m`` 0 is the closed hand, for pressing and pushing.

        ``standing`` are obstacles of every problem, such as another, stationary arm.
        """
        self.robot, self.timestep_s, self.settings = robot, timestep_s, settings or PlannerSettings()
        self.arm = ArmKinematics(robot, opening_m)
        self.hand = floating_hand_of(self.arm.body)
        self.known, self.ends = SampledPoses(self.arm), LineEnds(self.settings)
        self._shaping: tuple[HandShaping, HandShaping] | None = None
        if isinstance(robot.gripper, MultiFingerGripper):
            bodies = self.arm.body, self.hand
            first, second = (HandShaping(body, robot.gripper, robot.open_hand) for body in bodies)
            self._shaping = first, second
        moving = frozenset[int]() if self._shaping is None else self._shaping[1].moving
        turns = equivalent_rotations(robot.gripper)
        self.candidates = GraspCandidates(HandVertices(self.hand, moving), self.known, self.settings, turns)
        self.solutions = ArmSolutions(self.arm, self.known, self.settings)
        self.motions = Motions(robot, self.arm, timestep_s, self.settings)
        self._shapes = ShapeStore()
        self._world: ProblemWorld | None = None
        self._standing = standing
        self._asked: tuple[PickPlaceProblem | None, PickPlaceProblem | None] = None, None

    def problem_world(
        self, problem: PickPlaceProblem, goal_object_to_world: np.ndarray, *, as_hulls: bool = False
    ) -> ProblemWorld:
        """Return the world of a problem; the last one is cached for replanning."""
        problem, last = self._with_standing(problem), self._world
        if last is None or not last.is_built_for(problem, goal_object_to_world, as_hulls=as_hulls):
            self._world = last = ProblemWorld(
                problem,
                goal_object_to_world,
                self.arm.body,
                self.hand,
                self._shapes,
                self.settings,
                shaping=self._shaping,
                as_hulls=as_hulls,
            )
        return last

    def _with_standing(self, problem: PickPlaceProblem) -> PickPlaceProblem:
        """Return the problem with the ``standing`` obstacles added; the same object for the same problem."""
        if not self._standing:
            return problem
        asked, found = self._asked
        if asked is not problem or found is None:
            found = replace(problem, obstacles=(*problem.obstacles, *self._standing))
            self._asked = problem, found
        return found
