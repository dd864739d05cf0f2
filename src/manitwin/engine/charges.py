"""Charges of services for the work that is done, whether they only rehearse it, and the budget of a run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

REHEARSAL_MARK = "x-manitwin-rehearsal"
"""The header, or the field of a message, that every answer of a rehearsal server has, and that of no other."""


@dataclass
class Bill:
    """The amount that has been charged so far; ``rehearsed``: a rehearsal server (``manitwin fake``) answered, not a model."""

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


class Budget:
    """Money of one run, in USD; with ``max_usd`` None there is no limit.

    What a job will cost is only expected, so that the limit holds to within the errors of what is under way.
    """

    def __init__(self, max_usd: float | None):
        self.max_usd, self.spent_usd = max_usd, 0.0
        self._expected: dict[int, float] = {}

    def allows(self, expected_usd: float) -> bool:
        """Tell whether a job may begin: with it and those under way the run stays within the limit."""
        if self.max_usd is None or expected_usd <= 0:
            return True
        return self.spent_usd + sum(self._expected.values()) + expected_usd <= self.max_usd

    def begin(self, ticket: int, expected_usd: float) -> None:
        """Note a job that begins, with what it is expected to be charged."""
        if expected_usd > 0:
            self._expected[ticket] = expected_usd

    def end(self, ticket: int, charged_usd: float) -> None:
        """Note what a job was charged in the end."""
        self._expected.pop(ticket, None)
        self.spent_usd += charged_usd

    @property
    def nothing_under_way(self) -> bool:
        """True where no paid job is under way: what is spent now is all that will be."""
        return not self._expected

    def why_stopped(self, expected_usd: float) -> str:
        """Say why a job may not begin."""
        return (
            f"the next question costs about {expected_usd:.4f} USD, and {self.spent_usd:.4f} of at most"
            f" {self.max_usd:g} USD are spent; raise max_cost_usd, then rerun the command to resume"
        )
