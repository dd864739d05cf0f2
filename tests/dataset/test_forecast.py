"""What so many inputs would take: against sums by hand, and what is not measured."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from typer.testing import CliRunner

from json_documents import check_keys
from manitwin.cli.main import app
from manitwin.dataset.forecast import Amount, forecast
from manitwin.dataset.index.rebuild import rebuild
from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot, twin_name
from twin_folders import write_accepted, write_rejected

ACCEPTED, REJECTED = 6, 2


@pytest.fixture(scope="module")
def dataset(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Six accepted and two rejected twins; the stages of the first took ten times as long."""
    root = tmp_path_factory.mktemp("forecast") / "set"
    made = [write_accepted(root, number) for number in range(ACCEPTED)]
    made += [write_rejected(root, ACCEPTED + number) for number in range(REJECTED)]
    slow = root / twin_name(made[0]) / "run.json"
    costs = json.loads(slow.read_text())
    for cost in costs["stages"].values():
        cost["cpu_seconds"] *= 10
    slow.write_text(json.dumps(costs))
    (root / "config.json").write_text(json.dumps({"run": {"memory_gb": 2.0}}))
    rebuild(DatasetRoot(root), jobs=1)
    return root


def costs_of(dataset: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return CPU seconds and dollars of each input, read from the files of the twins themselves."""
    runs = [
        json.loads(path.read_text())["stages"].values() for path in sorted((dataset / "twins").glob("*/*/run.json"))
    ]
    return tuple(np.array([sum(each[name] for each in run) for run in runs]) for name in ("cpu_seconds", "cost_usd"))  # type: ignore[return-value]


def test_amounts_are_those_of_the_inputs_times_their_number(dataset: Path) -> None:
    cpu_s, usd = costs_of(dataset)
    told = forecast(DatasetRoot(dataset), 1000, 8, core_hour_usd=0.5)
    assert told.measured == len(cpu_s) == ACCEPTED + REJECTED
    assert told.accepted.value == pytest.approx(1000 * ACCEPTED / told.measured)
    assert told.accepted.low < told.accepted.value < told.accepted.high < 1000
    assert told.cpu_hours.value == pytest.approx(1000 * cpu_s.mean() / 3600)
    assert told.hours.value == pytest.approx(told.cpu_hours.value / 8)
    assert told.services_usd.value == pytest.approx(1000 * usd.mean())
    assert told.usd is not None
    assert told.usd.value == pytest.approx(0.5 * told.cpu_hours.value + told.services_usd.value)
    assert told.slowest_cpu_s == pytest.approx(cpu_s.max()) and sum(told.stages.values()) == pytest.approx(1)
    twins = sum(path.stat().st_size for path in (dataset / "twins").rglob("*") if path.is_file())
    assert told.twins_bytes.value == pytest.approx(1000 * twins / told.measured)
    assert told.memory_bytes == 8 * 2.0 * 2**30 and told.work_bytes is None and told.index_bytes > 0


def test_the_interval_has_the_one_slow_input_in_it_and_narrows_with_more(dataset: Path) -> None:
    cpu_s, _ = costs_of(dataset)
    told = forecast(DatasetRoot(dataset), 1, 1)
    fast = cpu_s[cpu_s < cpu_s.max()]
    assert told.cpu_hours.low <= 3600 * fast.max() and told.cpu_hours.low < told.cpu_hours.value < told.cpu_hours.high
    assert told.cpu_hours.high - told.cpu_hours.low > 0.5 * told.cpu_hours.value
    assert forecast(DatasetRoot(dataset), 1, 1) == told
    assert told.usd is None


def test_what_is_not_known_is_none_and_too_few_inputs_are_refused(tmp_path: Path) -> None:
    root = tmp_path / "set"
    for number in range(4):
        write_accepted(root, number)
    rebuild(DatasetRoot(root), jobs=1)
    with pytest.raises(UsageError, match="4 inputs were built, but an estimate needs at least 5"):
        forecast(DatasetRoot(root), 10, 1)
    write_accepted(root, 4)
    rebuild(DatasetRoot(root), jobs=1)
    told = forecast(DatasetRoot(root), 10, 1)
    assert told.memory_bytes is None and told.ledger_bytes == 0


def test_stages_of_a_twin_that_the_index_has_not_are_one_line(tmp_path: Path) -> None:
    root = tmp_path / "set"
    for number in range(ACCEPTED):
        write_accepted(root, number)
    rebuild(DatasetRoot(root), jobs=1)
    [file] = (root / "index" / "stages").glob("*.parquet")
    table = pq.read_table(file)
    strangers = pa.array(["f" * 16] * len(table), table.schema.field("twin_id").type)
    pq.write_table(table.set_column(table.schema.get_field_index("twin_id"), "twin_id", strangers), file)
    with pytest.raises(UsageError, match="neither a twin nor a rejection"):
        forecast(DatasetRoot(root), 10, 1)


def test_the_command_says_what_the_document_says(dataset: Path) -> None:
    runner = CliRunner()
    done = runner.invoke(app, ["plan", str(dataset), "--items", "1000", "--cores", "8"])
    assert done.exit_code == 0
    assert "1,000 inputs on 8 cores, estimated from 8 measured inputs" in done.output
    assert "dollars: unknown; give the price of a core-hour with --core-hour-usd" in done.output
    done = runner.invoke(
        app, ["plan", str(dataset), "--items", "1000", "--cores", "8", "--core-hour-usd", "1", "--json"]
    )
    document = json.loads(done.stdout)
    assert document == forecast(DatasetRoot(dataset), 1000, 8, core_hour_usd=1.0).document()
    check_keys(document, "plan")


def test_few_inputs_take_no_more_cores_than_they_are_and_are_told_in_small_units(dataset: Path) -> None:
    few, one = forecast(DatasetRoot(dataset), 4, 64), forecast(DatasetRoot(dataset), 4, 4)
    assert few.hours == one.hours and few.memory_bytes == one.memory_bytes and few.cores == 64
    told = CliRunner().invoke(app, ["plan", str(dataset), "--items", "4"]).output
    assert "core minutes" in told and " s (" in told and " 0.00 h" not in told and " 0.00 GB" not in told


def test_an_amount_scales_with_its_interval() -> None:
    assert Amount(2.0, 1.0, 4.0).times(0.5) == Amount(1.0, 0.5, 2.0)
