"""Statistics of verdicts: accuracy by dimension and prompt version, agreement, annotator progress."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from manitwin.dataset.review.agreement import Agreement, agreement_of
from manitwin.dataset.review.store import Stored
from manitwin.dataset.review.verdicts import ANSWERS, DIMENSIONS, PAPER_ACCURACY, Dimension
from manitwin.twin.proportions import wilson_interval


@dataclass(frozen=True)
class Accuracy:
    """Number of twins per majority answer in one dimension.

    ``undecided`` twins have as many yes as no answers, or only "unsure"; they count neither as right nor as wrong. The interval
    is the 95 % Wilson interval of ``right`` among ``right + wrong``; ``share`` is None if that sum is zero.
    """

    dimension: Dimension
    right: int
    wrong: int
    undecided: int
    unsure_answers: int
    agreement: Agreement

    @property
    def share(self) -> float | None:
        """Share of right twins among the decided ones; None if there are none."""
        judged = self.right + self.wrong
        return self.right / judged if judged else None

    @property
    def interval(self) -> tuple[float, float]:
        """95 % Wilson interval of ``share``."""
        return wilson_interval(self.right, self.right + self.wrong)

    @property
    def paper(self) -> float | None:
        """Accuracy reported in the paper; None if not reported."""
        return PAPER_ACCURACY.get(self.dimension)


@dataclass(frozen=True)
class Speed:
    """An annotator's progress: standing reviews, twins left in the queue, withdrawn reviews, and the median time of a review."""

    annotator: str
    reviews: int
    left: int
    undone: int
    median_s: float | None

    @property
    def left_s(self) -> float | None:
        """Estimated time for the rest in seconds; None if no time was measured."""
        return None if self.median_s is None else self.left * self.median_s


@dataclass(frozen=True)
class PromptVersion:
    """Number of yes, no and unsure answers on annotations of one prompt version, and the ids of the twins with a no."""

    dimension: Dimension
    prompt: str
    yes: int
    no: int
    unsure: int
    disagreeing: tuple[str, ...]

    @property
    def interval(self) -> tuple[float, float]:
        """95 % Wilson interval of the share of yes among yes and no answers; a twin may have several answers."""
        return wilson_interval(self.yes, self.yes + self.no)


def accuracies(reviews: Iterable[Stored]) -> list[Accuracy]:
    """Return the accuracy of every dimension. ``reviews`` has at most one review per annotator and twin."""
    found = list(reviews)
    return [_accuracy(dimension, found) for dimension in DIMENSIONS]


def _accuracy(dimension: Dimension, reviews: Sequence[Stored]) -> Accuracy:
    ratings: dict[str, dict[str, str]] = {}
    for review in (stored.review for stored in reviews):
        if dimension in review.answers:
            ratings.setdefault(review.twin_id, {})[review.annotator] = review.answers[dimension]
    decisions = Counter(majority(of.values()) for of in ratings.values())
    unsure = sum(answer == "unsure" for of in ratings.values() for answer in of.values())
    agreement = agreement_of(ratings, ANSWERS)
    return Accuracy(dimension, decisions["yes"], decisions["no"], decisions["unsure"], unsure, agreement)


def majority(answers: Iterable[str]) -> str:
    """Return the majority of 'yes' and 'no' answers; 'unsure' for a tie."""
    counts = Counter(answers)
    if counts["yes"] == counts["no"]:
        return "unsure"
    return "yes" if counts["yes"] > counts["no"] else "no"


def speeds(reviews: Iterable[Stored], queues: Mapping[str, Collection[str]], undone: Mapping[str, int]) -> list[Speed]:
    """Return the progress of every annotator with a queue, reviews or withdrawals, sorted by name."""
    counts: Counter[str] = Counter()
    seconds: dict[str, list[float]] = {}
    for review in (stored.review for stored in reviews):
        counts[review.annotator] += 1
        if review.seconds is not None:
            seconds.setdefault(review.annotator, []).append(review.seconds)
    names = sorted({*counts, *queues, *undone})
    return [
        Speed(
            name, counts[name], len(queues.get(name, ())), undone.get(name, 0),
            median(seconds[name]) if name in seconds else None,
        )
        for name in names
    ]  # fmt: skip


def prompt_versions(reviews: Iterable[Stored]) -> list[PromptVersion]:
    """Return the answers per prompt version, by dimension, those with most disagreement first."""
    answers: dict[tuple[Dimension, str], Counter[str]] = {}
    disagreeing: dict[tuple[Dimension, str], dict[str, None]] = {}
    for review in (stored.review for stored in reviews):
        for dimension, answer in review.answers.items():
            key = dimension, review.prompts.get(dimension, "not said")
            answers.setdefault(key, Counter())[answer] += 1
            if answer == "no":
                disagreeing.setdefault(key, {})[review.twin_id] = None
    found = [
        PromptVersion(*key, of["yes"], of["no"], of["unsure"], tuple(sorted(disagreeing.get(key, ()))))
        for key, of in answers.items()
    ]
    return sorted(found, key=lambda each: (DIMENSIONS.index(each.dimension), -each.no, each.prompt))
