"""The names that options know are those of the modules that take seconds to import."""

from __future__ import annotations

from typing import get_args

import pytest

from manitwin.assets.read import FORMATS as ASSET_FORMATS
from manitwin.assets.writers.registry import formats
from manitwin.cli import option_values
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
        (option_values.UNITS, set(get_args(StatedUnit))),
        (option_values.UP, set(get_args(Up))),
        (option_values.EXECUTORS, set(EXECUTORS)),
        (option_values.GRIPPERS, set(shipped_grippers())),
        (option_values.ROBOTS, {*shipped_robots(), *shipped_two_arms()}),
        (option_values.SKILLS, set(skill_names())),
        (option_values.SURFACES, literal(LayoutSettings, "surface")),
        (option_values.CLUTTER, literal(LayoutSettings, "clutter")),
        (option_values.CODECS, literal(PicturesConfig, "codec")),
        (option_values.RATES_HZ, {str(rate) for rate in literal(PicturesConfig, "rate_hz")}),
        (option_values.EPISODE_FORMATS, set(collect.FORMATS)),
        (option_values.EXPORT_FORMATS, {"all", *formats()}),
        (option_values.SEGMENTATION_FORMATS, set(SEGMENTATIONS)),
        (option_values.VQA_FORMATS, set(QUESTION_FORMATS)),
        (option_values.POINT_CONVENTIONS, set(CONVENTIONS)),
        (option_values.IMPORT_FORMATS, {"auto", *ASSET_FORMATS}),
        (option_values.QUERY_FORMATS, set(WRITERS)),
        (option_values.TABLES, set(TABLES)),
        (option_values.SERVED_KINDS, set(KINDS)),
        (option_values.REHEARSALS, set(REHEARSALS)),
        (option_values.ANNOTATORS, set(backends()["annotator"])),
        (option_values.GENERATORS, set(backends()["generator"])),
        (option_values.MATTING, {"none", *KNOWN_WEIGHTS}),
        (option_values.WEIGHTS, set(KNOWN_WEIGHTS)),
        (option_values.GRASPERS, set(backends()["grasper"])),
    ],
    ids=lambda value: value.kind if isinstance(value, option_values.Choices) else "",
)
def test_names_are_those_of_the_module_that_they_are_for(said: option_values.Choices, known: set[str]) -> None:
    assert set(said.find()) == known


def test_every_camera_that_is_named_can_be_placed() -> None:
    names = tuple(option_values.CAMERAS.find())
    assert [camera.name for camera in named_cameras(names, load_robot("panda"))] == list(names)


def test_wrong_name_is_refused_with_the_nearest_and_a_file_is_left_to_its_reader() -> None:
    with pytest.raises(UsageError, match=r"unknown gripper 'pandas'; did you mean 'panda'\?"):
        option_values.GRIPPERS.check(["panda", "pandas"])
    assert option_values.GRIPPERS.check(["mine.toml", "panda"]) == ["mine.toml", "panda"]
    assert option_values.ANNOTATORS.check("openai:model@http://localhost:8000/v1")
    assert option_values.GENERATORS.check("command:python make.py") and option_values.GRASPERS.check(None) is None


def test_each_gripper_may_be_named_once() -> None:
    with pytest.raises(UsageError, match="name each only once"):
        option_values.GRIPPERS.check(["panda", "panda"])


def test_list_by_commas_is_checked_and_completed_name_by_name() -> None:
    assert option_values.EXPORT_FORMATS.check("MJCF, usd") == "MJCF, usd"
    with pytest.raises(UsageError, match="did you mean 'mjcf'"):
        option_values.EXPORT_FORMATS.check("usd,mjfc")
    assert option_values.EXPORT_FORMATS.complete("usd,u") == ["usd,urdf", "usd,usdz"], (
        "a name that is there is not offered"
    )
