"""Settings of grasps: proposal, physics trial, trial in a second engine, and robustness trials."""

from __future__ import annotations

from pydantic import Field, model_validator

from manitwin.config.section import Section


class GraspConfig(Section):
    """Grasp proposals (paper, implementation details: 4,000 candidates, 3 cm, 7-DoF farthest point sampling to 100).

    For each placement that the object is picked from, a share of ``on_support_share`` of the simulated grasps is chosen to
    clear the support plane, as far as there are any. Each grasp point should get ``least_per_point`` successful grasps: if
    it has fewer, up to ``tries_per_point`` further grasps from a denser sample are tried. ``link``: for articulated twins,
    whose joints are locked, both fingertips of each grasp must touch this link (none: any link).
    """

    max_proposals: int = Field(default=4000, ge=1)
    simulated: int = Field(default=100, ge=1)
    association_radius_m: float = Field(default=0.03, gt=0)
    unfiltered: int = Field(default=20, ge=0)
    raw_per_round: int = Field(default=8000, ge=8)
    rounds: int = Field(default=8, ge=1)
    scarce_rounds: int = Field(default=24, ge=1)
    near_enough: int = Field(default=600, ge=1)
    on_support_share: float = Field(default=0.4, ge=0, le=1)
    least_per_point: int = Field(default=10, ge=0)
    tries_per_point: int = Field(default=40, ge=0)
    link: str | None = Field(default=None, min_length=1)


class VerifyConfig(Section):
    """The grasp trial (paper, "Simulation Verification": three stable frames, 1 cm, 2,000 steps). No ``force_n``: the gripper's
    force.

    ``doubts_tried_again``: a grasp that fails or succeeds only just is tried again with steps of 1/960 s and 40 solver
    iterations.
    """

    force_n: float | None = Field(default=None, gt=0)
    timestep_s: float = Field(default=1 / 240, gt=0)
    solver_iterations: int = Field(default=20, ge=1)
    max_steps: int = Field(default=2000, ge=1)
    stable_frames: int = Field(default=3, ge=1)
    max_displacement_m: float = Field(default=0.01, gt=0)
    slide_distance_m: float = Field(default=0.1, gt=0)
    doubts_tried_again: bool = True


class SecondOpinionConfig(Section):
    """Trials in a second engine: all successful grasps, a share of the failed ones, and jittered grasps as negative controls.

    ``sample_of_held``: try only so many of the successful grasps, spread evenly over the approach directions (none: all of
    them); the twin then states the uncertainty of the estimated agreement.
    """

    enabled: bool = True
    sample_of_held: int | None = Field(default=None, ge=5)
    share_of_failed: float = Field(default=0.5, ge=0, le=1)
    jittered: int = Field(default=20, ge=0)
    jitter_deg: float = Field(default=20.0, ge=0)
    jitter_m: float = Field(default=0.012, ge=0)
    require_agreement: bool = False


class RobustnessConfig(Section):
    """Repeated trials of successful grasps under uniform perturbations, until a sequential test classifies them as robust or
    fragile.

    ``friction`` and ``force`` are factors; mass and centre of mass vary within the uncertainty of the twin's own estimates.
    """

    enabled: bool = True
    pose_m: float = Field(default=0.005, ge=0)
    pose_deg: float = Field(default=5.0, ge=0)
    friction: tuple[float, float] = (0.6, 1.4)
    force: tuple[float, float] = (0.5, 1.0)
    robust_share: float = Field(default=0.9, gt=0, lt=1)
    fragile_share: float = Field(default=0.5, gt=0, lt=1)
    error: float = Field(default=0.1, gt=0, lt=0.5)
    max_trials: int = Field(default=10, ge=1)

    @model_validator(mode="after")
    def _ordered(self) -> RobustnessConfig:
        for name, (low, high) in (("friction", self.friction), ("force", self.force)):
            if not 0 < low <= high:
                raise ValueError(f"{name} is a factor's lowest and highest value, above 0; it is {low:g} to {high:g}")
        if not self.fragile_share < self.robust_share:
            raise ValueError(f"fragile_share {self.fragile_share:g} is not below robust_share {self.robust_share:g}")
        return self
