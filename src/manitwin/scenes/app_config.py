"""The configuration of what twins are used for: frozen sections, like those of a build."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field, model_validator

from manitwin.config import RunConfig, Section, read_toml, validated
from manitwin.geometry.rigid_body import FURNITURE_FRICTION

Application = TypeVar("Application", bound=Section)


def _application_run() -> RunConfig:
    return RunConfig(index_every=0, keep_work=False)


class EpisodeSettings(Section):
    """The physics of an episode, and what counts as success (metres, seconds, newtons; angles in degrees).

    ``closing_force_n``: without it the gripper's own. ``solver_iterations_held`` are those while something is held: 24 at
    1/120 s do as well as 40 at 1/240 s, and 12 drop some (docs/measured.md).
    ``release_height_m`` is how far above its goal an object is let go. What moved less than ``max_placed_m`` and tilted less
    than ``max_tilt_deg`` from its goal stands where it should, if it moves by no more than ``max_rest_*`` in half a second;
    ``max_start_*`` is what a start may move until it rests,
    ``max_disturbed_*`` what may happen to the other objects.
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
    max_contact_force_n: float = Field(default=0.5, ge=0)


class LayoutSettings(Section):
    """What a layout holds, how close it stands, and what it may do as it settles (metres, seconds, degrees).

    ``objects`` is the least and the largest number. ``include`` names categories that must be there, one object for each
    mention; the others are distractors. ``stacked`` objects stand on others, ``contained`` ones lie in a vessel. Without
    ``min_gap_m`` the gap is that of the clutter level. ``upright``: what has an upright placement that stayed is put down in
    one; what has none comes as it rests. ``workspace`` is where the named robot, or any, reaches from above:
    least and largest radius about the origin, and half of the angle about +X. ``poses_tried`` bounds the places tried for an
    object, ``repairs`` how many objects are sampled again before the layout is given up.
    """

    objects: tuple[int, int] = (3, 12)
    surface: Literal["table", "shelf", "tray"] = "table"
    clutter: Literal["sparse", "medium", "dense"] = "medium"
    min_gap_m: float | None = Field(default=None, ge=0.001, le=0.5)
    include: tuple[str, ...] = ()
    stacked: int = Field(default=0, ge=0)
    contained: int = Field(default=0, ge=0)
    upright: bool = False
    robot: str | None = None
    workspace: tuple[float, float, float] | None = None
    poses_tried: int = Field(default=120, ge=1)
    repairs: int = Field(default=12, ge=0)
    settle_s: float = Field(default=3.0, gt=0, le=20)
    max_moved_m: float = Field(default=0.01, gt=0)
    max_turned_deg: float = Field(default=5.0, gt=0, lt=90)
    max_penetration_m: float = Field(default=0.001, gt=0)

    @model_validator(mode="after")
    def _possible(self) -> LayoutSettings:
        low, high = self.objects
        if not 1 <= low <= high:
            raise ValueError(f"objects is the least and the largest number, at least 1; it is {low} to {high}")
        needed = self.least_standing + self.stacked + self.contained
        if needed > high:
            raise ValueError(f"include, stacked and contained ask for {needed} objects or more; objects allows {high}")
        if self.workspace is not None:
            near, far, half_deg = self.workspace
            if not (0 <= near < far and 0 < half_deg <= 180):
                raise ValueError(
                    f"workspace is least radius, largest radius (m), half angle (deg); it is {self.workspace}"
                )
        return self

    @property
    def least_standing(self) -> int:
        """How many objects stand on the furniture at least: what is asked for, something below each stacked one, a vessel."""
        return max(len(self.include), self.stacked + min(self.contained, 1), 1)


class TrajectoriesConfig(Section):
    """Everything that decides what episodes are made of twins or scenes.

    ``robot`` is a name or a TOML file. ``others`` objects stand around where twins are given and no scenes. ``batch`` episodes
    of one object are made by one worker, and lost with it. Grasps of which more than ``retire_failed_share`` of the
    executions failed are retired.
    """

    seed: int = 0
    robot: str = "panda"
    skill: Literal["pick_place"] = "pick_place"
    others: int = Field(default=0, ge=0, le=20)
    batch: int = Field(default=10, ge=1)
    retire_failed_share: float = Field(default=1 / 3, ge=0, lt=1)
    episode: EpisodeSettings = EpisodeSettings()
    run: RunConfig = Field(default_factory=_application_run)


class LayoutsConfig(Section):
    """Everything that decides what layouts are made. ``pictures``: also a picture, depth, normals and ids of each camera."""

    seed: int = 0
    layout: LayoutSettings = LayoutSettings()
    pictures: bool = False
    picture_px: int = Field(default=512, ge=64, le=2048)
    run: RunConfig = Field(default_factory=_application_run)


class PicturesConfig(Section):
    """How recorded episodes are drawn. ``vp9`` plays in browsers; ``mpeg4`` does not, and takes a hundredth of the time."""

    cameras: tuple[str, ...] = ("front", "wrist")
    size_px: int = Field(default=256, ge=64, le=2048)
    codec: Literal["vp9", "mpeg4"] = "vp9"
    run: RunConfig = Field(default_factory=_application_run)


def load_app_config(kind: type[Application], file: Path | None, given: dict[str, Any]) -> Application:
    """Return an application's settings: a TOML file's, where one is named, below those ``given`` by hand.

    A given value that is None was not given; one that is a dict adds to its section. Raises ConfigError naming the file, or
    the command line, and the key.
    """
    said = {} if file is None else read_toml(file)
    validated(kind, said, str(file))
    for name, value in given.items():
        if isinstance(value, dict):
            said[name] = {**said.get(name, {}), **value}
        elif value is not None:
            said[name] = value
    return validated(kind, said, "the command line")
