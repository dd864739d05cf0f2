"""Driving a generator's job: waiting, failing, and what comes back."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.errors import BadReply, Rejected, Unavailable
from manitwin.models.generators.protocol import Generated, GenerationRequest, JobState
from manitwin.models.generators.run import run_generator

REQUEST = GenerationRequest(None, "a mug", None, seed=0)


class Scripted:
    """A generator that answers polls from a list, the last one for ever."""

    name = "scripted"
    model: str | None = None

    def __init__(self, *states: JobState, content: bytes = b"glTF"):
        self.states, self.content, self.polls = list(states), content, 0

    def submit(self, request: GenerationRequest) -> str:
        return "job"

    def poll(self, job_id: str) -> JobState:
        self.polls += 1
        return self.states[min(self.polls, len(self.states)) - 1]

    def fetch(self, job_id: str, folder: Path) -> Generated:
        (folder / "made.glb").write_bytes(self.content)
        return Generated(folder / "made.glb", None)


def test_waits_double_up_to_half_a_minute(tmp_path: Path) -> None:
    waits: list[float] = []
    generator = Scripted(*[JobState("running")] * 7, JobState("done"))
    made = run_generator(generator, REQUEST, tmp_path, sleep=waits.append)
    assert waits == [1, 2, 4, 8, 16, 30, 30] and made.path.read_bytes() == b"glTF"


def test_endless_job_is_unavailable_within_the_limit(tmp_path: Path) -> None:
    waits: list[float] = []
    with pytest.raises(Unavailable, match="still queued"):
        run_generator(Scripted(JobState("queued")), REQUEST, tmp_path, max_wait_s=100, sleep=waits.append)
    assert sum(waits) <= 100


def test_failed_job_is_rejected_in_the_generators_words(tmp_path: Path) -> None:
    with pytest.raises(Rejected, match="unsafe prompt") as caught:
        run_generator(Scripted(JobState("failed", "unsafe prompt")), REQUEST, tmp_path)
    assert caught.value.reason == "generator_failed" and caught.value.stage == "generate"


def test_empty_file_is_a_bad_reply(tmp_path: Path) -> None:
    with pytest.raises(BadReply, match="no mesh"):
        run_generator(Scripted(JobState("done"), content=b""), REQUEST, tmp_path)
