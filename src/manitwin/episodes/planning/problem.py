"""Input and output of the planner: problem, settings, plan with its motions, and failure reasons."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal, Protocol, get_args

import numpy as np

from manitwin.geometry.rigid_body import PlacedObject, StaticBox

PlanFailure = Literal[
    "weight_not_borne", "blocks_function", "outside_workspace", "no_inverse_kinematics", "approach_blocked", "lift_blocked",
    "place_unreachable", "lower_blocked", "retreat_blocked", "path_unreachable", "path_blocked", "path_slow", "taker_blocked",
    "no_path", "no_time_parameterization",
]  # fmt: skip


class Phase(IntEnum):
    """Phase of an episode; the numbers are part of the recorded format.

    ACT is the skill's own motion with the held object (or the closed hand), HOLD is waiting, RETURN is the way back.
    """

    REACH = 0
    APPROACH = 1
    CLOSE = 2
    LIFT = 3
    CARRY = 4
    LOWER = 5
    OPEN = 6
    RETREAT = 7
    REST = 8
    ACT = 9
    HOLD = 10
    RETURN = 11


@dataclass(frozen=True)
class Grasp:
    """A grasp for planning: ``gripper_to_object (4, 4)`` in the grasp frame, and the width between the pads.

    ``joints_rad (2, J)`` are a multi-finger hand's joints before closing and the closing goal; None for other hands.
    ``opening_m`` is the opening of jaws before closing and after release; None: fully open.
    """

    grasp_id: str
    gripper_to_object: np.ndarray
    width_m: float
    joints_rad: np.ndarray | None = None
    opening_m: float | None = None


@dataclass(frozen=True)
class PickPlaceProblem:
    """Move ``target`` to ``goal_object_to_world`` with the first feasible of ``grasps``.

    ``static_boxes`` are the furniture, ``fixtures`` the boxes that a skill interacts with; both are static. ``entered`` are
    the names of obstacles that the held object enters, ``level`` those of objects to be carried level if possible
    (``must_stay_level``).
    """

    target: PlacedObject
    goal_object_to_world: np.ndarray
    grasps: tuple[Grasp, ...]
    obstacles: tuple[PlacedObject, ...] = ()
    static_boxes: tuple[StaticBox, ...] = ()
    seed: int = 0
    fixtures: tuple[StaticBox, ...] = ()
    entered: frozenset[str] = frozenset()
    level: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Motion:
    """Joint positions and velocities ``(T, n)`` at the simulation's time step, from rest to rest."""

    phase: Phase
    positions_rad: np.ndarray
    velocities_rad_s: np.ndarray


class GraspingPlan(Protocol):
    """Interface of a plan that states how it holds the target."""

    @property
    def grasp(self) -> Grasp:
        """The grasp that it uses."""
        ...

    @property
    def gripper_to_object(self) -> np.ndarray:
        """The pose ``(4, 4)`` of the grasp as used."""
        ...


@dataclass(frozen=True)
class PickPlacePlan:
    """Motions of one grasp: reach, approach, (close), lift, carry, lower, (open), retreat.

    ``gripper_to_object`` is the pose as used: that of ``grasp``, or an equivalent rotation of it about the approach axis.
    """

    grasp: Grasp
    gripper_to_object: np.ndarray
    reach: Motion
    approach: Motion
    lift: Motion
    carry: Motion
    lower: Motion
    retreat: Motion


@dataclass
class PlanReport:
    """A plan or None, the number of grasps tried, and the failures of those that were infeasible."""

    plan: PickPlacePlan | None
    tried: int
    failures: Counter[PlanFailure] = field(default_factory=Counter)


def later_failure(first: PlanFailure, second: PlanFailure) -> PlanFailure:
    """Return the failure that occurs later in planning, which is the more informative of two."""
    return max(first, second, key=get_args(PlanFailure).index)


@dataclass(frozen=True)
class PlannerSettings:
    """Planner settings: lengths in metres, effort in counts, so that results do not depend on time.

    ``margin_m`` is kept in free motion, and reduced in steps down to ``clearance_m`` if start or goal are closer;
    ``clearance_m`` is kept on straight lines. Defaults: 10 mm of margin, so that no thin part passes between two checks of a
    path (every 0.02 rad); 10 cm approach, 12 cm lift.
    """

    approach_m: float = 0.10
    lift_m: float = 0.12
    margin_m: float = 0.010
    clearance_m: float = 0.001
    check_step_rad: float = 0.02
    check_step_m: float = 0.005
    search_step_rad: float = 0.05
    extension_rad: float = 1.0
    iterations: int = 400
    shortcuts: int = 30
    max_grasps: int = 40
    starts: int = 6
    solutions: int = 2
