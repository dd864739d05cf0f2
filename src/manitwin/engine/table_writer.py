"""Scheduling of table updates: which finished items the tables lack, and the next job."""

from __future__ import annotations

from manitwin.engine.jobs import MAKE_ROOM, Failure, Reply, WriteTables
from manitwin.engine.ledger.ledger import Ledger


class TableWriter:
    """Issues one table job at a time: an update after every ``every`` ended items, and at the end the rest, then a merge.

    ``every`` 0 disables tables. ``attempts`` consecutive failures stop the run. A run that has nothing to add does not merge
    either, so that it starts no worker.
    """

    def __init__(self, ledger: Ledger, every: int, attempts: int):
        self._ledger, self._every, self._attempts = ledger, every, attempts
        self._under_way: WriteTables | None = None
        self._ended, self._failures = 0, 0
        self._removed: set[str] = set()
        self._merged = True

    def item_ended(self) -> None:
        """Count an ended item, which may have added a twin."""
        self._ended += 1

    def record_removed(self, item_id: str) -> None:
        """Record that a finished folder was removed, so that its rows are removed from the tables."""
        self._removed.add(item_id)

    def next_job(self) -> WriteTables | None:
        """Return the next job if enough items have ended and no other table job is running; otherwise None."""
        if not self._every or self._ended < self._every or self._under_way is not None:
            return None
        return self._next_update()

    def final_job(self) -> WriteTables | None:
        """Return the next job once no item is in progress; None when everything is written and merged."""
        if not self._every:
            return None
        return self._next_update() or (None if self._merged else self._start_job(WriteTables(())))

    def handle_reply(self, reply: Reply) -> str | None:
        """Process the reply to the running table job; return the reason if the run must stop."""
        job, self._under_way = self._under_way, None
        if isinstance(reply, Failure):
            self._failures += 1
            if reply.kind == "no_space":
                return f"{reply.message}; {MAKE_ROOM}"
            if self._failures >= self._attempts:
                return f"the index cannot be written: {reply.message}; `manitwin check` reports what is wrong"
        elif job is not None and job.item_ids:
            self._ledger.mark_indexed(job.item_ids)
            self._removed -= set(job.item_ids)
            self._merged = False
            self._failures = 0
        else:
            self._merged = True
        return None

    def _next_update(self) -> WriteTables | None:
        self._ended = 0
        item_ids = (*self._ledger.unindexed_ids(10 * self._every), *sorted(self._removed))
        return self._start_job(WriteTables(item_ids)) if item_ids else None

    def _start_job(self, job: WriteTables) -> WriteTables:
        self._under_way = job
        return job
