"""What the tests of generation services share: a photo, settings without waits, and where a key must never show."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Iterable
from pathlib import Path

import numpy as np
import pytest

from manitwin.config import BuildConfig, GenerateConfig, ServicesConfig
from manitwin.errors import ManiTwinError
from manitwin.models.fakes.server import FakeServer
from manitwin.models.generators.protocol import Generated, GenerationRequest, Generator

KEY = "msy_k3y-that-nobody-may-see"
TEXT = GenerationRequest(None, "a blue bottle", None, seed=0)


def photo() -> GenerationRequest:
    """Ask for a mesh of a red disc on nothing."""
    rows, columns = np.mgrid[:48, :40]
    inside = (rows - 24) ** 2 + (columns - 20) ** 2 < 15**2
    rgba = np.zeros((48, 40, 4), np.uint8)
    rgba[inside] = (200, 30, 20, 255)
    return GenerationRequest(rgba, None, "disc", seed=3)


def settings(*, options: dict[str, str | int | float | bool] | None = None, **services: object) -> BuildConfig:
    """Return settings with two retries and a patience that a busy machine needs."""
    given = {"retries": 2, "timeout_s": 20.0, "longest_wait_s": 30.0, **services}
    generate = GenerateConfig(max_wait_s=60, attempts=1, options=options or {})
    return BuildConfig(generate=generate, services=ServicesConfig.model_validate(given))


class KeptJobs:
    """A memory of jobs that outlives generators."""

    def __init__(self) -> None:
        self.notes: dict[str, str] = {}

    def recall(self, request: str) -> str | None:
        return self.notes.get(request)

    def note(self, request: str, job_id: str) -> None:
        self.notes[request] = job_id

    def forget(self, request: str) -> None:
        self.notes.pop(request, None)


def made(generator: Generator, request: GenerationRequest, folder: Path) -> Generated:
    """Drive a job to its end without waiting."""
    return finished(generator, generator.submit(request), folder)


def finished(generator: Generator, job_id: str, folder: Path) -> Generated:
    """Poll a job to its end without waiting, and fetch it."""
    for _ in range(20):
        job = generator.poll(job_id)
        assert job.state != "failed", job.message
        if job.state == "done":
            return generator.fetch(job_id, folder)
    raise AssertionError(f"{job_id} is not done")


def asked(server: FakeServer) -> list[str]:
    """Return what a server was asked, ids left out."""
    return [f"{r.method} {'/'.join('ID' if _is_id(p) else p for p in r.path.split('/'))}" for r in server.requests]


def _is_id(part: str) -> bool:
    return part.count("-") == 4


def refused(error: type[ManiTwinError], what: Callable[[], object], key: str = KEY) -> str:
    """Return the message of an error, having looked for the key in all that it would print."""
    with pytest.raises(error) as caught:
        what()
    assert key not in "".join(traceback.format_exception(caught.value))
    return str(caught.value)


def check_key_is_nowhere(things: Iterable[object], folder: Path, servers: Iterable[FakeServer], files: str) -> None:
    """Assert that the key is in no file, no representation and no request for a file, and in each other request's header."""
    for thing in things:
        assert KEY not in repr(thing)
    for path in folder.rglob("*"):
        assert not path.is_file() or KEY.encode() not in path.read_bytes()
    for server in servers:
        for request in server.requests:
            holds = KEY in str(request.headers)
            assert holds != request.path.startswith(files), request.path
            assert KEY.encode() not in request.body and KEY not in request.path + str(request.query)
