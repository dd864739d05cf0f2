"""What services charge for the work that is being done, and whether they only rehearse it: clients say, who runs it counts."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

REHEARSAL_MARK = "x-manitwin-rehearsal"
"""The header, or the field of a message, that every answer of a rehearsal server has, and that of no other."""


@dataclass
class Bill:
    """What has been charged so far; ``rehearsed``: a rehearsal server (``manitwin fake``) answered, not a model."""

    usd: float = 0.0
    rehearsed: bool = False


_current: ContextVar[Bill | None] = ContextVar("bill", default=None)


def charge(usd: float) -> None:
    """Add to the bill of the work that is being done; outside of ``counted`` nobody keeps it."""
    bill = _current.get()
    if bill is not None:
        bill.usd += usd


def note_rehearsal() -> None:
    """Say that what answered was a rehearsal server: what is made of it is no model's work."""
    bill = _current.get()
    if bill is not None:
        bill.rehearsed = True


@contextmanager
def counted() -> Iterator[Bill]:
    """Count what is charged inside, also where it ends with an error; an outer count includes it."""
    bill, outer = Bill(), _current.get()
    token = _current.set(bill)
    try:
        yield bill
    finally:
        _current.reset(token)
        if outer is not None:
            outer.usd += bill.usd
            outer.rehearsed = outer.rehearsed or bill.rehearsed
