"""Grasps: how they are proposed, tried, tried in a second engine, and tried under perturbations."""

from __future__ import annotations

from pydantic import Field, model_validator

from manitwin.config.section import Section


class GraspConfig(Section):
    """Proposals (paper, implementation details: 4,000 candidates, 3 cm, 7-DoF farthest point sampling to 100).

    ``on_support_share`` of those that are tried leave room for the plane of each placement that the object is picked from.
    At each grasp point ``least_per_point`` should hold: where they do not, up to ``tries_per_point`` more of those that a
    denser sample finds there are tried. ``link``: of a twin with joints, which are locked, both fingertips of each grasp touch
    this link (none: any).
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
    """The grasp trial (paper, "Simulation Verification": three stable frames, 1 cm, 2,000 steps); no force: the gripper's own.

    What falls, or is held only just, is tried again at 1/960 s and with 40 iterations where ``doubts_tried_again``.
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
    """The same grasps in a second engine: all that held, a share of those that failed, and jittered ones as controls.

    ``sample_of_held`` grasps that held, spread evenly over the directions of approach, stand for all of them (none: all are
    tried); the twin then says how far their share may be off.
    """

    enabled: bool = True
    sample_of_held: int | None = Field(default=None, ge=5)
    share_of_failed: float = Field(default=0.5, ge=0, le=1)
    jittered: int = Field(default=20, ge=0)
    jitter_deg: float = Field(default=20.0, ge=0)
    jitter_m: float = Field(default=0.012, ge=0)
    require_agreement: bool = False


class RobustnessConfig(Section):
    """Held grasps tried again under perturbations (uniform), until a sequential test tells robust from fragile ones.

    ``friction`` and ``force`` are factors; mass and centre of mass vary within the twin's own Estimates.
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
