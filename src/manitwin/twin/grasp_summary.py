"""Schema of grasp results: success counts, the settings of the trial, and the confirmation by a second engine."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from manitwin.twin.record_values import Finite, Record, Unit

Outcome = Literal["held", "collides", "unreachable", "misses", "penetrates", "drops", "unstable", "slips"]


class Trial(Record):
    """The settings of the grasp trial, without which a success rate has no meaning.

    ``timestep_s`` is the engine's setting for objects that are not light. If ``doubts_tried_again``, grasps that failed or just
    held were tried again with steps of 1/960 s and 40 iterations. ``confirmed_by`` is the engine that must confirm grasps in
    which the object moved; None if there is no such engine.
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
    """Agreement with a second engine: on successful grasps, some failed ones, and jittered copies of successful ones as controls.

    ``kappa`` is Cohen's kappa over the jittered grasps only: among grasps that nearly all hold, agreement means little.
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
    """The perturbed trials of successful grasps, and how many survive.

    ``median`` is the median of the grasps' success shares. ``robust`` counts the grasps for which the sequential test prefers a
    success probability of ``robust_share`` to one of ``fragile_share``.
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
    """Outcome counts by type of the associated grasp point (``no point``: none) and by the part that is held (``no part``:
    none).
    """

    by_grasp_type: dict[str, dict[str, int]]
    by_region: dict[str, dict[str, int]]


class GraspSummary(Record):
    """The results for one gripper; ``link`` is the link that both fingertips of each grasp touch, if one was chosen."""

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
    """The results for another gripper: a summary, or the reason why there is none; and how many grasp points transfer to it.

    ``transferred`` counts the grasp points with successful grasps of both grippers, out of ``transferable`` points at which the
    first gripper succeeds.
    """

    summary: GraspSummary | None
    reason: str | None
    detail: str | None
    transferable: int
    transferred: int
