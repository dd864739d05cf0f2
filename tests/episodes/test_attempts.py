"""attempts.parquet: rows come back, batches are put together, kept ones are numbered."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from publishable_run import write_record
from synthetic_episodes import attempt

from manitwin.episodes import attempts as table
from manitwin.episodes.attempts import ATTEMPTS, OUTCOMES, Attempt, count_attempts
from manitwin.episodes.batch import BATCHES
from manitwin.episodes.collect import collect
from manitwin.errors import EpisodesError
from manitwin.twin.loaded_twin import TwinSource


def some(count: int) -> list[Attempt]:
    return [attempt(i, outcome=OUTCOMES[i % len(OUTCOMES)]) for i in range(count)]


def test_attempts_come_back_as_they_were_with_equal_bytes(tmp_path: Path) -> None:
    given = [*some(25), attempt(25, scene_id=None, transferred=True, category="茶杯", instructions=("a", "b"))]
    table.write_attempts(tmp_path / "a.parquet", given)
    table.write_attempts(tmp_path / "b.parquet", given)
    assert list(table.read_attempts(tmp_path / "a.parquet")) == given
    assert (tmp_path / "a.parquet").read_bytes() == (tmp_path / "b.parquet").read_bytes()


def test_merging_keeps_order_and_numbers_the_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(table, "_ROW_GROUP", 16)
    given = some(50)
    files = [tmp_path / f"{i}.parquet" for i in range(6)]
    for number, path in enumerate(files):
        table.write_attempts(path, given[number * 10 : number * 10 + 10] if number < 5 else [])
    kept = sum(a.outcome == "kept" for a in given)
    assert table.merge_attempts(files, tmp_path / "all.parquet") == (50, kept)
    assert list(table.read_attempts(tmp_path / "all.parquet")) == given
    rows = pq.read_table(tmp_path / "all.parquet")
    assert rows.schema.names == table.MERGED_SCHEMA.names
    numbers = rows["episode_index"].to_pylist()
    assert [n for n in numbers if n is not None] == list(range(kept))
    assert all((n is None) == (a.outcome != "kept") for n, a in zip(numbers, given, strict=True))
    groups = pq.ParquetFile(tmp_path / "all.parquet").metadata
    assert [groups.row_group(i).num_rows for i in range(groups.num_row_groups)] == [16, 16, 16, 2]


def test_merging_nothing_gives_an_empty_table(tmp_path: Path) -> None:
    assert table.merge_attempts([], tmp_path / "all.parquet") == (0, 0)
    assert list(table.read_attempts(tmp_path / "all.parquet")) == []


def test_what_grasps_failed_of_and_who_has_none_is_counted_of_attempts_that_were_never_executed() -> None:
    counted = count_attempts(
        [
            attempt(1, plan_failures='{"approach_blocked": 9}'),
            attempt(2, outcome="no_plan", plan_failures='{"no_path": 1}'),
            attempt(3, outcome="no_plan", plan_failures='{"lift_blocked": 4, "no_path": 2}'),
            attempt(4, outcome="no_grasp", twin_id="lid", category="lid", plan_failures="{}"),
            attempt(5, outcome="no_grasp", twin_id="lid", category="lid", plan_failures="{}"),
        ]
    )
    assert list(counted.plan_failures.items()) == [("lift_blocked", 4), ("no_path", 3)]
    assert counted.without_grasp == (("lid", "lid"),)
    assert counted.total.executed == 1


def test_end_of_a_run_tells_of_grasps_that_are_of_another_gripper(tmp_path: Path) -> None:
    batch = tmp_path / BATCHES / "aa" / "one"
    batch.mkdir(parents=True)
    write_record(batch, TwinSource(str(tmp_path)), set())
    table.write_attempts(
        batch / ATTEMPTS, [attempt(1, outcome="dropped", transferred=True), attempt(2, outcome="dropped")]
    )
    told = collect(tmp_path, []).lines
    said = "1 of 2 executed episodes used grasps that were verified for other jaws, not for the robot's gripper"
    assert said in told and "manitwin build --gripper" in told[told.index(said) + 1]
    table.write_attempts(batch / ATTEMPTS, [attempt(1, outcome="dropped"), attempt(2, outcome="dropped")])
    assert not any("other jaws" in line for line in collect(tmp_path, []).lines)


def test_unknown_outcomes_and_other_tables_are_refused(tmp_path: Path) -> None:
    with pytest.raises(EpisodesError, match="unknown outcome 'won'"):
        table.attempts_table([replace(attempt(0), outcome="won")])
    pq.write_table(pa.table({"episode_id": ["a"]}), tmp_path / "a.parquet")
    with pytest.raises(EpisodesError, match="has no column robot"):
        list(table.read_attempts(tmp_path / "a.parquet"))
    with pytest.raises(EpisodesError, match="cannot be opened"):
        list(table.read_attempts(tmp_path / "missing.parquet"))
