"""Drawn scenes, made once."""

from __future__ import annotations

from pathlib import Path

import pytest

from drawn_scenes import write_drawn_scenes
from manitwin.scenes.perception.scene_truth import SceneTruth, read_scene_truth
from manitwin.scenes.scene_files import scene_files


@pytest.fixture(scope="package")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of two drawn scenes; tests only read it."""
    return write_drawn_scenes(tmp_path_factory.mktemp("drawn"))


@pytest.fixture(scope="package")
def truths(scenes: Path) -> list[SceneTruth]:
    """Their truth."""
    return [read_scene_truth(file) for file in scene_files(scenes)]
