"""Resolve the settings of layouts, tasks, episodes and videos."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

from manitwin.errors import UsageError

if TYPE_CHECKING:
    from manitwin.episodes.settings import PicturesConfig, TasksConfig, TrajectoriesConfig
    from manitwin.scenes.settings import LayoutsConfig

Settings = TypeVar("Settings", "LayoutsConfig", "TasksConfig", "TrajectoriesConfig", "PicturesConfig")


def settings_of(kind: type[Settings], config: Settings | str | Path | None, jobs: int | None) -> Settings:
    """Return settings of type ``kind`` from an instance, a TOML file, or the defaults; ``jobs`` overrides ``run.cpu``.

    Raises ConfigError for an invalid file and UsageError for an invalid ``jobs``.
    """
    from manitwin.config import MOST_SLOTS, load_config

    if jobs is not None and not 1 <= jobs <= MOST_SLOTS:
        raise UsageError(f"jobs is {jobs:.6g}; give 1 to {MOST_SLOTS}")
    settings = (
        config if isinstance(config, kind) else kind() if config is None else load_config(Path(str(config)), kind)
    )
    if jobs is None:
        return settings
    return settings.model_copy(update={"run": settings.run.model_copy(update={"cpu": jobs})})
