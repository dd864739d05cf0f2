"""The protocol of executors: the border to process pools and clusters."""

from __future__ import annotations

from typing import Protocol

from manitwin.config import Resource
from manitwin.engine.jobs import Job, Reply
from manitwin.engine.stage import StagePart


class Executor(Protocol):
    """Slots for each resource; a job that is submitted comes back exactly once, with an answer or a Failure."""

    def slots(self, needs: Resource) -> int:
        """Return how many jobs of a resource run at a time, now: machines may come and go."""
        ...

    def submit(self, ticket: int, job: Job) -> None:
        """Give a job to a free slot, or to the short queue before it; ``ticket`` names it in ``ended``."""
        ...

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Wait until a job has ended, or the time is up; returns all that have ended."""
        ...

    def parts(self) -> dict[int, StagePart]:
        """Return how much the stages that run have done, by ticket, where they say so and it is time to look."""
        ...

    def close(self) -> None:
        """Stop: jobs that run are cut off."""
        ...
