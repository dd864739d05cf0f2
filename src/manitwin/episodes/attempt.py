"""What became of one attempted episode: a row of the attempts table."""

from __future__ import annotations

from dataclasses import dataclass

OUTCOMES = (
    "kept", "unplanned_contact", "disturbed", "misplaced", "toppled", "dropped", "not_lifted", "replan_failed", "unsettled",
    "no_plan", "no_room",
)  # fmt: skip
"""``kept`` succeeded and touched nothing by accident; ``unplanned_contact`` and ``disturbed`` (another object moved by more than
1 cm or 5 degrees) succeeded otherwise; from ``misplaced`` to ``replan_failed`` the execution failed; ``unsettled`` is a start
that did not stand, ``no_room`` one that could not be set up; ``no_plan`` was never executed."""

EXECUTION_FAILURES = ("misplaced", "toppled", "dropped", "not_lifted", "replan_failed")


@dataclass(frozen=True)
class Attempt:
    """One row; errors are of the released object at rest against the goal that was asked for. None: never got there.

    ``plan_failures`` is JSON: how many candidate grasps failed of what.
    """

    episode_id: str
    robot: str
    skill: str
    twin_id: str
    category: str
    scene_id: str | None
    seed: int
    others: int
    outcome: str
    grasp_id: str | None
    grasp_type: str | None
    transferred: bool
    grasps_tried: int
    plan_failures: str
    position_error_m: float | None
    tilt_rad: float | None
    yaw_error_rad: float | None
    slip_m: float | None
    length_s: float | None
    instructions: tuple[str, ...]

    @property
    def planned(self) -> bool:
        """Whether a plan was found, so that it was executed."""
        return self.outcome not in ("no_plan", "no_room", "unsettled")

    @property
    def succeeded(self) -> bool:
        """Whether the object stands where it should, whatever was touched on the way."""
        return self.outcome in ("kept", "unplanned_contact", "disturbed")
