"""Configuration (config.json) of an episodes folder, as far as other commands use it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import BaseModel, ConfigDict, FiniteFloat, ValidationError

from manitwin.engine.ledger.location import CONFIG
from manitwin.errors import EpisodesError
from manitwin.formats.json_file import read_json_object
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import TWINS

_REMEDY = "run manitwin trajectories again, or give the folder that it wrote"


class _Kept(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True)

    max_placed_m: FiniteFloat
    max_tilt_deg: FiniteFloat


class _Configuration(BaseModel):
    model_config = ConfigDict(extra="ignore", strict=True)

    robot: str
    dataset: str
    scenes: str | None
    skill: str
    seed: int
    episode: _Kept
    retire_failed_share: FiniteFloat


def read_configuration(episodes: Path) -> dict[str, Any]:
    """Return the configuration of an episodes folder; raises EpisodesError if it is missing or of another kind."""
    path = episodes / CONFIG
    said = read_json_object(path, EpisodesError, inside=episodes, name=str(path), remedy=_REMEDY)
    if (episodes / TWINS).is_dir():
        raise EpisodesError(f"{episodes}: a data set of twins, not of episodes; {_REMEDY}")
    try:
        _Configuration.model_validate(said)
    except ValidationError as error:
        first = error.errors()[0]
        where = printable_line(".".join(map(str, first["loc"])), max_characters=80)
        raise EpisodesError(f"{path}: not a configuration of episodes ({where}: {first['msg']}); {_REMEDY}") from error
    return said
