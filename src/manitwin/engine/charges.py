"""Accounting of service charges: the bill of the current work, the rehearsal mark, and the budget of a run."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

REHEARSAL_MARK = "x-manitwin-rehearsal"
"""Header or message field that marks every answer of a rehearsal server (``manitwin fake``) and no other answer."""


@dataclass
class Bill:
    """The amount charged so far; ``rehearsed``: a rehearsal server (``manitwin fake``) answered instead of a model."""

    usd: float = 0.0
    rehearsed: bool = False


_current: ContextVar[Bill | None] = ContextVar("bill", default=None)


def charge(usd: float) -> None:
    """Add to the bill of the current work; without an enclosing ``counted`` the charge is not recorded."""
    bill = _current.get()
    if bill is not None:
        bill.usd += usd


def note_rehearsal() -> None:
    """Mark the current work as rehearsed: a rehearsal server answered, so the result is not a model's."""
    bill = _current.get()
    if bill is not None:
        bill.rehearsed = True


@contextmanager
def record_charges() -> Iterator[Bill]:
    """Record the charges made within the ``with`` statement, even if it raises; they are added to an enclosing ``counted`` as
    well.
    """
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
    """The budget of one run in USD; ``max_usd`` None is unlimited.

    The cost of a running job is only an estimate, so the limit can be exceeded by the estimation errors of the running jobs.
    """

    def __init__(self, max_usd: float | None):
        self.max_usd, self.spent_usd = max_usd, 0.0
        self._expected: dict[int, float] = {}

    def allows(self, expected_usd: float) -> bool:
        """Return whether a job may start: the sum spent plus the expected costs of it and all running jobs is within the
        limit.
        """
        if self.max_usd is None or expected_usd <= 0:
            return True
        return self.spent_usd + sum(self._expected.values()) + expected_usd <= self.max_usd

    def begin(self, ticket: int, expected_usd: float) -> None:
        """Record a job that starts, with its expected cost."""
        if expected_usd > 0:
            self._expected[ticket] = expected_usd

    def end(self, ticket: int, charged_usd: float) -> None:
        """Record the actual cost of a job that has ended."""
        self._expected.pop(ticket, None)
        self.spent_usd += charged_usd

    @property
    def has_no_running_jobs(self) -> bool:
        """True if no paid job is running, so that the sum spent is final."""
        return not self._expected

    def stop_reason(self, expected_usd: float) -> str:
        """Return the message for a job that may not start."""
        return (
            f"the next question costs about {expected_usd:.4f} USD, and {self.spent_usd:.4f} of at most"
            f" {self.max_usd:g} USD are spent; raise max_cost_usd, then rerun the command to resume"
        )
