"""A data set on an object store: the same run, ledger and tables."""

from __future__ import annotations

from pathlib import Path

import pytest
from rehearsals import rehearse, runs

from manitwin.config import RunConfig
from manitwin.dataset.index.parts import indexed_twins
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from manitwin.twin.store import parse_record, sha256_of_file
from rehearsal_recipe import RehearsalRecipe

pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::ResourceWarning")


@pytest.mark.slow
def test_a_run_on_an_object_store_ends_every_item_and_finds_its_results_again(s3: str, tmp_path: Path) -> None:
    recipe = RehearsalRecipe(log=tmp_path / "log", size=1000)
    texts = [f"item {n}" for n in range(4)] + ["bad reject:b"]
    first = rehearse(s3, texts, recipe=recipe, ledger_folder=tmp_path / "here")
    assert sorted(first.states.values()) == ["accepted"] * 4 + ["rejected"] and first.wrong == []
    root = DatasetRoot(s3)
    assert len(list(root.twin_ids())) == 5
    assert set(indexed_twins(root)) == set(root.twin_ids())
    # another machine, with nothing of the first: the ledger is new, the results are those of the store
    elsewhere = rehearse(s3, texts, recipe=recipe, ledger_folder=tmp_path / "there")
    assert elsewhere.states == first.states and elsewhere.wrong == []
    assert set(runs(tmp_path / "log").values()) == {1}


def test_processes_on_an_object_store(s3: str, tmp_path: Path) -> None:
    recipe = RehearsalRecipe(log=tmp_path / "log", size=1000)
    run = rehearse(
        s3, [f"item {n}" for n in range(4)], recipe=recipe, ledger_folder=tmp_path / "here", processes=True,
        settings=RunConfig(cpu=2, keep_work=False),
    )  # fmt: skip
    assert set(run.states.values()) == {"accepted"} and run.wrong == []
    assert DatasetRoot(s3).names_below(".work") == []


def test_a_folder_on_an_object_store_is_whole_or_has_no_record(s3: str, tmp_path: Path) -> None:
    root = DatasetRoot(s3)
    recipe = RehearsalRecipe()
    run = rehearse(s3, ["one"], recipe=recipe, ledger_folder=tmp_path / "here")
    name = twin_name(run.ended[0].task.item_id)
    copy = root.fetch_folder(name, tmp_path / "copy")
    record = parse_record((copy / "twin.json").read_bytes())
    assert {file: sha256_of_file(copy / file) for file in record.files} == record.files
    (copy / "visual.glb").unlink()
    root.put_folder(copy, name)  # a new revision without it
    assert f"{name}/visual.glb" not in root.names_below(name) and root.exists(f"{name}/twin.json")
