"""Settings of episodes, tasks and pictures, as frozen sections like those of a build."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, model_validator

from manitwin.config import RunConfig, Section, Seed
from manitwin.geometry.rigid_body import FURNITURE_FRICTION
from manitwin.scenes.settings import application_run

HANDOVER, TWO_ARMS = "handover", "two_pandas"
"""The two-arm skill, and the robot used for it by default."""


class EpisodeSettings(Section):
    """Physics of an episode, and success criteria (metres, seconds, newtons; angles in degrees).

    ``closing_force_n``: by default the gripper's own. ``solver_iterations_held`` are the iterations while an object is held:
    24 at 1/120 s are as good as 40 at 1/240 s, and 12 drop some objects (docs/measured/robot_data.md). ``release_height_m``
    is the height above its goal at which an object is released. An object within ``max_placed_m`` and ``max_tilt_deg`` of its
    goal is placed correctly, if it moves by no more than ``max_rest_*`` in half a second. ``max_start_*`` limits the motion
    of objects while the start settles, ``max_disturbed_*`` that of the other objects, and ``max_partner_moved_m`` that of the
    goal's second object.
    """

    timestep_s: float = Field(default=1 / 120, gt=0)
    solver_iterations: int = Field(default=10, ge=1)
    solver_iterations_held: int = Field(default=24, ge=1)
    contact_offset_m: float = Field(default=0.001, gt=0)
    furniture_friction: float = Field(default=FURNITURE_FRICTION, ge=0)
    closing_force_n: float | None = Field(default=None, gt=0)
    release_height_m: float = Field(default=0.001, ge=0, le=0.02)
    max_settle_s: float = Field(default=1.0, ge=0)
    max_rest_s: float = Field(default=2.0, gt=0)
    max_placed_m: float = Field(default=0.02, gt=0)
    max_tilt_deg: float = Field(default=10.0, gt=0, lt=180)
    max_rest_m: float = Field(default=0.001, gt=0)
    max_rest_deg: float = Field(default=0.5, gt=0, lt=180)
    max_start_m: float = Field(default=0.01, gt=0)
    max_start_deg: float = Field(default=5.0, gt=0, lt=180)
    max_disturbed_m: float = Field(default=0.01, gt=0)
    max_disturbed_deg: float = Field(default=5.0, gt=0, lt=180)
    max_partner_moved_m: float = Field(default=0.02, gt=0)
    max_contact_force_n: float = Field(default=0.5, ge=0)


class TrajectoriesConfig(Section):
    """Settings that determine the episodes made from twins or scenes.

    ``robot`` is a name or a TOML file; for a handover the default is ``two_pandas``. ``others`` further objects are placed if
    twins and no scenes are given. ``batch`` episodes of one object are made by one worker, and lost with it. Grasps of which
    more than ``retire_failed_share`` of the executions failed are retired.
    """

    seed: Seed = 0
    robot: str = "panda"
    skill: str = "pick_place"
    others: int = Field(default=0, ge=0, le=20)
    batch: int = Field(default=10, ge=1)
    retire_failed_share: float = Field(default=1 / 3, ge=0, lt=1)
    episode: EpisodeSettings = EpisodeSettings()
    run: RunConfig = Field(default_factory=application_run)

    @model_validator(mode="before")
    @classmethod
    def _with_two_arms(cls, data: Any) -> Any:
        if isinstance(data, dict) and data.get("skill") == HANDOVER:
            return {"robot": TWO_ARMS, **data}
        return data


class TasksConfig(Section):
    """Settings of tasks sampled in scenes.

    Each scene gets ``per_scene`` tasks, a share ``two_literal_share`` of them with two literals, and at most a share
    ``most_of_kind`` of one kind. After ``tries_of_kind`` infeasible candidates of a kind, the rest of the kind is skipped.
    ``vlm`` proposes up to ``proposals`` tasks per scene: ``openai:MODEL@URL``, ``anthropic:MODEL``, ``replay:FILE``, or
    ``none``.
    """

    seed: Seed = 0
    robot: str = "panda"
    per_scene: int = Field(default=20, ge=1, le=1000)
    two_literal_share: float = Field(default=0.25, ge=0, le=1)
    most_of_kind: float = Field(default=0.3, gt=0, le=1)
    tries_of_kind: int = Field(default=12, ge=1)
    vlm: str = "none"
    proposals: int = Field(default=8, ge=1, le=100)
    episode: EpisodeSettings = EpisodeSettings()
    run: RunConfig = Field(default_factory=application_run)


class PicturesConfig(Section):
    """Settings of the pictures of episodes.

    ``av1`` and ``vp9`` play in browsers; ``vp9`` also plays in older ones, but takes ten times as long to encode. ``mpeg4``
    plays in none. ``rate_hz`` is the rate of pictures, states and actions of the LeRobot set: every second state at 10, every
    fourth at 5.
    """

    cameras: tuple[str, ...] = ("front", "wrist")
    size_px: int = Field(default=256, ge=64, le=2048)
    codec: Literal["av1", "vp9", "mpeg4"] = "av1"
    rate_hz: Literal[20, 10, 5] = 20
    run: RunConfig = Field(default_factory=application_run)
