"""The configuration of a folder of episodes: what is no such folder is called by what it is."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.engine.ledger.location import CONFIG
from manitwin.episodes.configuration import read_configuration
from manitwin.errors import EpisodesError


def test_a_data_set_is_called_one(tmp_path: Path) -> None:
    (tmp_path / CONFIG).write_text('{"run": {}}')
    (tmp_path / "twins").mkdir()
    with pytest.raises(
        EpisodesError, match="a data set of twins, not of episodes; run manitwin trajectories again, or"
    ):
        read_configuration(tmp_path)


def test_what_is_missing_is_named(tmp_path: Path) -> None:
    (tmp_path / CONFIG).write_text('{"run": {}}')
    with pytest.raises(EpisodesError, match=r"config\.json: not a configuration of episodes \(robot: "):
        read_configuration(tmp_path)
