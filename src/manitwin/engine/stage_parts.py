"""How much of a long stage is done: said by the stage, heard by whoever runs it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass


@dataclass(frozen=True)
class StagePart:
    """A stage has done ``done`` of ``total`` things, which ``unit`` names in the plural."""

    done: int
    total: int
    unit: str


_hear: ContextVar[Callable[[StagePart], None] | None] = ContextVar("hear_stage_parts", default=None)


def tell_part(done: int, total: int, unit: str) -> None:
    """Say how much of the stage that runs here is done; cheap where nobody listens."""
    hear = _hear.get()
    if hear is not None:
        hear(StagePart(done, total, unit))


@contextmanager
def heard_by(hear: Callable[[StagePart], None]) -> Iterator[None]:
    """Have the stages that run in the ``with`` statement heard."""
    token = _hear.set(hear)
    try:
        yield
    finally:
        _hear.reset(token)
