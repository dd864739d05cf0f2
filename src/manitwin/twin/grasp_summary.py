"""The part of the schema about grasps: how many held, of what trial, and what a second engine says of them."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from manitwin.twin.record_values import Finite, Record, Unit

Outcome = Literal["held", "collides", "unreachable", "misses", "penetrates", "drops", "unstable", "slips"]


class Trial(Record):
    """The settings of the grasp trial: a success rate means nothing without them.

    ``timestep_s`` is the engine's own for what is not light. Where ``doubts_tried_again``, what fell or was just held was tried
    again at 1/960 s and with 40 iterations. ``confirmed_by`` is the engine that has to hold, too, a grasp in
    which the object moved; None where there is none.
    """

    engine: str
    finger_friction: Finite
    object_friction: Finite
    combine: str
    force_n: Finite
    timestep_s: Finite
    solver_iterations: int
    max_steps: int
    stable_frames: int
    max_displacement_m: Finite
    slide_distance_m: Finite
    confirmed_by: str | None = None
    doubts_tried_again: bool = False


class SecondOpinion(Record):
    """The agreement of a second engine: over grasps that held, some that failed, and jittered controls of those that held.

    Kappa is Cohen's over the jittered alone: among grasps that nearly all hold, agreement says little.
    """

    engine: str
    held_tried: int
    holds_share: Unit | None
    failed_tried: int
    failed_pass_share: Unit | None
    jittered: int
    jittered_held: int
    jittered_hold_in_second_engine: int
    jittered_agree: int
    kappa: Finite | None


class RobustnessSummary(Record):
    """The perturbed trials of the held grasps, and how many survive.

    ``median`` is that of the grasps' shares; ``robust`` counts those that rather hold in ``robust_share`` of the cases than
    in ``fragile_share`` (the sequential test's verdict).
    """

    pose_m: Finite
    pose_deg: Finite
    friction: tuple[Finite, Finite]
    force: tuple[Finite, Finite]
    mass_kg: tuple[Finite, Finite]
    center_of_mass_m: Finite
    max_trials: int
    trials: int
    median: Unit | None
    robust: int
    robust_share: Unit
    fragile_share: Unit


class FailureTable(Record):
    """Outcomes by the type of the grasp point that is served (``no point``: none) and by the part that is held (``no part``)."""

    by_grasp_type: dict[str, dict[str, int]]
    by_region: dict[str, dict[str, int]]


class GraspSummary(Record):
    """The outcomes of the grasps of one gripper; ``link``: the one that both fingertips of each touch, where one was chosen."""

    gripper: str
    gripper_sha256: str
    proposed: int
    proposed_by_filter: dict[str, int]
    simulated: int
    verified: int
    success_rate: Unit
    unfiltered_simulated: int
    unfiltered_success_rate: Unit | None
    failures: dict[str, int]
    approach_octants: int
    file: str
    association_radius_m: Finite
    association_radius_widened: bool
    share_beyond_3cm: Unit
    trial: Trial
    failure_table: FailureTable
    second_opinion: SecondOpinion | None
    robustness: RobustnessSummary | None
    other_grippers: dict[str, OtherGripper] = Field(default_factory=dict)
    link: str | None = None


class OtherGripper(Record):
    """The outcomes of the grasps of another gripper: a summary, or the reason for none; and what it can hold of the first's.

    ``transferred`` counts the grasp points by which the first gripper holds the object and this one does too, of
    ``transferable``.
    """

    summary: GraspSummary | None
    reason: str | None
    detail: str | None
    transferable: int
    transferred: int
