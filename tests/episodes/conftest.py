"""Twins of four licences, a run of episodes with them, and its publication under two of the licences."""

from __future__ import annotations

from pathlib import Path

import pytest
from publishable_run import write_run, write_twins

from manitwin.episodes.publication.publish import PublishedEpisodes, publish_episodes


@pytest.fixture(scope="session")
def twins(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("private") / "cups"
    write_twins(root)
    return root


@pytest.fixture(scope="session")
def run(twins: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("runs") / "episodes"
    write_run(root, twins, drawn=True)
    return root


@pytest.fixture(scope="session")
def published(run: Path, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, PublishedEpisodes]:
    out = tmp_path_factory.mktemp("out") / "cups"
    return out, publish_episodes(run, out, license_allow=["cc-by-4.0", "CC0-1.0"])
