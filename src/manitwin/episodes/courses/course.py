"""Base of all courses: start of an episode, grasping and lifting, putting back, and early termination."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, TypeVar

import numpy as np

from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.events import EventWatch
from manitwin.episodes.execution import Execution
from manitwin.episodes.grasp_stability import stable_grasp_tiers
from manitwin.episodes.outcome import moved_m, turned_rad
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, GraspingPlan, Motion, Phase, PickPlaceProblem, PlanReport
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.contacts import NONE_MEANT
from manitwin.physics.sapien.world import RobotWorld

_Chosen = TypeVar("_Chosen")

ANOTHER_GRASP = "another_grasp"
# in the hand: beyond this, a plan made for another pose in the hand is hardly usable
TURNED_M, TURNED_RAD = 0.01, np.radians(10.0)
FIRST_SHARE = 0.75  # share of the grasps in the first part, which tend to be good
LEAST_LIFT_SHARE = 0.5  # of the hand's rise: below this, the object was left behind


def split_by_quality(grasps: Sequence[_Chosen]) -> tuple[Sequence[_Chosen], Sequence[_Chosen]]:
    """Split grasps into the first three quarters and the rest.

    Their order is random with a bias towards good grasps (``target_grasps.shuffled``). Callers sort each part separately by
    further criteria; sorting all grasps together could put a barely holding grasp at the end of a handle first every time.
    """
    count = int(np.ceil(FIRST_SHARE * len(grasps)))
    return grasps[:count], grasps[count:]


class EpisodeEnded(Exception):
    """Ends the episode with an outcome."""


class GraspFailed(EpisodeEnded):
    """Ends the episode unless the target, which stands again without the hand, can be taken by another grasp."""


class TurnedInHand(GraspFailed):
    """The target turned in the hand during the lift and has been put back: the same grasp is used if there is no other."""


class Planner(Protocol):
    """Interface of an episode's planner (``planning.pick_place.PickPlacePlanner``)."""

    def plan(self, problem: PickPlaceProblem) -> PlanReport:
        """Plan a problem completely, from the start to the placement and the retreat."""
        ...

    def plan_place(
        self, problem: PickPlaceProblem, plan: GraspingPlan, joint_positions_rad: np.ndarray,
        gripper_to_object_measured: np.ndarray, goal: np.ndarray, with_carry: bool,
    ) -> tuple[Motion | None, Motion, Motion] | None:  # fmt: skip
        """Plan carry (if ``with_carry``), lower and retreat from the current joints; None if there is no plan."""
        ...

    def tip_pose(self, q: np.ndarray) -> np.ndarray:
        """Return the pose ``(4, 4)`` of the grasp frame in the world at joint positions ``q``."""
        ...


@dataclass
class EpisodeStart:
    """Start of an episode: the problem, and all ``objects`` (in the world's order) at their resting poses.

    ``granules_in`` maps objects to the number of granules they hold. For a goal of several literals, ``moved`` are the names
    of all objects that are taken, ``partners`` those of all other objects in the goal.
    """

    problem: PickPlaceProblem
    objects: tuple[PlacedObject, ...]
    planner: Planner
    settings: EpisodeSettings
    skill_goal: SkillGoal | None
    granules_in: Mapping[str, int] = field(default_factory=dict)
    moved: frozenset[str] = frozenset()
    partners: frozenset[str] = frozenset()


def grasp_tiers(start: EpisodeStart) -> list[tuple[Grasp, ...]]:
    """Return the usable grasps in tiers, first those in which the target can be lifted without turning."""
    problem = start.problem
    if not isinstance(start.planner, PickPlacePlanner):
        return [problem.grasps]
    return stable_grasp_tiers(problem.grasps, problem.target, start.planner.robot.gripper)


class Course(ABC):
    """Plan and execution of one skill; ``facts`` are filled in along the way.

    ``lifts_steadily``: a grasp in which the object turns during the lift is rejected if there is another grasp.
    """

    lifts_steadily: ClassVar[bool] = False

    def __init__(self, start: EpisodeStart, facts: EpisodeFacts):
        """Take the start of the episode."""
        self.start, self.facts = start, facts
        self.problem = start.problem
        self.goal_object_to_world = start.problem.goal_object_to_world

    @abstractmethod
    def plan(self) -> bool:
        """Plan the whole course; return False if there is no plan."""

    @abstractmethod
    def execute(self, execution: Execution) -> None:
        """Execute the plan; raises Ended if it cannot be completed."""

    @property
    def planned_end_pose(self) -> np.ndarray | None:
        """Planned final pose ``(4, 4)`` of the target; None if it stays in the hand."""
        return self.goal_object_to_world

    @property
    def put_back_planner(self) -> Planner:
        """Planner used to put the target back."""
        return self.start.planner

    def watches(self, world: RobotWorld) -> Sequence[EventWatch]:
        """Return the event watches of this course."""
        return ()

    def grasp_and_lift(self, execution: Execution, reach: Motion, approach: Motion, lift: Motion) -> None:
        """Reach, approach, close and lift.

        Raises NotTaken if the object is left behind, Turned if it turned in the hand and was put back.
        """
        tip_pose = self.start.planner.tip_pose
        execution.shape_hand(self.facts.grasp)
        execution.follow(reach)
        execution.follow(approach)
        execution.close_hand()
        closed_height_m = self.height_m(execution)
        hand_height_m = tip_pose(execution.commanded_rad)[2, 3]
        self._lift(lift, execution)
        rise_m = tip_pose(execution.commanded_rad)[2, 3] - hand_height_m
        if self.height_m(execution) - closed_height_m < LEAST_LIFT_SHARE * rise_m:
            raise GraspFailed("not_lifted")

    def _lift(self, lift: Motion, execution: Execution) -> None:
        """Lift the target. If it turns far in the hand, retrace the lift, release it, and raise Turned.

        This keeps a turning object from hitting the arm. After a change of grasp, the lift is completed even if the object
        turns.
        """
        closed = execution.gripper_to_object()
        guarded = self.lifts_steadily and not self.facts.replans[ANOTHER_GRASP]

        def turns() -> bool:
            return guarded and turned_rad(closed, execution.gripper_to_object()) > TURNED_RAD

        if execution.follow(lift, until_row=turns):
            return
        ways_rad = np.linalg.norm(lift.positions_rad - execution.commanded_rad, axis=1)
        been = slice(int(ways_rad.argmin()), None, -1)
        execution.follow(Motion(Phase.LOWER, lift.positions_rad[been], -lift.velocities_rad_s[been]))
        execution.open_hand()
        raise TurnedInHand("not_lifted")

    def put_back_if_turned(self, plan: GraspingPlan, execution: Execution) -> None:
        """Put the target back where it was if it has turned so far in the hand that the plan is unusable, and raise NotTaken.

        Does nothing if it has turned little, if it cannot be put back, or after a change of grasp.
        """
        planned, measured = inverse(plan.gripper_to_object), inverse(execution.gripper_to_object())
        center = self.problem.target.body.center_of_mass_m
        is_as_planned = moved_m(planned, measured, center) < TURNED_M and turned_rad(planned, measured) < TURNED_RAD
        if self.facts.replans[ANOTHER_GRASP] or is_as_planned:
            return
        goal = self.problem.target.object_to_world.copy()
        goal[2, 3] += self.start.settings.release_height_m
        found = self.put_back_planner.plan_place(
            self.problem, plan, execution.commanded_rad, execution.gripper_to_object(), goal, True
        )
        if found is None:
            return
        carry, lower, retreat = found
        execution.meant = NONE_MEANT
        if carry is not None:
            execution.follow(carry)
        execution.follow(lower)
        execution.open_hand()
        execution.follow(retreat)
        raise GraspFailed("replan_failed")

    def tiers(self) -> list[tuple[Grasp, ...]]:
        """Return the usable grasps (``grasp_tiers``), and count those rejected because the target's weight would turn it."""
        self.record_missing_grasp()
        tiers = grasp_tiers(self.start)
        if turning := len(self.start.problem.grasps) - sum(map(len, tiers)):
            self.facts.plan_failures["weight_not_borne"] += turning
        return tiers

    def record_missing_grasp(self) -> None:
        """Set the outcome to ``no_grasp`` if the target has no grasp for this hand, to distinguish it from a planning failure."""
        if not self.start.problem.grasps:
            self.facts.outcome = "no_grasp"

    def height_m(self, execution: Execution) -> float:
        """Return the height of the target's centre of mass (m)."""
        center = self.problem.target.body.center_of_mass_m[None]
        return float(transform_points(execution.target_to_world(), center)[0, 2])

    def check_held(self, execution: Execution) -> None:
        """Raise Ended if the fingers have lost the target."""
        if not min(execution.touches.finger_forces_n) > 0:
            raise EpisodeEnded("dropped")

    def measure_slip(self, plan: GraspingPlan, execution: Execution) -> None:
        """Record how far the target has moved in the hand."""
        planned, measured = inverse(plan.gripper_to_object), inverse(execution.gripper_to_object())
        self.facts.slip_m = moved_m(planned, measured, self.problem.target.body.center_of_mass_m)
