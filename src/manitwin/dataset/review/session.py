"""State of a running review server: annotator queues, and confirmed and withdrawn reviews. Thread-safe."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from manitwin.dataset.index.query import Index
from manitwin.dataset.review.plan import require_annotator
from manitwin.dataset.review.queues import Plan, queue_of, share_of
from manitwin.dataset.review.review_subjects import check_corrections, prompts_of, revisions
from manitwin.dataset.review.store import ReviewStore, Stored
from manitwin.dataset.review.verdicts import Review, reason_of
from manitwin.errors import UsageError
from manitwin.twin.record import TwinRecord

FRESH_S = 10.0
"""Seconds for which the list of twin revisions is cached; a rebuilt twin enters the queue with at most this delay."""


class ReviewRequest(BaseModel):
    """Request body that confirms a review. ``request`` is an id chosen by the page, so that a repeated request counts once."""

    model_config = ConfigDict(extra="forbid")

    request: str = Field(min_length=8, max_length=64, pattern=r"^[0-9a-f-]+$")
    revision: str = Field(max_length=128)
    answers: dict[str, str]
    corrections: dict[str, Any] = Field(default_factory=dict)
    note: str = ""
    seconds: float | None = None


@dataclass(frozen=True)
class Progress:
    """An annotator's progress: standing reviews of the sample, twins left of their share, and the median time of a review."""

    reviewed: int
    left: int
    median_s: float | None = None


class ReviewSession:
    """The annotators, the sample and the store of one server."""

    def __init__(self, store: ReviewStore, index: Index, plan: Plan, annotators: Sequence[str], *, blind: bool = False):
        self.store, self.plan, self.blind = store, plan, blind
        self.annotators = [require_annotator(name) for name in annotators]
        self._index, self._lock = index, threading.Lock()
        self._later: dict[str, list[str]] = {}
        self._now: tuple[float, Mapping[str, str]] = (float("-inf"), {})
        for name in self.annotators:
            store.add_annotator(name)

    def queue(self, annotator: str, after: str | None = None) -> list[str]:
        """Return the ids of an annotator's queue. The twin ``after`` is moved to its end for the lifetime of the server."""
        queue = self._queue(annotator)
        with self._lock:
            later = self._later.setdefault(annotator, [])
            if after is not None and after in queue:
                later[:] = [each for each in later if each != after and each in queue] + [after]
            places = {twin_id: place for place, twin_id in enumerate(later)}
        return sorted(queue, key=lambda twin_id: places.get(twin_id, -1))

    def progress(self, annotator: str) -> Progress:
        """Return the progress of an annotator."""
        now, judged = self._revisions(), self.store.annotators_by_revision()
        done = sum(annotator in judged.get(twin_id, {}).get(now.get(twin_id, ""), ()) for twin_id in self.plan.twins)
        return Progress(done, len(self._queue(annotator, share_of)), self.store.median_seconds(annotator))

    def confirm(self, annotator: str, record: TwinRecord, body: Mapping[str, Any]) -> None:
        """Store a review; raises UsageError for an invalid ``body``, and for a twin that was rebuilt since it was shown."""
        try:
            said = ReviewRequest.model_validate(body)
            if said.revision != record.revision:
                raise UsageError(f"{record.twin_id} was rebuilt since it was shown; reload the page")
            review = Review.model_validate(
                {
                    **said.model_dump(exclude={"request"}), "annotator": annotator, "twin_id": record.twin_id,
                    "blind": self.blind, "prompts": prompts_of(record),
                }
            )  # fmt: skip
        except ValidationError as error:
            raise UsageError(reason_of(error)) from error
        check_corrections(record, review.corrections)
        self.store.add([review], [f"{annotator}:{said.request}"])

    def undo(self, annotator: str, request: str) -> Stored | None:
        """Withdraw the last review of an annotator and return it; None if there is none."""
        return self.store.undo(annotator, f"{annotator}:{request[:64]}")

    def _queue(self, annotator: str, of: Callable[..., list[str]] = queue_of) -> list[str]:
        now, judged = self._revisions(), self.store.annotators_by_revision()
        names = sorted({*self.annotators, *self.store.annotators()})
        there = Plan(tuple(t for t in self.plan.twins if t in now), self.plan.seed, self.plan.overlap, self.plan.raters)
        done = {twin_id: judged.get(twin_id, {}).get(now[twin_id], set()) for twin_id in there.twins}
        return of(annotator, there, names, done)

    def _revisions(self, clock: Callable[[], float] = time.monotonic) -> Mapping[str, str]:
        with self._lock:
            if clock() - self._now[0] > FRESH_S:
                self._now = (clock(), revisions(self._index))
            return self._now[1]
