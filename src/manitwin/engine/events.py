"""Events of a run, for callbacks and for the log."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from manitwin.engine.ledger.rows import ItemRow, ItemState
from manitwin.engine.stage import StagePart
from manitwin.engine.task import Task

if TYPE_CHECKING:
    from manitwin.engine.flight import Flight

RUN = logging.getLogger("manitwin.run")
StageState = Literal["done", "there already", "rejected", "waiting", "failed"]


@dataclass(frozen=True)
class StageStarted:
    """A stage of an item was submitted to a worker."""

    task: Task
    stage: str


@dataclass(frozen=True)
class StageAdvanced:
    """A long stage of an item has completed part of its work."""

    task: Task
    stage: str
    part: StagePart


@dataclass(frozen=True)
class StageEnded:
    """A stage of an item has ended, or waits for a retry; ``trace`` is the traceback of an error, if any.

    ``given_up_in_s``: for a stage that waits for a service that is down, the seconds for which it is still retried.
    """

    task: Task
    stage: str
    state: StageState
    seconds: float = 0.0
    detail: str = ""
    trace: str = ""
    given_up_in_s: float | None = None


@dataclass(frozen=True)
class ItemEnded:
    """An item has ended; ``found``: its folder existed already; ``reason``: the code of a rejection or failure."""

    task: Task
    state: ItemState
    detail: str
    found: bool = False
    reason: str | None = None

    def row(self) -> ItemRow:
        """Return the ledger's row of the item."""
        task = self.task
        return ItemRow(task.number, task.payload.to_json(), task.item_id, self.state, self.reason, self.detail)


StageEvent = StageStarted | StageAdvanced | StageEnded
OnStage = Callable[[StageEvent], None]
"""Callback for the events of stages."""


def log_stage(event: StageStarted | StageEnded) -> None:
    """Log the start or end of a stage."""
    of = f"{event.stage} of {event.task.payload.title}" + (f" ({event.task.item_id})" if event.task.item_id else "")
    if isinstance(event, StageStarted):
        RUN.debug("%s begins", of)
        return
    took = f" in {event.seconds:.2f} s" if event.seconds else ""
    why = f": {event.detail}" if event.detail else ""
    level = logging.WARNING if event.state in ("waiting", "failed") else logging.INFO
    RUN.log(level, "%s %s%s%s", of, event.state, took, why)
    if event.trace:
        RUN.debug("%s", event.trace.rstrip())


def log_item(event: ItemEnded) -> None:
    """Log the end of an item."""
    found = " (there already)" if event.found else ""
    task = event.task
    RUN.info("item %d %s %s %s%s: %s", task.number, task.payload.title, task.item_id, event.state, found, event.detail)


class Announcer:
    """Creates the events of a driver's items, logs them and calls the callbacks; progress within a stage is not logged."""

    def __init__(self, on_stage: OnStage, on_ended: Callable[[ItemEnded], None]):
        self._on_stage, self._on_ended = on_stage, on_ended

    def stage_started(self, flight: Flight) -> None:
        """Report that the next stage of an item was submitted."""
        self._stage(StageStarted(flight.task, flight.stage))

    def stages_advanced(self, parts: Mapping[int, StagePart], running: Mapping[int, Flight | None]) -> None:
        """Report the progress of running stages by the ticket of their jobs; tickets that are not in ``running`` are ignored."""
        for ticket, part in parts.items():
            if flight := running.get(ticket):
                self._on_stage(StageAdvanced(flight.task, flight.stage, part))

    def stage_ended(
        self, flight: Flight, stage: str, state: StageState, seconds: float = 0.0, detail: str = "", trace: str = ""
    ) -> None:
        """Report that a stage has ended."""
        self._stage(StageEnded(flight.task, stage, state, seconds, detail, trace))

    def stage_waits(self, flight: Flight, stage: str, detail: str, trace: str, given_up_in_s: float | None) -> None:
        """Report that a stage waits for a retry."""
        self._stage(StageEnded(flight.task, stage, "waiting", 0.0, detail, trace, given_up_in_s))

    def item_ended(
        self, flight: Flight, state: ItemState, detail: str, found: bool = False, reason: str | None = None
    ) -> None:
        """Report that an item has ended."""
        event = ItemEnded(flight.task, state, detail, found, reason)
        log_item(event)
        self._on_ended(event)

    def _stage(self, event: StageStarted | StageEnded) -> None:
        log_stage(event)
        self._on_stage(event)
