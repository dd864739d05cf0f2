"""Which twins the tables get next, and what a failed table means for the run."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from manitwin.engine.jobs import Failure, WriteTables
from manitwin.engine.ledger.ledger import Ledger
from manitwin.engine.table_writer import TableWriter
from manitwin.pipeline.item import Item

BROKEN = Failure("error", "the part is broken")


@pytest.fixture
def ledger(tmp_path: Path) -> Iterator[Ledger]:
    """Three accepted twins that no table has."""
    ledger = Ledger(tmp_path / "ledger.sqlite")
    ledger.add_items(Item(file=None, text=f"mug {number}") for number in range(3))
    for number in (1, 2, 3):
        ledger.identify(number, f"twin{number}", "text")
        ledger.item_ended(number, "accepted", recipe_sha256="recipe", revision="r")
    yield ledger
    ledger.close()


def test_job_is_due_when_enough_items_have_ended_and_none_is_under_way(ledger: Ledger) -> None:
    tables = TableWriter(ledger, every=2, attempts=3)
    tables.item_ended()
    assert tables.next_job() is None
    tables.item_ended()
    assert tables.next_job() == WriteTables(("twin1", "twin2", "twin3"))
    for _ in range(2):
        tables.item_ended()
    assert tables.next_job() is None, "the first one is still being written"
    assert tables.handle_reply(None) is None and ledger.unindexed_ids(10) == []
    assert tables.next_job() is None, "there is nothing left to write"


def test_end_of_a_run_writes_the_rest_and_merges_once(ledger: Ledger) -> None:
    tables = TableWriter(ledger, every=500, attempts=3)
    assert tables.final_job() == WriteTables(("twin1", "twin2", "twin3"))
    tables.handle_reply(None)
    assert tables.final_job() == WriteTables(())
    tables.handle_reply(BROKEN)
    assert tables.final_job() == WriteTables(()), "a merge that failed is tried again"
    tables.handle_reply(None)
    assert tables.final_job() is None


def test_run_without_tables_has_none_due(ledger: Ledger) -> None:
    tables = TableWriter(ledger, every=0, attempts=3)
    tables.item_ended()
    assert tables.next_job() is None and tables.final_job() is None


def test_failures_in_a_row_stop_the_run_and_a_full_disk_does_at_once(ledger: Ledger) -> None:
    tables = TableWriter(ledger, every=1, attempts=2)
    for reply, stop in ((BROKEN, False), (None, False), (BROKEN, False), (BROKEN, True)):
        ledger.connection.execute("UPDATE items SET indexed = 0")
        assert tables.final_job() is not None
        assert (tables.handle_reply(reply) is not None) == stop
    tables = TableWriter(ledger, every=1, attempts=2)
    assert tables.final_job() is not None
    full = tables.handle_reply(Failure("no_space", "the disk is full"))
    assert full == "the disk is full; free disk space, then rerun the command to resume"
    assert len(ledger.unindexed_ids(10)) == 3, "what failed is not noted as written"
