"""The settings of what is made of twins: given, or of a TOML file."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from manitwin.errors import UsageError

if TYPE_CHECKING:
    from manitwin.episodes.settings import PicturesConfig, TasksConfig, TrajectoriesConfig
    from manitwin.scenes.settings import LayoutsConfig

Settings = TypeVar("Settings", "LayoutsConfig", "TasksConfig", "TrajectoriesConfig", "PicturesConfig")


def settings_of(kind: type[Settings], config: Settings | str | Path | None, jobs: int | None) -> Settings:
    """Return an application's settings: given, of a TOML file, or the default ones; raises ConfigError and UsageError."""
    from manitwin.config import MOST_SLOTS, load_config

    if jobs is not None and not 1 <= jobs <= MOST_SLOTS:
        raise UsageError(f"jobs is {jobs:.6g}; give 1 to {MOST_SLOTS}")
    settings = (
        config if isinstance(config, kind) else kind() if config is None else load_config(Path(str(config)), kind)
    )
    if jobs is None:
        return settings
    return settings.model_copy(update={"run": settings.run.model_copy(update={"cpu": jobs})})
