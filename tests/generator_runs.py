"""Runs of generators against their fake services, and the crashes that they have to survive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import BuildConfig
from manitwin.engine.charges import record_charges
from manitwin.engine.job_memory import JobMemory, RootJobMemory
from manitwin.models.generators.protocol import Generated, GenerationRequest, Generator, JobState
from manitwin.models.generators.run import run_generator
from manitwin.twin.dataset_root import DatasetRoot

KEY = "rehearsal-key-of-tests"
USD = 0.5


def photo_request(seed: int = 7) -> GenerationRequest:
    """A matted photo of a red disc."""
    rows, columns = np.mgrid[:96, :64]
    rgba = np.zeros((96, 64, 4), np.uint8)
    rgba[(rows - 48) ** 2 + (columns - 32) ** 2 < 25**2] = (200, 30, 30, 255)
    return GenerationRequest(rgba, None, "disc", seed)


def text_request(seed: int = 7) -> GenerationRequest:
    return GenerationRequest(None, "a capped bottle", None, seed)


def config(
    *, options: dict[str, Any] | None = None, attempts: int = 2, usd: float | None = USD, **services: Any
) -> Any:
    """Settings of a build with a price, so that what is paid is counted on this machine as well."""
    return BuildConfig.model_validate(
        {
            "generate": {"options": options or {}, "attempts": attempts, "max_wait_s": 600},
            "services": {"usd_per_job": usd, "timeout_s": 30, "retries": 2, **services},
        }
    )


@dataclass
class Ran:
    """What a run came to; ``waits`` in seconds, none of them waited."""

    made: Generated | None
    error: Exception | None
    usd: float
    waits: list[float]


def run(
    generator: Generator,
    folder: Path,
    settings: BuildConfig,
    *,
    request: GenerationRequest | None = None,
    jobs: JobMemory | None = None,
    submit_again: bool = False,
    waits: list[float] | None = None,
) -> Ran:
    """Run a generator to its end, whatever that is; jobs are remembered in a folder beside the meshes."""
    waits = [] if waits is None else waits
    folder.mkdir(parents=True, exist_ok=True)
    made, error = None, None
    with record_charges() as bill:
        try:
            made = run_generator(
                generator,
                request or photo_request(),
                folder,
                settings=settings.generate,
                jobs=jobs or memory(folder),
                submit_again=submit_again,
                sleep=waits.append,
            )
        except Exception as failure:
            error = failure
    return Ran(made, error, bill.usd, waits)


def memory(folder: Path) -> RootJobMemory:
    return RootJobMemory(DatasetRoot(folder), "jobs")


class Crash(BaseException):
    """The end of a process, as far as one process can show it."""


@dataclass
class Fuse:
    """Ends the process at the ``at``-th step, counted from 0."""

    at: int
    steps: list[str] = field(default_factory=list)

    def step(self, name: str) -> None:
        self.steps.append(name)
        if len(self.steps) - 1 == self.at:
            raise Crash(name)

    def around(self, name: str, work: Callable[[], Any]) -> Any:
        self.step(f"before {name}")
        result = work()
        self.step(f"after {name}")
        return result


class FusedMemory:
    def __init__(self, inner: JobMemory, fuse: Fuse):
        self.inner, self.fuse = inner, fuse

    def recall(self, request: str) -> str | None:
        return self.fuse.around("recall", lambda: self.inner.recall(request))

    def note(self, request: str, job_id: str) -> None:
        self.fuse.around("note", lambda: self.inner.note(request, job_id))

    def forget(self, request: str) -> None:
        self.fuse.around("forget", lambda: self.inner.forget(request))


class FusedGenerator:
    def __init__(self, inner: Generator, fuse: Fuse):
        self.inner, self.fuse = inner, fuse
        self.name, self.model, self.needs, self.usd_per_job = inner.name, inner.model, inner.needs, inner.usd_per_job

    def submit(self, request: GenerationRequest) -> str:
        return self.fuse.around("submit", lambda: self.inner.submit(request))

    def poll(self, job_id: str) -> JobState:
        return self.fuse.around("poll", lambda: self.inner.poll(job_id))

    def fetch(self, job_id: str, folder: Path) -> Generated:
        return self.fuse.around("fetch", lambda: self.inner.fetch(job_id, folder))
