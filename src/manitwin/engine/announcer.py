"""Tell whoever watches a run, and the log, what happens in it."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from manitwin.engine.events import (
    ItemEnded,
    OnStage,
    StageAdvanced,
    StageEnded,
    StageStarted,
    StageState,
    log_item,
    log_stage,
)
from manitwin.engine.flight import Flight
from manitwin.engine.ledger.ledger import ItemState
from manitwin.engine.stage_parts import StagePart


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
        """Tell that a stage has ended, or waits to be tried again."""
        self._stage(StageEnded(flight.task, stage, state, seconds, detail, trace))

    def item_ended(self, flight: Flight, state: ItemState, detail: str, found: bool = False) -> None:
        """Tell what became of an item."""
        event = ItemEnded(flight.task, state, detail, found)
        log_item(event)
        self._on_ended(event)

    def _stage(self, event: StageStarted | StageEnded) -> None:
        log_stage(event)
        self._on_stage(event)
