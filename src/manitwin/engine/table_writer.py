"""The tables of a run: which items they still lack, and what to write next."""

from __future__ import annotations

from manitwin.engine.jobs import MAKE_ROOM, Failure, Reply, WriteTables
from manitwin.engine.ledger.ledger import Ledger


class TableWriter:
    """Give out one job at a time: tables of every so many items, and at a run's end the rest, merged into few.

    ``every`` items that ended make a job due (0: no tables at all); ``attempts`` failures in a row stop the run. A run that
    has nothing to add merges nothing either, and so starts no worker.
    """

    def __init__(self, ledger: Ledger, every: int, attempts: int):
        self._ledger, self._every, self._attempts = ledger, every, attempts
        self._under_way: WriteTables | None = None
        self._ended, self._failures = 0, 0
        self._removed: set[str] = set()
        self._merged = True

    def item_ended(self) -> None:
        """Count an item that may have left a twin for the tables."""
        self._ended += 1

    def removed(self, item_id: str) -> None:
        """Note that a finished folder was removed: the tables are to lose its rows."""
        self._removed.add(item_id)

    def due(self) -> WriteTables | None:
        """Return the next job once enough items have ended and no other job is under way."""
        if not self._every or self._ended < self._every or self._under_way is not None:
            return None
        return self._of_unwritten_twins()

    def due_at_the_end(self) -> WriteTables | None:
        """Return the next job, no item being under way any more; None when all is written and merged."""
        if not self._every:
            return None
        return self._of_unwritten_twins() or (None if self._merged else self._begun(WriteTables(())))

    def written(self, reply: Reply) -> str | None:
        """Take the answer to the job under way; returns why the run must stop, if it must."""
        job, self._under_way = self._under_way, None
        if isinstance(reply, Failure):
            self._failures += 1
            if reply.kind == "no_space":
                return f"{reply.message}; {MAKE_ROOM}"
            if self._failures >= self._attempts:
                return f"the index cannot be written: {reply.message}; `manitwin check` reports what is wrong"
        elif job is not None and job.item_ids:
            self._ledger.indexed(job.item_ids)
            self._removed -= set(job.item_ids)
            self._merged = False
            self._failures = 0
        else:
            self._merged = True
        return None

    def _of_unwritten_twins(self) -> WriteTables | None:
        self._ended = 0
        item_ids = (*self._ledger.not_indexed(10 * self._every), *sorted(self._removed))
        return self._begun(WriteTables(item_ids)) if item_ids else None

    def _begun(self, job: WriteTables) -> WriteTables:
        self._under_way = job
        return job
