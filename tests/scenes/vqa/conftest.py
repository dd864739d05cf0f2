"""Questions about two drawn scenes, made once."""

from __future__ import annotations

from pathlib import Path

import pytest

from drawn_scenes import write_drawn_scenes
from manitwin.scenes.scene_files import scene_files
from manitwin.scenes.vqa.question import Question
from manitwin.scenes.vqa.write import generate_questions


@pytest.fixture(scope="package")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder of two drawn scenes; tests only read it."""
    return write_drawn_scenes(tmp_path_factory.mktemp("asked"))


@pytest.fixture(scope="package")
def questions(scenes: Path) -> list[Question]:
    """As many questions about them as there are."""
    return generate_questions(scene_files(scenes), per_scene=120, validation_share=0.0)[0]
