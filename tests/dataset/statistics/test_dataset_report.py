"""From a data set's index to its report, on disk and behind a URL."""

from __future__ import annotations

import json
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pytest
import typer
from synthetic_index import synthetic_tables
from typer.testing import CliRunner

from manitwin.cli.commands.stats import stats
from manitwin.dataset.index.part_list import PartList
from manitwin.dataset.index.parts import write_rows
from manitwin.dataset.statistics.page import FIGURES, FOLDER, NUMBERS, REPORT
from manitwin.dataset.statistics.query import ReportTables
from manitwin.dataset.statistics.report import run_queries, write_dataset_report
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot


def dataset(url: str, accepted: int, rejected: int, parts: int) -> DatasetRoot:
    """Return a data set that has nothing but an index, of so many parts."""
    root = DatasetRoot(url)
    tables = synthetic_tables(accepted, rejected)
    ids = sorted(tables["twins"]["twin_id"].to_pylist() + tables["rejections"]["twin_id"].to_pylist())
    written = []
    for number in range(parts):
        chosen = pa.array(ids[number::parts], pa.string())
        of_part = {name: table.filter(pc.is_in(table["twin_id"], chosen)) for name, table in tables.items()}
        written.append(write_rows(root, number, of_part))
    PartList(tuple(written), parts).write(root)
    return root


def test_numbers_do_not_depend_on_how_rows_are_spread_over_parts(tmp_path: Path) -> None:
    one = run_queries(ReportTables.of_index(dataset(str(tmp_path / "one"), 40, 15, parts=1)))
    many = run_queries(ReportTables.of_index(dataset(str(tmp_path / "many"), 40, 15, parts=5)))
    assert {name: result.rows for name, result in one.items()} == {name: result.rows for name, result in many.items()}
    assert one["totals"].only["items"] == 55


def test_report_goes_into_the_data_set_also_behind_a_url(tmp_path: Path) -> None:
    local = dataset(str(tmp_path / "some set"), 6, 2, parts=2)
    said = write_dataset_report(local)
    assert said.page == str(tmp_path / "some set" / FOLDER / REPORT)
    assert said.summary == "8 items: 6 accepted, 2 rejected"
    remote = dataset("memory://statistics/some set", 6, 2, parts=2)
    said = write_dataset_report(remote)
    assert said.page == f"memory://statistics/some set/{FOLDER}/{REPORT}"
    assert f"{FOLDER}/{FIGURES}/sizes.svg" in remote.names_below(FOLDER)
    assert remote.read_bytes(f"{FOLDER}/{REPORT}") == local.read_bytes(f"{FOLDER}/{REPORT}")
    assert "<h1>Statistics of some set</h1>" in local.read_bytes(f"{FOLDER}/{REPORT}").decode()


def test_report_lists_near_duplicates_of_the_index(tmp_path: Path) -> None:
    write_dataset_report(dataset(str(tmp_path / "set"), 4, 0, parts=1))
    near = json.loads((tmp_path / "set" / FOLDER / NUMBERS).read_text())["near_duplicates"]
    assert near["pairs"] == 0, "random shapes are not alike"
    assert "near_duplicates" in near["found_by"]


def test_data_set_without_an_index_is_said_to_have_none(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"not a data set \(twins/ is missing\)"):
        write_dataset_report(DatasetRoot(tmp_path))
    (tmp_path / "ledger.sqlite").touch()
    with pytest.raises(UsageError, match="no twin is finished yet; manitwin status"):
        write_dataset_report(DatasetRoot(tmp_path))
    (tmp_path / "twins").mkdir()
    with pytest.raises(UsageError, match="has no index; run manitwin index"):
        write_dataset_report(DatasetRoot(tmp_path))
    assert not (tmp_path / FOLDER).exists()


def test_command_writes_where_it_is_told_and_says_where(tmp_path: Path) -> None:
    dataset(str(tmp_path / "set"), 0, 3, parts=1)
    app = typer.Typer()
    app.command()(stats)
    done = CliRunner().invoke(app, [str(tmp_path / "set"), "-o", str(tmp_path / "out")])
    assert done.exit_code == 0, done.output
    assert done.output.strip() == f"3 items: 0 accepted, 3 rejected: {tmp_path / 'out' / REPORT}"
    assert (tmp_path / "out" / NUMBERS).is_file() and not (tmp_path / "set" / FOLDER).exists()
