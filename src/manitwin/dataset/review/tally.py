"""What the verdicts add up to: accuracy by dimension and by prompt version, agreement, progress."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from statistics import median

from manitwin.dataset.review.agreement import Agreement, agreement_of
from manitwin.dataset.review.store import Stored
from manitwin.dataset.review.verdicts import ANSWERS, DIMENSIONS, PAPER_ACCURACY, Dimension
from manitwin.twin.shares import wilson_interval


@dataclass(frozen=True)
class Accuracy:
    """Twins by what most of their annotators answered in one dimension.

    ``undecided`` are those on which as many said yes as no, or all are unsure: they count neither as right nor as wrong. The
    interval is Wilson's at 95 %, of ``right`` among ``right + wrong``; ``share`` is None where that is nothing.
    """

    dimension: Dimension
    right: int
    wrong: int
    undecided: int
    unsure_answers: int
    agreement: Agreement

    @property
    def share(self) -> float | None:
        """The share of the judged twins that are right; None where none is judged."""
        judged = self.right + self.wrong
        return self.right / judged if judged else None

    @property
    def interval(self) -> tuple[float, float]:
        """The interval of ``share``, Wilson's of 95 %."""
        return wilson_interval(self.right, self.right + self.wrong)

    @property
    def paper(self) -> float | None:
        """The paper's accuracy; None where it states none."""
        return PAPER_ACCURACY.get(self.dimension)


@dataclass(frozen=True)
class Speed:
    """An annotator's progress: reviews that stand, twins left in the queue, reviews taken back, and the median time of one."""

    annotator: str
    reviews: int
    left: int
    undone: int
    median_s: float | None

    @property
    def left_s(self) -> float | None:
        """About how long the rest takes; None where no time was measured."""
        return None if self.median_s is None else self.left * self.median_s


@dataclass(frozen=True)
class PromptVersion:
    """How many answers on what one version of a prompt gave are yes, no and unsure, and the ids of the twins with a no."""

    dimension: Dimension
    prompt: str
    yes: int
    no: int
    unsure: int
    disagreeing: tuple[str, ...]

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the share of yes among yes and no; of answers, of which a twin may have several."""
        return wilson_interval(self.yes, self.yes + self.no)


def accuracies(reviews: Iterable[Stored]) -> list[Accuracy]:
    """Return the accuracy of every dimension; ``reviews`` has at most one of an annotator on a twin."""
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
    """Return what more said of 'yes' and 'no'; 'unsure' where that is neither."""
    counts = Counter(answers)
    if counts["yes"] == counts["no"]:
        return "unsure"
    return "yes" if counts["yes"] > counts["no"] else "no"


def speeds(reviews: Iterable[Stored], queues: Mapping[str, Collection[str]], undone: Mapping[str, int]) -> list[Speed]:
    """Return every annotator's progress, sorted by name: of those who have a queue, have reviewed, or took back."""
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
    """Return what was said of each prompt version, by dimension, the one with most disagreement first."""
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
