"""What courses share: where an episode starts from, how an object is grasped and lifted, and how an episode ends early."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, TypeVar

import numpy as np

from manitwin.episodes.episode_facts import EpisodeFacts
from manitwin.episodes.events import EventWatch
from manitwin.episodes.execution import Execution
from manitwin.episodes.outcome import moved_m, turned_rad
from manitwin.episodes.planning.pick_place import PickPlacePlanner
from manitwin.episodes.planning.problem import Grasp, Grasped, Motion, Phase, PickPlaceProblem, PlanReport
from manitwin.episodes.settings import EpisodeSettings
from manitwin.episodes.skills.skill import SkillGoal
from manitwin.episodes.steady_grasps import steady_tiers
from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.rigid_body import PlacedObject
from manitwin.physics.sapien.contacts import NONE_MEANT
from manitwin.physics.sapien.world import RobotWorld

_Chosen = TypeVar("_Chosen")

ANOTHER_GRASP = "another_grasp"
TURNED_M, TURNED_RAD = 0.01, np.radians(10.0)  # in the hand: what was planned with another pose there hardly serves
FIRST_SHARE = 0.75  # of grasps: those that tend to be good
LEAST_LIFT_SHARE = 0.5  # of what the hand rose: less, and the object was left behind


def first_and_last(grasps: Sequence[_Chosen]) -> tuple[Sequence[_Chosen], Sequence[_Chosen]]:
    """Return the first three quarters of grasps, and the rest.

    Their order is drawn, good ones tend to come sooner (``target_grasps.shuffled``): what is asked of grasps beside that they
    hold is asked of the rest last, or the one at the end of a handle would be taken again and again that hardly holds.
    """
    count = int(np.ceil(FIRST_SHARE * len(grasps)))
    return grasps[:count], grasps[count:]


class Ended(Exception):
    """The episode ends here, with its outcome."""


class NotTaken(Ended):
    """The episode ends here unless the target, which stands again without the hand, is taken by another grasp."""


class Turned(NotTaken):
    """The target turned in the hand as it was lifted, and has been put back: the same grasp serves where no other does."""


class Planner(Protocol):
    """The protocol of an episode's planner (``planning.pick_place.PickPlacePlanner``)."""

    def plan(self, problem: PickPlaceProblem) -> PlanReport:
        """Plan the whole of a problem, from the start to the placement and back."""
        ...

    def plan_place(
        self, problem: PickPlaceProblem, plan: Grasped, joint_positions_rad: np.ndarray,
        gripper_to_object_measured: np.ndarray, goal: np.ndarray, with_carry: bool,
    ) -> tuple[Motion | None, Motion, Motion] | None:  # fmt: skip
        """Plan carry, lower and retreat again."""
        ...

    def tip_pose(self, q: np.ndarray) -> np.ndarray:
        """Return the pose ``(4, 4)`` of the grasp frame in the world."""
        ...


@dataclass
class Start:
    """What an episode starts from: the problem and all ``objects`` (in the world's order) where they have come to rest.

    ``granules_in`` says how many granules each of them holds. Of a goal of several literals, ``moved`` are the names of all
    that are taken, ``partners`` of all that it is about beside those.
    """

    problem: PickPlaceProblem
    objects: tuple[PlacedObject, ...]
    planner: Planner
    settings: EpisodeSettings
    skill_goal: SkillGoal | None
    granules_in: Mapping[str, int] = field(default_factory=dict)
    moved: frozenset[str] = frozenset()
    partners: frozenset[str] = frozenset()


def tiers_of(start: Start) -> list[tuple[Grasp, ...]]:
    """Return the grasps that can be planned with, those first in which the target bears to be lifted where it is."""
    problem = start.problem
    if not isinstance(start.planner, PickPlacePlanner):
        return [problem.grasps]
    return steady_tiers(problem.grasps, problem.target, start.planner.robot.gripper)


class Course(ABC):
    """What the robot does; ``facts`` are filled in on the way.

    ``lifts_steadily``: what turns in the hand as it is lifted does not serve, if another grasp does.
    """

    lifts_steadily: ClassVar[bool] = False

    def __init__(self, start: Start, facts: EpisodeFacts):
        """Take where the episode starts from."""
        self.start, self.facts = start, facts
        self.problem = start.problem
        self.goal_object_to_world = start.problem.goal_object_to_world

    @abstractmethod
    def plan(self) -> bool:
        """Plan all of it; False where there is no plan."""

    @abstractmethod
    def execute(self, execution: Execution) -> None:
        """Carry the plan out; raises Ended where it cannot go on."""

    @property
    def ends_at(self) -> np.ndarray | None:
        """Where the plan leaves the target ``(4, 4)``; None: in the hand."""
        return self.goal_object_to_world

    @property
    def putting_back(self) -> Planner:
        """The planner of how the target is put back."""
        return self.start.planner

    def watches(self, world: RobotWorld) -> Sequence[EventWatch]:
        """Return what is to be watched for events."""
        return ()

    def grasp_and_lift(self, execution: Execution, reach: Motion, approach: Motion, lift: Motion) -> None:
        """Reach, approach, close and lift; raises NotTaken where the object is left behind, Turned where it has been put back."""
        tip_pose = self.start.planner.tip_pose
        execution.shape(self.facts.grasp)
        execution.follow(reach)
        execution.follow(approach)
        execution.close()
        closed_height_m = self.height_m(execution)
        hand_height_m = tip_pose(execution.commanded_rad)[2, 3]
        self._lift(lift, execution)
        rise_m = tip_pose(execution.commanded_rad)[2, 3] - hand_height_m
        if self.height_m(execution) - closed_height_m < LEAST_LIFT_SHARE * rise_m:
            raise NotTaken("not_lifted")

    def _lift(self, lift: Motion, execution: Execution) -> None:
        """Lift; what turns far in the hand is let down as it was lifted and let go of, and then Turned is raised.

        So the arm is not hit by what turns. What has been taken by another grasp already is lifted as it turns.
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
        execution.open()
        raise Turned("not_lifted")

    def set_down_again(self, plan: Grasped, execution: Execution) -> None:
        """Set the target down where it was, which has turned so far in the hand that what was planned does not serve.

        Raises NotTaken once it stands. Nothing happens where it has turned little or cannot be set down, and to what has been
        taken by another grasp already.
        """
        planned, measured = inverse(plan.gripper_to_object), inverse(execution.gripper_to_object())
        center = self.problem.target.body.center_of_mass_m
        is_as_planned = moved_m(planned, measured, center) < TURNED_M and turned_rad(planned, measured) < TURNED_RAD
        if self.facts.replans[ANOTHER_GRASP] or is_as_planned:
            return
        goal = self.problem.target.object_to_world.copy()
        goal[2, 3] += self.start.settings.release_height_m
        found = self.putting_back.plan_place(
            self.problem, plan, execution.commanded_rad, execution.gripper_to_object(), goal, True
        )
        if found is None:
            return
        carry, lower, retreat = found
        execution.meant = NONE_MEANT
        if carry is not None:
            execution.follow(carry)
        execution.follow(lower)
        execution.open()
        execution.follow(retreat)
        raise NotTaken("replan_failed")

    def tiers(self) -> list[tuple[Grasp, ...]]:
        """Return the grasps that can be planned with (``tiers_of``), and count those that the target's weight would turn in."""
        self.tell_no_grasp()
        tiers = tiers_of(self.start)
        if turning := len(self.start.problem.grasps) - sum(map(len, tiers)):
            self.facts.plan_failures["weight_not_borne"] += turning
        return tiers

    def tell_no_grasp(self) -> None:
        """Have the outcome say so where the target has no grasp for this hand: that is not for want of a plan."""
        if not self.start.problem.grasps:
            self.facts.outcome = "no_grasp"

    def height_m(self, execution: Execution) -> float:
        """Return how high the target's centre of mass is."""
        center = self.problem.target.body.center_of_mass_m[None]
        return float(transform_points(execution.target_to_world(), center)[0, 2])

    def check_held(self, execution: Execution) -> None:
        """Raise Ended where the fingers have lost the target."""
        if not min(execution.touches.finger_forces_n) > 0:
            raise Ended("dropped")

    def measure_slip(self, plan: Grasped, execution: Execution) -> None:
        """Take down how far the target has moved in the hand."""
        planned, measured = inverse(plan.gripper_to_object), inverse(execution.gripper_to_object())
        self.facts.slip_m = moved_m(planned, measured, self.problem.target.body.center_of_mass_m)
