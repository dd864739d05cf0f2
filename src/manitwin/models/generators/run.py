"""Run a generator's job to its end, across crashes of this process, without paying for it twice."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.config import GenerateConfig
from manitwin.engine.charges import charge
from manitwin.engine.job_memory import JobMemory, NullJobMemory
from manitwin.errors import BackendError, BadReply, Rejected, Unavailable
from manitwin.models.generators.generated_mesh import find_flaw
from manitwin.models.generators.protocol import Generated, GenerationRequest, Generator
from manitwin.models.services.refusal import AnswerLost, NotFound

FIRST_WAIT_S = 1.0
LONGEST_WAIT_S = 30.0


def run_generator(
    generator: Generator,
    request: GenerationRequest,
    folder: Path,
    *,
    settings: GenerateConfig,
    jobs: JobMemory,
    submit_again: bool = False,
    sleep: Callable[[float], None] = time.sleep,
    flaw_of: Callable[[Path], str | None] = find_flaw,
) -> Generated:
    """Return the mesh for ``request``, written into ``folder``.

    A job that was submitted before is polled again. Waits double from 1 s to 30 s and add up to at most
    ``settings.max_wait_s`` (the sum of the waits, not clock time). A job that fails, or whose mesh is unusable, is repeated
    with the next seed, up to ``settings.attempts`` times in total; ``flaw_of`` tells whether a mesh is unusable, for meshes
    by the failure classes of the paper's "Asset Generation". A job that the service no longer knows is submitted again. Jobs
    of services (``needs`` "generator") are stored with their cost, also after success, so that a crash before the result is
    stored loses neither. ``submit_again`` permits what may be paid for twice: to submit again after a paid submit that was
    interrupted before its answer arrived.

    Raises Rejected ``generator_failed`` with the reason for every attempt, Unavailable if a job does not finish (it stays
    stored), BadReply if an interrupted submit is stored or no file was written, and the errors of the generator itself.
    """
    service = generator.needs == "generator"
    drive = _JobRun(
        generator,
        folder,
        jobs if service else NullJobMemory(),
        request_digest(generator, request, settings),
        settings.max_wait_s,
        sleep,
        flaw_of,
    )
    try:
        return _run_attempts(drive, request, settings.attempts, submit_again)
    except (Exception, KeyboardInterrupt):
        drive.settle()  # the caller counts the charges after an error, unlike after a crash
        raise


def _run_attempts(drive: _JobRun, request: GenerationRequest, attempts: int, submit_again: bool) -> Generated:
    """Poll or submit until an attempt succeeds; raises Rejected if all attempts fail."""
    note = drive.load_note(submit_again)
    while note.job_id is not None or note.attempt < attempts:
        recalled = note.job_id is not None
        if not recalled:
            note = drive.submit_job(replace(request, seed=request.seed + note.attempt), note)
        try:
            return drive.wait_and_fetch(str(note.job_id))
        except NotFound:
            if not recalled:
                raise
            note = replace(note, job_id=None)
        except _Failed as failure:
            note = replace(note, attempt=note.attempt + 1, job_id=None, failures=(*note.failures, str(failure)))
    drive.forget()
    raise Rejected("generator_failed", f"{drive.generator.name}: {_format_failures(note.failures)}", "generate")


def request_digest(generator: Generator, request: GenerationRequest, settings: GenerateConfig) -> str:
    """Return the digest under which a request's job is stored: of the request, the generator, its model and its options."""
    asked: dict[str, Any] = {
        "generator": generator.name,
        "model": generator.model,
        "options": settings.options,
        "text": request.text,
        "name": request.name,
        "seed": request.seed,
        "shape": None if request.rgba is None else request.rgba.shape,
    }
    if request.views:
        asked["views"] = [(view.turn_deg, view.rgba.shape) for view in request.views]
    if any(view.pose is not None for view in request.views):
        asked["poses"] = [None if view.pose is None else view.pose.world_to_camera.tolist() for view in request.views]
    digest = hashlib.sha256(json.dumps(asked, sort_keys=True).encode())
    for view in request.views:
        digest.update(np.ascontiguousarray(view.rgba).tobytes())
    if request.rgba is not None:
        digest.update(np.ascontiguousarray(request.rgba).tobytes())
    return digest.hexdigest()[:32]


class _Failed(Exception):
    """A failed attempt, with a message for the user."""


@dataclass(frozen=True)
class _Note:
    """Stored state of a request: the number of the attempt, its job, and the reasons why earlier attempts failed.

    ``submitting`` is true while a submit is in progress, so it stays true after a crash during one. ``unsettled_usd`` was
    charged by a process that may have crashed before the amount was counted; the next process charges it again.
    """

    attempt: int = 0
    job_id: str | None = None
    failures: tuple[str, ...] = ()
    submitting: bool = False
    unsettled_usd: float = 0.0

    @classmethod
    def read(cls, text: str) -> _Note:
        value = json.loads(text)
        return cls(**{**value, "failures": tuple(value["failures"])})


@dataclass
class _JobRun:
    """State of one request while it is driven: its generator, stored note, and remaining waiting time."""

    generator: Generator
    folder: Path
    jobs: JobMemory
    digest: str
    remaining_s: float
    sleep: Callable[[float], None]
    flaw_of: Callable[[Path], str | None]
    stored_note: _Note | None = None

    def load_note(self, submit_again: bool) -> _Note:
        """Return the stored state of the request.

        Raises BadReply for a paid submit of unknown outcome, unless ``submit_again``.
        """
        text = self.jobs.recall(self.digest)
        if text is None:
            return _Note()
        note = self.stored_note = _Note.read(text)
        charge(note.unsettled_usd)
        if note.submitting and self.generator.usd_per_job and not submit_again:
            raise BadReply(
                f"{self.generator.name}: an earlier submission was interrupted before the answer arrived, so a paid"
                f" job may be lost; check the jobs of your account, then set services.submit_again = true and run again"
            )
        return replace(note, submitting=False)

    def submit_job(self, request: GenerationRequest, note: _Note) -> _Note:
        """Submit a job and store it; its cost is charged as soon as the service may have accepted it."""
        usd = self.generator.usd_per_job
        if usd:
            # a crash from here on leaves a note with ``submitting`` set
            self._store_note(replace(note, submitting=True, unsettled_usd=note.unsettled_usd + usd))
        try:
            job_id = self.generator.submit(request)
        except AnswerLost:
            charge(usd)
            raise
        except (BackendError, Rejected):
            if note == _Note():
                self.forget()
            else:
                self._store_note(note)
            raise
        charge(usd)
        note = replace(note, job_id=job_id, unsettled_usd=note.unsettled_usd + usd)
        self._store_note(note)
        return note

    def wait_and_fetch(self, job_id: str) -> Generated:
        """Return the mesh of a job; raises _Failed, Gone, Unavailable, and BadReply if no file was written."""
        self._wait_for(job_id)
        generated = self.generator.fetch(job_id, self.folder)
        if not generated.path.is_file() or generated.path.stat().st_size == 0:
            generated.path.unlink(missing_ok=True)
            raise BadReply(f"{self.generator.name}: its job is done but left no mesh; run it again")
        wrong = None if self.generator.needs in ("cpu", "vlm") else self.flaw_of(generated.path)
        if wrong is not None:
            generated.path.unlink()
            raise _Failed(wrong)
        return generated

    def _wait_for(self, job_id: str) -> None:
        """Poll with growing pauses until the job is done; raises _Failed if it failed, Unavailable if time runs out."""
        pause = FIRST_WAIT_S
        while (job := self.generator.poll(job_id)).state not in ("done", "failed"):
            if pause > self.remaining_s:
                raise Unavailable(
                    f"{self.generator.name}: its job is still {job.state} after all of generate.max_wait_s; the job"
                    f" is remembered; run again later"
                )
            self.sleep(pause)
            self.remaining_s -= pause
            pause = min(2 * pause, LONGEST_WAIT_S)
        if job.state == "failed":
            raise _Failed(job.message or "its job failed and it gave no reason")

    def settle(self) -> None:
        """Record that the charges have been counted."""
        if self.stored_note is not None and self.stored_note.unsettled_usd:
            self._store_note(replace(self.stored_note, unsettled_usd=0.0))

    def forget(self) -> None:
        """Delete the stored state."""
        self.jobs.forget(self.digest)
        self.stored_note = None

    def _store_note(self, note: _Note) -> None:
        self.stored_note = note
        self.jobs.note(self.digest, json.dumps(asdict(note)))


def _format_failures(failures: tuple[str, ...]) -> str:
    if len(set(failures)) == 1:
        return failures[0] if len(failures) == 1 else f"{len(failures)} times in {len(failures)}: {failures[0]}"
    return "; ".join(f"attempt {number}: {why}" for number, why in enumerate(failures, 1))
