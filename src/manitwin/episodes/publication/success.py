"""How often each object was handled, of the attempts that a publication may tell of."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from manitwin.episodes.attempt import Attempt


@dataclass
class Tally:
    """Counts of attempts by how far they came."""

    attempted: int = 0
    executed: int = 0
    succeeded: int = 0
    kept: int = 0

    def add(self, attempt: Attempt) -> None:
        """Count one."""
        self.attempted += 1
        self.executed += attempt.planned
        self.succeeded += attempt.succeeded
        self.kept += attempt.outcome == "kept"


@dataclass(frozen=True)
class Success:
    """Attempts in all, by category and by outcome, and the objects (id, category) that never succeeded."""

    total: Tally = field(default_factory=Tally)
    by_category: Mapping[str, Tally] = field(default_factory=dict)
    outcomes: Mapping[str, int] = field(default_factory=dict)
    never: tuple[tuple[str, str], ...] = ()


def success_of(attempts: Iterable[Attempt]) -> Success:
    """Count attempts."""
    total, by_category, outcomes = Tally(), dict[str, Tally](), Counter[str]()
    categories, successful = dict[str, str](), set[str]()
    for attempt in attempts:
        total.add(attempt)
        outcomes[attempt.outcome] += 1
        if attempt.twin_id:
            by_category.setdefault(attempt.category, Tally()).add(attempt)
            categories.setdefault(attempt.twin_id, attempt.category)
            if attempt.succeeded:
                successful.add(attempt.twin_id)
    return Success(
        total,
        dict(sorted(by_category.items())),
        dict(sorted(outcomes.items(), key=lambda item: (-item[1], item[0]))),
        tuple(sorted((each, name) for each, name in categories.items() if each not in successful)),
    )
