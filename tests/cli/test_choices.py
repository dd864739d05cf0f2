"""The names that options know are those of the modules that take seconds to import."""

from __future__ import annotations

from typing import get_args

import pytest

from manitwin.assets.read import FORMATS as ASSET_FORMATS
from manitwin.assets.writers.registry import formats
from manitwin.cli import choices
from manitwin.cli.commands.doctor import KINDS
from manitwin.cli.commands.query import WRITERS
from manitwin.dataset.index.tables import TABLES
from manitwin.engine.drive import EXECUTORS
from manitwin.episodes import collect
from manitwin.episodes.cameras import named_cameras
from manitwin.episodes.settings import PicturesConfig
from manitwin.episodes.skills.registry import skill_names
from manitwin.errors import UsageError
from manitwin.geometry.length_unit import StatedUnit
from manitwin.models.fakes.catalog import REHEARSALS
from manitwin.models.registry import backends
from manitwin.models.weights.catalog import KNOWN_WEIGHTS
from manitwin.pipeline.manifest_item import Up
from manitwin.robots.grippers.gripper import shipped_grippers
from manitwin.robots.load import load_robot, shipped_robots, shipped_two_arms
from manitwin.scenes.perception.segmentation import FORMATS as SEGMENTATIONS
from manitwin.scenes.settings import LayoutSettings
from manitwin.scenes.vqa.formats import FORMATS as QUESTION_FORMATS
from manitwin.scenes.vqa.wording import CONVENTIONS


def literal(section: type, name: str) -> set[str]:
    return set(get_args(section.model_fields[name].annotation))  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("said", "known"),
    [
        (choices.UNITS, set(get_args(StatedUnit))),
        (choices.UP, set(get_args(Up))),
        (choices.EXECUTORS, set(EXECUTORS)),
        (choices.GRIPPERS, set(shipped_grippers())),
        (choices.ROBOTS, {*shipped_robots(), *shipped_two_arms()}),
        (choices.SKILLS, set(skill_names())),
        (choices.SURFACES, literal(LayoutSettings, "surface")),
        (choices.CLUTTER, literal(LayoutSettings, "clutter")),
        (choices.CODECS, literal(PicturesConfig, "codec")),
        (choices.RATES_HZ, {str(rate) for rate in literal(PicturesConfig, "rate_hz")}),
        (choices.EPISODE_FORMATS, set(collect.FORMATS)),
        (choices.EXPORT_FORMATS, {"all", *formats()}),
        (choices.SEGMENTATION_FORMATS, set(SEGMENTATIONS)),
        (choices.VQA_FORMATS, set(QUESTION_FORMATS)),
        (choices.POINT_CONVENTIONS, set(CONVENTIONS)),
        (choices.IMPORT_FORMATS, {"auto", *ASSET_FORMATS}),
        (choices.QUERY_FORMATS, set(WRITERS)),
        (choices.TABLES, set(TABLES)),
        (choices.SERVED_KINDS, set(KINDS)),
        (choices.REHEARSALS, set(REHEARSALS)),
        (choices.ANNOTATORS, set(backends()["annotator"])),
        (choices.GENERATORS, set(backends()["generator"])),
        (choices.MATTING, {"none", *KNOWN_WEIGHTS}),
        (choices.WEIGHTS, set(KNOWN_WEIGHTS)),
        (choices.GRASPERS, set(backends()["grasper"])),
    ],
    ids=lambda value: value.kind if isinstance(value, choices.Choices) else "",
)
def test_names_are_those_of_the_module_that_they_are_for(said: choices.Choices, known: set[str]) -> None:
    assert set(said.find()) == known


def test_every_camera_that_is_named_can_be_placed() -> None:
    names = tuple(choices.CAMERAS.find())
    assert [camera.name for camera in named_cameras(names, load_robot("panda"))] == list(names)


def test_wrong_name_is_refused_with_the_nearest_and_a_file_is_left_to_its_reader() -> None:
    with pytest.raises(UsageError, match=r"unknown gripper 'pandas'; did you mean 'panda'\?"):
        choices.GRIPPERS.check(["panda", "pandas"])
    assert choices.GRIPPERS.check(["mine.toml", "panda"]) == ["mine.toml", "panda"]
    assert choices.ANNOTATORS.check("openai:model@http://localhost:8000/v1")
    assert choices.GENERATORS.check("command:python make.py") and choices.GRASPERS.check(None) is None


def test_each_gripper_may_be_named_once() -> None:
    with pytest.raises(UsageError, match="name each only once"):
        choices.GRIPPERS.check(["panda", "panda"])


def test_list_by_commas_is_checked_and_completed_name_by_name() -> None:
    assert choices.EXPORT_FORMATS.check("MJCF, usd") == "MJCF, usd"
    with pytest.raises(UsageError, match="did you mean 'mjcf'"):
        choices.EXPORT_FORMATS.check("usd,mjfc")
    assert choices.EXPORT_FORMATS.complete("usd,u") == ["usd,urdf", "usd,usdz"], "a name that is there is not offered"
