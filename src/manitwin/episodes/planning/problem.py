"""A pick-and-place problem, and its plan: the border between what samples scenes, what plans, and what executes."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Literal

import numpy as np

from manitwin.geometry.rigid_body import PlacedObject, StaticBox


class Phase(IntEnum):
    """What the robot is doing; the numbers are part of the recorded format."""

    REACH = 0
    APPROACH = 1
    CLOSE = 2
    LIFT = 3
    CARRY = 4
    LOWER = 5
    OPEN = 6
    RETREAT = 7
    REST = 8


@dataclass(frozen=True)
class Grasp:
    """A grasp as the planner takes it: ``gripper_to_object (4, 4)`` in the twin's grasp frame, and the width between the pads."""

    grasp_id: str
    gripper_to_object: np.ndarray
    width_m: float


@dataclass(frozen=True)
class PickPlaceProblem:
    """Move ``target`` to ``goal_object_to_world``, upright as it stands, with the first of ``grasps`` that can be planned."""

    target: PlacedObject
    goal_object_to_world: np.ndarray
    grasps: tuple[Grasp, ...]
    obstacles: tuple[PlacedObject, ...] = ()
    static_boxes: tuple[StaticBox, ...] = ()
    seed: int = 0


@dataclass(frozen=True)
class Motion:
    """Joint positions and velocities ``(T, n)`` at the simulation's timestep, from rest to rest."""

    phase: Phase
    positions_rad: np.ndarray
    velocities_rad_s: np.ndarray


PlanFailure = Literal[
    "outside_workspace", "no_inverse_kinematics", "approach_blocked", "lift_blocked", "place_unreachable", "lower_blocked",
    "retreat_blocked", "no_path", "no_time_parameterization",
]  # fmt: skip


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
