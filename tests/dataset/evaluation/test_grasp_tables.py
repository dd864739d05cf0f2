"""Grasps of a data set as tables: counted by hand, octants by the geometry, and the paper's figures beside."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.dataset.evaluation.grasps import evaluate_grasps
from manitwin.dataset.index.rebuild import rebuild
from manitwin.errors import UsageError
from manitwin.geometry.grasp_diversity import approach_octants
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.loaded_twin import Twin
from twin_folders import write_rejected, write_set


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    root = tmp_path_factory.mktemp("held")
    write_set(root, accepted=3, rejected=1)
    rebuild(DatasetRoot(root), jobs=1)
    return root


def test_grasps_are_counted_without_samples_and_controls(place: Path) -> None:
    report = evaluate_grasps(str(place))
    twins = [Twin(folder) for folder in sorted(place.glob("twins/*/*")) if (folder / "grasps.parquet").exists()]
    rows = [row for twin in twins for row in twin.grasp_table().to_pylist()]
    own = [row for row in rows if ":" not in row["proposer"]]
    held = [row for row in own if row["verified"]]
    (panda,) = report.table("grasps_by_gripper")
    assert (panda["objects"], panda["simulated"], panda["verified"]) == (3, len(own), len(held))
    assert panda["held_share"] == pytest.approx(len(held) / len(own))
    assert (panda["unfiltered"], panda["unfiltered_held_share"]) == (3, 1.0)
    assert panda["robustness_mean"] == pytest.approx(np.mean([row["robustness"] for row in held]))
    octants = [len(np.unique(approach_octants(twin.grasps().gripper_to_object))) for twin in twins]
    assert panda["octants_mean"] == pytest.approx(np.mean(octants))
    assert {row["category"]: row["simulated"] for row in report.table("grasps_by_category")} == {
        twin.record.language.category: len(twin.grasps(verified_only=False)) for twin in twins if twin.record.language
    }


def test_what_was_not_tried_is_not_measured(place: Path) -> None:
    (panda,) = evaluate_grasps(str(place)).table("grasps_by_gripper")
    assert panda["second_tried"] == 0 and panda["second_holds_share"] is None


def test_the_papers_figures_stand_beside_with_what_is_comparable(place: Path) -> None:
    beside = {row["metric"]: row for row in evaluate_grasps(str(place)).table("beside_the_paper")}
    assert beside["verified grasps per object"]["here"] == 3 and beside["verified grasps per object"]["paper"] == 62.14
    assert beside["grasp verification success rate"]["paper"] == 0.7613
    assert {row["comparable"] for row in beside.values()} <= {"yes", "in part", "no"}
    assert all(row["why"] for row in beside.values())


@pytest.mark.slow
def test_a_data_set_without_twins_is_refused(tmp_path: Path) -> None:
    write_rejected(tmp_path, 0)
    rebuild(DatasetRoot(tmp_path), jobs=1)
    with pytest.raises(UsageError, match="no accepted twin"):
        evaluate_grasps(str(tmp_path))


def test_the_command_prints_writes_and_documents_the_tables(place: Path, tmp_path: Path) -> None:
    said = CliRunner().invoke(app, ["evaluate", "grasps", str(place), "--out", str(tmp_path / "out")])
    assert said.exit_code == 0, said.output
    assert "verified grasps per object" in said.stdout and "62.14" in said.stdout
    document = json.loads(CliRunner().invoke(app, ["evaluate", "grasps", str(place), "--json"]).stdout)
    check_keys(document, "evaluate grasps")
    assert json.loads((tmp_path / "out" / "evaluation.json").read_text()) == document
    rows = pq.read_table(tmp_path / "out" / "grasps_by_category.parquet").to_pylist()
    assert rows == document["tables"]["grasps_by_category"]
    assert (tmp_path / "out" / "grasps_by_category.csv").read_text().startswith("category,objects,simulated,")
    assert b"<table>" in (tmp_path / "out" / "report.html").read_bytes()
