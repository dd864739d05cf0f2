"""Driving a generator's job: waiting, failing, asking again, and what is remembered."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from generator_runs import photo_request
from manitwin.config import GenerateConfig
from manitwin.engine.charges import record_charges
from manitwin.engine.job_memory import NullJobMemory
from manitwin.errors import AccessDenied, BadReply, Rejected, Unavailable
from manitwin.models.fakes.meshes import bottle, glb, open_surface
from manitwin.models.generators.protocol import Generated, GenerationRequest, JobState
from manitwin.models.generators.run import request_digest, run_generator
from manitwin.models.services.refusal import AnswerLost, NotFound

REQUEST = GenerationRequest(None, "a mug", None, seed=5)
BOTTLE = glb([bottle()])
DONE = JobState("done")


class Scripted:
    """A service whose polls answer from a list, the last one for ever, and whose meshes come from another."""

    name = "scripted"
    model: str | None = "v1"
    needs: Any = "generator"

    def __init__(self, *states: JobState | Exception, meshes: tuple[bytes, ...] = (BOTTLE,), usd: float = 0.25):
        self.states, self.meshes, self.usd_per_job = states or (DONE,), meshes, usd
        self.polls, self.fetched, self.asked = 0, 0, list[int]()

    def submit(self, request: GenerationRequest) -> str:
        self.asked.append(request.seed)
        return f"job-{len(self.asked)}"

    def poll(self, job_id: str) -> JobState:
        self.polls += 1
        state = self.states[min(self.polls, len(self.states)) - 1]
        if isinstance(state, Exception):
            raise state
        return state

    def fetch(self, job_id: str, folder: Path) -> Generated:
        self.fetched += 1
        (folder / "made.glb").write_bytes(self.meshes[min(self.fetched, len(self.meshes)) - 1])
        return Generated(folder / "made.glb", None)


class Dictionary:
    """A memory that the test can look into."""

    def __init__(self) -> None:
        self.notes: dict[str, str] = {}

    def recall(self, request: str) -> str | None:
        return self.notes.get(request)

    def note(self, request: str, job_id: str) -> None:
        self.notes[request] = job_id

    def forget(self, request: str) -> None:
        self.notes.pop(request, None)


def _run(generator: Any, folder: Path, jobs: Any = None, **arguments: Any) -> Generated:
    settings = GenerateConfig(**{"max_wait_s": 100, "attempts": 2, **arguments.pop("settings", {})})
    arguments = {"sleep": lambda seconds: None, **arguments}
    return run_generator(generator, REQUEST, folder, settings=settings, jobs=jobs or Dictionary(), **arguments)


def test_waits_double_up_to_half_a_minute(tmp_path: Path) -> None:
    waits: list[float] = []
    generator = Scripted(*[JobState("running")] * 7, DONE)
    made = _run(generator, tmp_path, sleep=waits.append, settings={"max_wait_s": 1800})
    assert waits == [1, 2, 4, 8, 16, 30, 30] and made.path.read_bytes() == BOTTLE


def test_endless_job_is_unavailable_within_the_limit_and_stays_remembered(tmp_path: Path) -> None:
    waits: list[float] = []
    jobs, generator = Dictionary(), Scripted(JobState("queued"))
    with pytest.raises(Unavailable, match="still queued"):
        _run(generator, tmp_path, jobs, sleep=waits.append)
    assert 60 < sum(waits) <= 100 and len(jobs.notes) == 1
    generator.states = (DONE,)
    with record_charges() as bill:
        _run(generator, tmp_path, jobs)
    assert generator.asked == [5] and bill.usd == 0.0


def test_failed_job_is_asked_again_with_the_next_seed(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Scripted(JobState("failed", "out of memory"), DONE)
    with record_charges() as bill:
        made = _run(generator, tmp_path, jobs)
    assert generator.asked == [5, 6] and bill.usd == 0.5 and made.path.is_file()
    assert len(jobs.notes) == 1  # until the result is stored


def test_jobs_that_fail_for_good_are_rejected_in_the_generators_words(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Scripted(JobState("failed", "unsafe prompt"))
    with pytest.raises(Rejected, match="3 times in 3: unsafe prompt") as caught:
        _run(generator, tmp_path, jobs, settings={"attempts": 3})
    assert caught.value.reason == "generator_failed" and caught.value.stage == "generate"
    assert generator.asked == [5, 6, 7] and not jobs.notes


def test_rejection_names_what_was_wrong_at_each_attempt(tmp_path: Path) -> None:
    generator = Scripted(meshes=(BOTTLE[:1000], glb([open_surface()])))
    with pytest.raises(Rejected, match=r"attempt 1: .*truncated.*; attempt 2: .*watertight"):
        _run(generator, tmp_path)
    assert not list(tmp_path.iterdir())


def test_unusable_mesh_is_asked_for_again(tmp_path: Path) -> None:
    generator = Scripted(meshes=(glb([open_surface()]), BOTTLE))
    assert _run(generator, tmp_path).path.read_bytes() == BOTTLE
    assert generator.asked == [5, 6]


def test_known_failures_are_not_paid_for_again_after_a_crash(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Scripted(JobState("failed", "bad luck"), AccessDenied("no credit"))
    with pytest.raises(AccessDenied):
        _run(generator, tmp_path, jobs)
    assert generator.asked == [5, 6]
    generator.states = (JobState("failed", "bad luck again"),)
    with pytest.raises(Rejected, match="attempt 1: bad luck; attempt 2: bad luck again"):
        _run(generator, tmp_path, jobs)
    assert generator.asked == [5, 6]


def test_job_that_the_service_lost_is_submitted_again_once(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Scripted()
    _run(generator, tmp_path, jobs)
    generator.states, generator.polls = (NotFound("404"), DONE), 0
    with record_charges() as bill:
        _run(generator, tmp_path, jobs)
    # the first job's cost again: nobody can know that its result was stored, and the one that is counts all of it
    assert generator.asked == [5, 5] and bill.usd == 0.5
    generator.states = (NotFound("404"),)
    with pytest.raises(NotFound):
        _run(generator, tmp_path, jobs)
    assert generator.asked == [5, 5, 5]


class Broken(Scripted):
    """A service whose submits end in an error."""

    def __init__(self, error: Exception, **arguments: Any):
        super().__init__(**arguments)
        self.error: Exception | None = error

    def submit(self, request: GenerationRequest) -> str:
        job_id = super().submit(request)
        if self.error is not None:
            raise self.error
        return job_id


def test_unanswered_submit_is_never_repeated_unless_allowed(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Broken(AnswerLost("timed out"))
    with record_charges() as bill, pytest.raises(AnswerLost):
        _run(generator, tmp_path, jobs)
    assert bill.usd == 0.25  # it may have been paid for
    generator.error = None
    with pytest.raises(BadReply, match=r"services\.submit_again = true"):
        _run(generator, tmp_path, jobs)
    assert len(generator.asked) == 1
    _run(generator, tmp_path, jobs, submit_again=True)
    assert generator.asked == [5, 5]


def test_unanswered_submit_of_a_free_service_is_repeated(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Broken(AnswerLost("timed out"), usd=0.0)
    with pytest.raises(AnswerLost):
        _run(generator, tmp_path, jobs)
    generator.error = None
    assert _run(generator, tmp_path, jobs).path.is_file()


@pytest.mark.parametrize("error", [AccessDenied("no"), Unavailable("HTTP 500"), Rejected("generator_failed", "unsafe")])
def test_refused_submit_is_neither_charged_nor_remembered(tmp_path: Path, error: Exception) -> None:
    jobs = Dictionary()
    with record_charges() as bill, pytest.raises(type(error)):
        _run(Broken(error), tmp_path, jobs)
    assert bill.usd == 0 and not jobs.notes


def test_empty_file_is_a_bad_reply_and_the_job_stays_remembered(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Scripted(meshes=(b"", BOTTLE))
    with pytest.raises(BadReply, match="no mesh"):
        _run(generator, tmp_path, jobs)
    assert _run(generator, tmp_path, jobs).path.is_file() and generator.asked == [5]


def test_jobs_that_end_with_the_process_are_not_remembered(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Scripted(meshes=(b"not looked at",))
    generator.needs = "cpu"
    _run(generator, tmp_path, jobs)
    assert not jobs.notes


def test_nothing_is_needed_of_a_memory_that_keeps_nothing(tmp_path: Path) -> None:
    assert _run(Scripted(), tmp_path, NullJobMemory()).path.is_file()


def test_digest_tells_requests_apart() -> None:
    generator, settings, request = Scripted(), GenerateConfig(), photo_request()
    rgba = np.array(request.rgba)
    rgba[0, 0, 0] ^= 1
    others = [
        replace(request, seed=8),
        replace(request, rgba=rgba),
        replace(request, rgba=request.rgba.reshape(64, 96, 4)),
        replace(request, rgba=None, text="a mug"),
        replace(request, rgba=None, text="a jug"),
    ]
    digests = {request_digest(generator, r, settings) for r in [request, *others]}
    digests.add(request_digest(generator, request, GenerateConfig(options={"tier": "Sketch"})))
    generator.model = "v2"
    digests.add(request_digest(generator, request, settings))
    assert len(digests) == 8
    generator.model = "v1"
    patient = GenerateConfig(attempts=5, max_wait_s=1)  # how long one waits is no part of what is asked
    assert request_digest(generator, photo_request(), patient) in digests


def test_an_attempt_that_waits_is_counted_once(tmp_path: Path) -> None:
    jobs, generator = Dictionary(), Scripted(JobState("running"))
    with record_charges() as first, pytest.raises(Unavailable):
        _run(generator, tmp_path, jobs)
    generator.states = (DONE,)
    with record_charges() as second:
        _run(generator, tmp_path, jobs)
    assert (first.usd, second.usd) == (0.25, 0.0) and generator.asked == [5]
