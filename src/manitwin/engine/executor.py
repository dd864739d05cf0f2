"""Who does the jobs: the border to process pools and clusters, and the simplest one."""

from __future__ import annotations

import time
from typing import Protocol

from manitwin.config import Resource
from manitwin.engine.jobs import Job, Reply, WorkerSetup
from manitwin.engine.stage import StagePart
from manitwin.engine.worker import Worker


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


class InlineExecutor:
    """Do every job at once in this process: to look at a stage with a debugger, and to test what drives it."""

    def __init__(self, setup: WorkerSetup, slots: int = 1):
        self._worker, self._slots = Worker(setup), slots
        self._ended: list[tuple[int, Reply]] = []

    def slots(self, needs: Resource) -> int:
        """Return the same for all."""
        return self._slots

    def submit(self, ticket: int, job: Job) -> None:
        """Do it."""
        self._ended.append((ticket, self._worker.do(job)))

    def ended(self, timeout_s: float) -> list[tuple[int, Reply]]:
        """Return what was done since the last call; sleep where that is nothing."""
        if not self._ended:
            time.sleep(timeout_s)
        ended, self._ended = self._ended, []
        return ended

    def parts(self) -> dict[int, StagePart]:
        """Return nothing: while a stage runs in this process, nobody asks."""
        return {}

    def close(self) -> None:
        """Nothing is open."""
