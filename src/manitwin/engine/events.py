"""What happens in a run, as it happens: for whoever watches it, and for the log."""

from __future__ import annotations

import logging
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from manitwin.engine.ledger.ledger import ItemState
from manitwin.engine.stage_parts import StagePart
from manitwin.engine.task import Task

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
    """A stage of an item has ended, or waits to be tried again; ``trace`` is the traceback of what went wrong, if any."""

    task: Task
    stage: str
    state: StageState
    seconds: float = 0.0
    detail: str = ""
    trace: str = ""


@dataclass(frozen=True)
class ItemEnded:
    """What became of one item; ``found`` where its folder was there already."""

    task: Task
    state: ItemState
    detail: str
    found: bool = False


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
