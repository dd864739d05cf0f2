"""The ledger's file: migrations, items, and what it tells."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path

import pytest

from manitwin.engine.ledger import migrations
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.ledger.lock import is_written
from manitwin.engine.ledger.migrations import MIGRATIONS
from manitwin.engine.ledger.progress import read_progress, read_story
from manitwin.engine.ledger.reading import read_ledger
from manitwin.errors import UsageError
from manitwin.pipeline.item import Item
from manitwin.pipeline.stage_order import place_in_pipeline


@pytest.fixture
def path(tmp_path: Path) -> Path:
    return tmp_path / "ledger.sqlite"


@pytest.fixture
def ledger(path: Path) -> Iterator[Ledger]:
    ledger = Ledger(path)
    yield ledger
    ledger.close()


def mugs(count: int) -> list[Item]:
    return [Item(file=f"/data/mug_{n}.obj", name="mug") for n in range(count)]


def test_a_ledger_that_is_opened_again_goes_on_with_its_rows(path: Path) -> None:
    with closing(Ledger(path)) as ledger:
        ledger.add_items(mugs(2))
        ledger.commit()
    with closing(Ledger(path)) as again:
        assert again.counts() == {"open": 2}
        assert again.add_items(mugs(3)) == ([1, 2, 3], 1)


def test_a_ledger_of_an_older_schema_takes_the_steps_that_it_lacks(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with closing(Ledger(path)) as ledger:
        ledger.add_items(mugs(2))
        ledger.commit()
    newer = (*MIGRATIONS, "ALTER TABLE items ADD COLUMN note TEXT NOT NULL DEFAULT 'none'")
    monkeypatch.setattr(migrations, "MIGRATIONS", newer)
    with closing(Ledger(path)) as migrated:
        assert migrated.connection.execute("SELECT number, note FROM items").fetchall() == [(1, "none"), (2, "none")]


def test_a_ledger_of_a_newer_version_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "new.sqlite"
    connection = sqlite3.connect(path)
    connection.execute(f"PRAGMA user_version = {len(MIGRATIONS) + 1}")
    connection.close()
    with pytest.raises(UsageError, match="use the version that wrote it"):
        Ledger(path)
    with pytest.raises(UsageError, match="use the version that wrote it"), read_ledger(path):
        pass  # not as a damaged one, which `manitwin check` would put aside


def test_items_are_added_once(ledger: Ledger) -> None:
    assert ledger.add_items(mugs(3)) == ([1, 2, 3], 3)
    assert ledger.add_items(mugs(5)) == ([1, 2, 3, 4, 5], 2)


def test_a_manifest_with_a_wrong_row_adds_nothing(ledger: Ledger) -> None:
    def rows() -> Iterator[Item]:
        yield from mugs(3)
        raise UsageError("list.csv:4: wrong")

    with pytest.raises(UsageError, match="list"):
        ledger.add_items(rows())
    assert ledger.counts() == {}


def test_progress_counts_rate_time_left_and_reasons(path: Path, ledger: Ledger) -> None:
    ledger.add_items(mugs(10))
    run = ledger.begin_run("recipe")
    (started,) = ledger.connection.execute("SELECT started_at FROM runs").fetchone()
    for number in range(1, 6):
        ledger.identify(number, f"{number:016x}", "mesh")
        ledger.stage_started(number, "mesh", 1)
        ledger.stage_ended(
            number, "mesh", "done", attempts=1, key="k", ran=True, seconds=2.0, cpu_seconds=1.5, cost_usd=0.25
        )
    ledger.stage_started(6, "mesh", 1)
    for number in (1, 2, 3):
        ledger.item_ended(number, "accepted", recipe_sha256="recipe", revision="r")
    ledger.item_ended(4, "rejected", recipe_sha256="recipe", reason="too_wide", detail="wide", revision="r")
    ledger.item_ended(5, "failed", recipe_sha256="recipe", reason="crashed", detail="SIGSEGV")
    ledger.connection.execute("UPDATE items SET ended_at = ? WHERE state <> 'open'", (started + 50,))
    ledger.commit()
    with read_ledger(path) as connection:
        progress = read_progress(connection, at_work=is_written(path), now=started + 100)
    assert progress.items == {"open": 5, "accepted": 3, "rejected": 1, "failed": 1, "duplicate": 0}
    stage = progress.stages[0]
    assert (stage.stage, stage.done, stage.running, stage.mean_seconds, stage.cost_usd) == ("mesh", 5, 1, 2.0, 1.25)
    assert progress.items_per_hour == pytest.approx(180)
    assert progress.left_s == pytest.approx(100)
    assert (progress.rejected_by_reason, progress.failed_by_reason) == ({"too_wide": 1}, {"crashed": 1})
    assert progress.cpu_seconds == pytest.approx(7.5) and progress.last_run == "at work"
    assert progress.of_another_recipe == 0
    ledger.end_run(run, "finished")
    assert ledger.unindexed_ids(10) == [f"{n:016x}" for n in (1, 2, 3, 4)], "a failed item has no folder"
    ledger.begin_run("of a newer version", given=[1])
    ledger.commit()
    with read_ledger(path) as connection:
        assert read_progress(connection, at_work=False).of_another_recipe == 4


def test_another_recipe_opens_what_ended_but_not_duplicates(ledger: Ledger) -> None:
    ledger.add_items(mugs(3))
    ledger.begin_run("old")
    for number in (1, 2):
        assert ledger.identify(number, f"{number:016x}", "mesh") is None
        ledger.item_ended(number, "accepted", recipe_sha256="old", revision="r")
    assert ledger.identify(3, f"{1:016x}", "mesh") == 1
    assert ledger.totals("old") == (3, 0)
    assert ledger.totals("new") == (3, 2)
    ledger.begin_run("new")
    assert ledger.counts() == {"open": 2, "duplicate": 1}


def test_another_recipe_forgets_failed_attempts_but_not_what_is_done(path: Path, ledger: Ledger) -> None:
    ledger.add_items(mugs(2))
    ledger.begin_run("old")
    for number, state in ((1, "failed"), (2, "rejected")):
        ledger.stage_ended(number, "mesh", "done", attempts=2, key="k", ran=True)
        ledger.stage_ended(number, "gate", state, attempts=3, error="SIGSEGV")
        ledger.item_ended(number, state, recipe_sha256="old")
    ledger.begin_run("old")
    assert ledger.next_open(0, 10) == [], "the same recipe would end the same way"
    ledger.begin_run("new")
    assert [(opened.number, opened.attempts) for opened in ledger.next_open(0, 10)] == [(1, {}), (2, {})]
    with read_ledger(path) as connection:
        assert [(row.stage, row.state) for row in read_story(connection, "1").stages] == [("mesh", "done")]


def test_a_story_is_found_by_number_id_or_file(path: Path, ledger: Ledger) -> None:
    ledger.add_items(mugs(12))
    ledger.identify(3, "abcdef0123456789", "mesh")
    ledger.stage_ended(3, "mesh", "failed", attempts=3, error="SIGSEGV")
    ledger.commit()
    with read_ledger(path) as connection:
        for which in ("3", "abcd", "mug_2.obj"):
            story = read_story(connection, which)
            assert (story.number, story.stages[0].error) == (3, "SIGSEGV")
        with pytest.raises(UsageError, match="several items"):
            read_story(connection, "mug_1")
        with pytest.raises(UsageError, match="no such item"):
            read_story(connection, "cup")


def test_a_data_set_without_a_ledger_is_said_to_be_none(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="manitwin build"), read_ledger(tmp_path / "ledger.sqlite"):
        pass
    assert list(tmp_path.iterdir()) == []


def test_stages_are_told_in_the_order_of_the_pipeline(path: Path, ledger: Ledger) -> None:
    ledger.add_items(mugs(2))
    begun = ("assemble", "verify", "photo", "finish", "verify-robotiq_2f85", "mesh", "grasps-robotiq_2f85", "input")
    for number, stages in ((1, begun), (2, ("grasps", "gate", "record_grasps"))):
        for stage in stages:
            ledger.stage_ended(number, stage, "done", attempts=1)
    ledger.commit()
    with read_ledger(path) as connection:
        assert [stage.stage for stage in read_progress(connection, False, place_in_pipeline).stages] == [
            *("input", "photo", "mesh", "gate", "grasps", "verify", "grasps-robotiq_2f85", "verify-robotiq_2f85"),
            *("record_grasps", "finish", "assemble"),
        ]


def test_stages_of_another_recipe_stand_between_reading_and_putting_together(path: Path, ledger: Ledger) -> None:
    ledger.add_items(mugs(3))
    for number, stages in ((1, ("pictures", "assemble")), (2, ("layout", "pictures")), (3, ("layout", "input"))):
        for stage in stages:
            ledger.stage_ended(number, stage, "done", attempts=1)
    ledger.stage_ended(1, "layout", "done", attempts=1)
    ledger.commit()
    with read_ledger(path) as connection:
        told = [stage.stage for stage in read_progress(connection, at_work=False).stages]
    assert told == ["input", "layout", "pictures", "assemble"]


def test_a_reader_leaves_nothing_beside_a_ledger_that_no_run_writes(tmp_path: Path) -> None:
    path = tmp_path / "a b%20c?.sqlite"
    ledger = Ledger(path)
    ledger.add_items([Item(file="/mug.obj")])
    with read_ledger(path) as connection:
        assert connection.execute("SELECT count(*) FROM items").fetchone()[0] == 1, "what is only in the log so far"
    ledger.close()
    before = sorted(tmp_path.iterdir())
    with read_ledger(path) as connection:
        assert connection.execute("SELECT count(*) FROM items").fetchone()[0] == 1
    assert sorted(tmp_path.iterdir()) == before


def test_what_a_run_writes_is_seen_by_readers_that_open_while_it_is_at_work(path: Path, ledger: Ledger) -> None:
    ledger.connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")  # the log holds nothing, and yet a run is at work
    with read_ledger(path) as connection:
        before = connection.execute("SELECT count(*) FROM items").fetchone()[0]
        ledger.add_items([Item(file=None, text="one more")])
        assert connection.execute("SELECT count(*) FROM items").fetchone()[0] == before + 1
