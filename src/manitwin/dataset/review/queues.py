"""Who judges what next: queues by annotator, a share of the twins judged by several of them."""

from __future__ import annotations

import hashlib
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

Done = Mapping[str, Collection[str]]
"""The annotators who have judged a twin as it is now, by its id."""


@dataclass(frozen=True)
class Plan:
    """A sample in its order, and how much of it ``raters`` annotators judge independently: the share ``overlap``."""

    twins: tuple[str, ...]
    seed: int
    overlap: float = 0.2
    raters: int = 2

    def wanted(self, twin_id: str) -> int:
        """Return how many annotators a twin is judged by: a draw of the seed, whatever else is in the sample."""
        return self.raters if _share(self.seed, twin_id, "overlap") < self.overlap else 1

    def assigned(self, twin_id: str, annotators: Collection[str]) -> tuple[str, ...]:
        """Return whose a twin is: those with the highest hashes (rendezvous hashing, Thaler and Ravishankar 1998).

        An annotator who joins takes an even share from all others, and moves nothing between them.
        """
        ranked = sorted(annotators, key=lambda name: (_share(self.seed, twin_id, f"rater {name}"), name), reverse=True)
        return tuple(ranked[: self.wanted(twin_id)])


def queue_of(annotator: str, plan: Plan, annotators: Sequence[str], done: Done) -> list[str]:
    """Return the ids that an annotator is to judge, in order.

    First their own; then, from the end, those of others that lack verdicts, so that nobody is waited for.
    """
    own, lacking = list[str](), list[str]()
    for twin_id in plan.twins:
        judges = done.get(twin_id, ())
        if annotator in judges or len(judges) >= plan.wanted(twin_id):
            continue
        (own if annotator in plan.assigned(twin_id, annotators) else lacking).append(twin_id)
    return own + lacking[::-1]


def share_of(annotator: str, plan: Plan, annotators: Sequence[str], done: Done) -> list[str]:
    """Return what of an annotator's queue is their own; where that is done, what others have left."""
    queue = queue_of(annotator, plan, annotators, done)
    return [each for each in queue if annotator in plan.assigned(each, annotators)] or queue


def _share(seed: int, twin_id: str, what: str) -> float:
    digest = hashlib.sha256(f"{seed}:{twin_id}:{what}".encode()).digest()
    return int.from_bytes(digest[:8], "big") / 2**64
