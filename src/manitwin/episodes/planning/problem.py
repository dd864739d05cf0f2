"""The planner's input and output: a problem, its settings, a plan with its motions, and why there is none."""

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
    """The phase of an episode; the numbers are part of the recorded format.

    ACT is what a skill does with what it holds (or with the closed hand), HOLD is to stay there, RETURN the way back.
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
    """A grasp as the planner takes it: ``gripper_to_object (4, 4)`` in the twin's grasp frame, and the width between the pads.

    ``joints_rad (2, J)`` are a hand's joints before closing and those to close to; None: it has none of its own.
    ``opening_m`` is how far jaws are apart before they close and once they let go; None: as far as they open.
    """

    grasp_id: str
    gripper_to_object: np.ndarray
    width_m: float
    joints_rad: np.ndarray | None = None
    opening_m: float | None = None


@dataclass(frozen=True)
class PickPlaceProblem:
    """Move ``target`` to ``goal_object_to_world``, upright as it stands, with the first of ``grasps`` that can be planned.

    ``static_boxes`` are the furniture, ``fixtures`` the boxes that a skill works with; nothing of either moves.
    ``entered`` are the names of obstacles that what is held goes into, ``level`` those of objects that are carried
    level where that can be planned (``kept_level``).
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
    """Joint positions and velocities ``(T, n)`` at the simulation's timestep, from rest to rest."""

    phase: Phase
    positions_rad: np.ndarray
    velocities_rad_s: np.ndarray


class Grasped(Protocol):
    """The protocol of a plan that says how it holds the target."""

    @property
    def grasp(self) -> Grasp:
        """The candidate that it is of."""
        ...

    @property
    def gripper_to_object(self) -> np.ndarray:
        """The grasp's pose ``(4, 4)`` that is used."""
        ...


@dataclass(frozen=True)
class PickPlacePlan:
    """One grasp's motions: reach, approach, (close), lift, carry, lower, (open), retreat.

    ``gripper_to_object`` is the grasp that is used: a candidate, or the same turned by 180 degrees about the approach axis.
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
    """A plan or none, with what the candidates that were tried failed of, and what it took."""

    plan: PickPlacePlan | None
    tried: int
    failures: Counter[PlanFailure] = field(default_factory=Counter)


def later(first: PlanFailure, second: PlanFailure) -> PlanFailure:
    """Return the failure that came later on the way to a plan: the more telling one of two attempts."""
    return max(first, second, key=get_args(PlanFailure).index)


@dataclass(frozen=True)
class PlannerSettings:
    """Lengths in metres, work in counts: no clock decides what is found.

    ``margin_m`` is kept in free motion, and lowered step by step to ``clearance_m`` where start or goal are nearer;
    ``clearance_m`` is kept on straight lines. Defaults: 10 mm of margin, so that no thin part passes between two
    checks of a path (every 0.02 rad); 10 cm approach, 12 cm lift.
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
