"""The configuration of what twins are used for: frozen sections, like those of a build."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal, TypeVar

from pydantic import Field

from manitwin.config import EpisodeSettings, LayoutSettings, RunConfig, Section, read_toml, validated

Application = TypeVar("Application", bound=Section)


def _application_run() -> RunConfig:
    return RunConfig(index_every=0, keep_work=False)


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
    """How recorded episodes are drawn. ``mpeg4`` is written 80 times as fast as ``vp9``, and browsers do not play it."""

    cameras: tuple[str, ...] = ("front", "wrist")
    size_px: int = Field(default=256, ge=64, le=2048)
    codec: Literal["mpeg4", "vp9"] = "mpeg4"
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
