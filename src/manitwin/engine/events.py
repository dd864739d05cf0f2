"""The events of a run, as they happen: for whoever watches it, and for the log."""

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
    """A stage of an item was given to a worker."""

    task: Task
    stage: str


@dataclass(frozen=True)
class StageAdvanced:
    """A long stage of an item has done a part of what it does."""

    task: Task
    stage: str
    part: StagePart


@dataclass(frozen=True)
class StageEnded:
    """A stage of an item has ended, or waits to be tried again; ``trace`` is the traceback of what went wrong, if any.

    ``given_up_in_s``: of one that waits for a service that is down, for how many seconds that is still asked again.
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
    """An item has ended; ``found`` where its folder was there already, ``reason`` is the code of a rejection or failure."""

    task: Task
    state: ItemState
    detail: str
    found: bool = False
    reason: str | None = None

    def row(self) -> ItemRow:
        """Return what a ledger keeps of the item."""
        task = self.task
        return ItemRow(task.number, task.payload.to_json(), task.item_id, self.state, self.reason, self.detail)


StageEvent = StageStarted | StageAdvanced | StageEnded
OnStage = Callable[[StageEvent], None]
"""Hears of stages: one that begins, has done a part, or has ended."""


def log_stage(event: StageStarted | StageEnded) -> None:
    """Tell the log of a stage that began or ended."""
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
    """Tell the log what became of an item."""
    found = " (there already)" if event.found else ""
    task = event.task
    RUN.info("item %d %s %s %s%s: %s", task.number, task.payload.title, task.item_id, event.state, found, event.detail)


class Announcer:
    """Makes the events of a driver's items; what part of a stage is done is not for the log."""

    def __init__(self, on_stage: OnStage, on_ended: Callable[[ItemEnded], None]):
        self._on_stage, self._on_ended = on_stage, on_ended

    def stage_started(self, flight: Flight) -> None:
        """Tell that the next stage of an item was given to a worker."""
        self._stage(StageStarted(flight.task, flight.stage))

    def stages_advanced(self, parts: Mapping[int, StagePart], running: Mapping[int, Flight | None]) -> None:
        """Tell what part of each stage is done, by the ticket of its job; of a job that runs no more nothing is told."""
        for ticket, part in parts.items():
            if flight := running.get(ticket):
                self._on_stage(StageAdvanced(flight.task, flight.stage, part))

    def stage_ended(
        self, flight: Flight, stage: str, state: StageState, seconds: float = 0.0, detail: str = "", trace: str = ""
    ) -> None:
        """Tell that a stage has ended."""
        self._stage(StageEnded(flight.task, stage, state, seconds, detail, trace))

    def stage_waits(self, flight: Flight, stage: str, detail: str, trace: str, given_up_in_s: float | None) -> None:
        """Tell that a stage waits to be tried again."""
        self._stage(StageEnded(flight.task, stage, "waiting", 0.0, detail, trace, given_up_in_s))

    def item_ended(
        self, flight: Flight, state: ItemState, detail: str, found: bool = False, reason: str | None = None
    ) -> None:
        """Tell what became of an item."""
        event = ItemEnded(flight.task, state, detail, found, reason)
        log_item(event)
        self._on_ended(event)

    def _stage(self, event: StageStarted | StageEnded) -> None:
        log_stage(event)
        self._on_stage(event)
