"""Items that ended under another recipe, as after an upgrade: what is made again, what stays, and that the run says so."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pytest

from manitwin.config import RunConfig
from manitwin.engine.drive import RunReport, drive
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.store import read_record
from rehearsal_recipe import RehearsalRecipe

EARLIER = RehearsalRecipe(size=10)
NOW = replace(EARLIER, versions=(("b", "2"),))


@dataclass(frozen=True)
class Keeps(RehearsalRecipe):
    """A recipe of what others name by its id: nothing is replaced."""

    replaces = False


def built(place: Path, *texts: str, recipe: RehearsalRecipe = NOW) -> RunReport:
    items = [Item(file=None, text=text) for text in texts]
    return drive(recipe, items, DatasetRoot(place), RunConfig(patience_s=0), configuration={}, executor="inline")


def made_by(place: Path) -> list[str]:
    """Return by which recipe each twin was made, by its text."""
    folders = sorted(place.glob("twins/*/*"), key=lambda folder: (folder / "prompt.txt").read_text())
    return [read_record(folder).provenance.config_sha256 for folder in folders]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    assert built(tmp_path / "data", "mug", "spoon", recipe=EARLIER).exit_code == 0
    return tmp_path / "data"


def test_what_failed_is_tried_again_by_a_recipe_that_replaces_nothing(tmp_path: Path) -> None:
    built(tmp_path / "data", "mug", "raise:b", recipe=EARLIER)
    report = built(tmp_path / "data", recipe=Keeps(plan=(("a", "cpu"), ("c", "cpu")), size=10))
    assert report.counts["accepted"] == 2 and report.counts.get("failed", 0) == 0, "there was nothing to be replaced"
    assert [said[:22] for said in report.remarks] == ["1 existing items were "]


def test_without_inputs_all_are_made_again_and_the_run_says_why(place: Path) -> None:
    assert built(place).remarks == [
        "2 were made by another version of manitwin or with other settings: what would be another result now is made again"
    ]
    assert made_by(place) == [NOW.sha256] * 2
    assert built(place).remarks == []


def test_of_those_that_are_not_given_it_is_said_that_they_stay(place: Path) -> None:
    (said,) = built(place, "vase").remarks
    assert said.startswith(
        "2 items outside these inputs were made by another version of manitwin or with other settings, and stay"
    )
    assert made_by(place) == [EARLIER.sha256, EARLIER.sha256, NOW.sha256]
    remarks = built(place, "mug").remarks
    assert any(said.startswith("1 were made by another version") for said in remarks)
    assert any(said.startswith("1 items outside these inputs") for said in remarks)
    assert made_by(place) == [NOW.sha256, EARLIER.sha256, NOW.sha256]


@pytest.mark.parametrize("texts", [(), ("mug", "spoon"), ("mug", "vase")])
def test_a_recipe_that_replaces_nothing_leaves_them_whatever_is_given(place: Path, texts: tuple[str, ...]) -> None:
    recipe = Keeps(size=10, versions=NOW.versions)
    remarks = built(place, *texts, recipe=recipe).remarks
    (said,) = [each for each in remarks if "another version" in each]
    assert said.startswith("2 existing items were made by another version of manitwin,") and "use a new folder" in said
    assert made_by(place)[:2] == [EARLIER.sha256] * 2
    assert len(made_by(place)) == (3 if "vase" in texts else 2)
