"""Annotator queues: who judges which twin next, with a share of the twins judged by several annotators."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

Done = Mapping[str, Collection[str]]
"""The annotators who have judged the current revision of a twin, by twin id."""


@dataclass(frozen=True)
class Plan:
    """A sample in review order. A share ``overlap`` of it is judged independently by ``raters`` annotators."""

    twins: tuple[str, ...]
    seed: int
    overlap: float = 0.2
    raters: int = 2

    def wanted(self, twin_id: str) -> int:
        """Return how many annotators judge a twin: drawn by the seed, independently of the other twins in the sample."""
        return self.raters if _share(self.seed, twin_id, "overlap") < self.overlap else 1

    def assigned(self, twin_id: str, annotators: Collection[str]) -> tuple[str, ...]:
        """Return the annotators assigned to a twin: those with the highest hashes (rendezvous hashing, Thaler and Ravishankar
        1998).

        A new annotator takes an even share from all others; nothing moves between existing annotators.
        """
        ranked = sorted(annotators, key=lambda name: (_share(self.seed, twin_id, f"rater {name}"), name), reverse=True)
        return tuple(ranked[: self.wanted(twin_id)])


def queue_of(annotator: str, plan: Plan, annotators: Sequence[str], done: Done) -> list[str]:
    """Return the ids that an annotator is to judge, in order.

    The annotator's own twins come first, then twins of other annotators that still lack verdicts, in reverse order, so that slow
    annotators block nobody.
    """
    own, lacking = list[str](), list[str]()
    for twin_id in plan.twins:
        judges = done.get(twin_id, ())
        if annotator in judges or len(judges) >= plan.wanted(twin_id):
            continue
        (own if annotator in plan.assigned(twin_id, annotators) else lacking).append(twin_id)
    return own + lacking[::-1]


def share_of(annotator: str, plan: Plan, annotators: Sequence[str], done: Done) -> list[str]:
    """Return the annotator's own part of the queue; once it is done, what others have left."""
    queue = queue_of(annotator, plan, annotators, done)
    return [each for each in queue if annotator in plan.assigned(each, annotators)] or queue


def _share(seed: int, twin_id: str, what: str) -> float:
    digest = hashlib.sha256(f"{seed}:{twin_id}:{what}".encode()).digest()
    return int.from_bytes(digest[:8], "big") / 2**64
