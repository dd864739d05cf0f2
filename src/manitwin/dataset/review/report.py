"""``manitwin review report``: annotation accuracy of a data set from its verdicts, beside the figures of the paper."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

from manitwin.dataset.index.query import Index
from manitwin.dataset.review.queues import share_of
from manitwin.dataset.review.review_subjects import pictures_of, revisions
from manitwin.dataset.review.store import ReviewStore, Stored, reviews_path
from manitwin.dataset.review.tally import (
    Accuracy,
    PromptVersion,
    Speed,
    accuracies,
    majority,
    prompt_versions,
    speeds,
)
from manitwin.dataset.review.verdict_table import table_of, write_verdicts
from manitwin.dataset.review.verdicts import DIMENSIONS, Dimension
from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line
from manitwin.twin.dataset_root import DatasetRoot

SHOWN = 20


def correction_text(value: object) -> str:
    """Return a corrected value as text; a quantity with the annotator's interval."""
    if isinstance(value, dict):
        return f"{value['value']:g} ({value['low']:g} to {value['high']:g})"
    return str(value)


@dataclass(frozen=True)
class Disagreement:
    """A twin with an annotation judged wrong, with the prompt that produced the annotation and the twin's pictures."""

    twin_id: str
    dimension: Dimension
    annotators: tuple[str, ...]
    prompt: str
    corrections: dict[str, object]
    notes: tuple[str, ...]
    pictures: tuple[str, ...]


@dataclass(frozen=True)
class ReviewReport:
    """Results of the verdicts on the current revisions of twins.

    ``sample`` is the size of the sample, of which ``reviewed`` twins have a verdict; None if no sample was drawn and all verdicts
    count. ``outside`` counts reviews of twins outside the sample, ``outdated`` those of earlier revisions. ``disputed`` lists,
    per dimension, the twins on which annotators contradict each other.
    """

    dataset: str
    sample: int | None
    reviewed: int
    reviews: int
    outside: int
    outdated: int
    accuracies: list[Accuracy]
    speeds: list[Speed]
    prompts: list[PromptVersion]
    disputed: dict[Dimension, list[str]]
    disagreements: list[Disagreement]

    def lines(self) -> list[str]:
        """Return the report as lines of text."""
        of_sample = f" of a sample of {self.sample}" if self.sample is not None else ""
        lines = [f"{self.reviewed} twins{of_sample} reviewed, in {self.reviews} reviews"]
        if self.outside:
            lines.append(f"{self.outside} reviews are of twins outside the sample, and do not count")
        if self.outdated:
            lines.append(f"{self.outdated} reviews are of twins that were built anew since, which are asked for again")
        lines.append(f"{'dimension':<11} {'right':>11}  {'accuracy [95 %]':<22} {'paper':>7}  {'unsure':>6}  agreement")
        lines += [_accuracy_line(each) for each in self.accuracies]
        lines += [_speed_line(each) for each in self.speeds]
        for dimension, twin_ids in self.disputed.items():
            lines.append(f"disputed {dimension}: {_abbreviated_list(twin_ids)}")
        for version in self.prompts:
            if version.no:
                lines.append(
                    f"{version.dimension} by {version.prompt}: {version.no} no, {version.yes} yes, {version.unsure} unsure"
                )
        for each in self.disagreements[:SHOWN]:
            said = "".join(f", {name} is {correction_text(value)}" for name, value in each.corrections.items())
            note = f" ({printable_line('; '.join(each.notes))})" if each.notes else ""
            picture = f" {each.pictures[-1]}" if each.pictures else ""
            lines.append(f"no: {each.twin_id} {each.dimension}{said}{note}{picture}")
        if len(self.disagreements) > SHOWN:
            lines.append(f"... and {len(self.disagreements) - SHOWN} more (--json lists all, with their pictures)")
        return lines

    def document(self) -> dict[str, Any]:
        """Return the report as JSON values."""
        return {
            "dataset": self.dataset,
            "sample": self.sample,
            "reviewed": self.reviewed,
            "reviews": self.reviews,
            "outside": self.outside,
            "outdated": self.outdated,
            "dimensions": [_accuracy_document(each) for each in self.accuracies],
            "annotators": [{**vars(each), "left_s": each.left_s} for each in self.speeds],
            "prompts": [{**vars(each), "disagreeing": list(each.disagreeing)} for each in self.prompts],
            "disputed": dict(self.disputed),
            "disagreements": [
                {name: list(value) if isinstance(value, tuple) else value for name, value in vars(each).items()}
                for each in self.disagreements
            ],
        }


def review_report(dataset: str) -> ReviewReport:
    """Return the report on a data set; raises UsageError if there is no index or no review."""
    root = DatasetRoot(dataset)
    with ReviewStore(reviews_path(root), make=False) as store:
        stored, plan, undone, annotators = store.standing(), store.plan(), store.undo_counts(), store.annotators()
    now = revisions(Index(root))
    current = [each for each in stored if now.get(each.review.twin_id) == each.review.revision]
    wanted = None if plan is None else set(plan.twins)
    counted = [each for each in current if wanted is None or each.review.twin_id in wanted]
    if not stored:
        raise UsageError(f"{dataset}: nothing was reviewed yet; start with `manitwin review {dataset}`")
    queues = {}
    if plan is not None:
        there = [twin_id for twin_id in plan.twins if twin_id in now]
        of_now = type(plan)(tuple(there), plan.seed, plan.overlap, plan.raters)
        done = annotators_by_twin(current)
        names = sorted({*annotators, *(each.review.annotator for each in stored)})
        queues = {name: share_of(name, of_now, names, done) for name in names}
    return ReviewReport(
        dataset=dataset,
        sample=None if wanted is None else len(wanted),
        reviewed=len({each.review.twin_id for each in counted}),
        reviews=len(counted),
        outside=len(current) - len(counted),
        outdated=len(stored) - len(current),
        accuracies=accuracies(counted),
        speeds=speeds(stored, queues, undone),
        prompts=prompt_versions(stored),
        disputed=_disputed(counted),
        disagreements=_disagreements(counted, root),
    )


def annotators_by_twin(reviews: list[Stored]) -> dict[str, set[str]]:
    """Return the annotators who reviewed each twin."""
    found: dict[str, set[str]] = {}
    for each in reviews:
        found.setdefault(each.review.twin_id, set()).add(each.review.annotator)
    return found


def _disputed(reviews: list[Stored]) -> dict[Dimension, list[str]]:
    found: dict[Dimension, list[str]] = {}
    for dimension in DIMENSIONS:
        answers: dict[str, set[str]] = {}
        for review in (each.review for each in reviews):
            if dimension in review.answers:
                answers.setdefault(review.twin_id, set()).add(review.answers[dimension])
        twins = sorted(twin_id for twin_id, said in answers.items() if {"yes", "no"} <= said)
        if twins:
            found[dimension] = twins
    return found


def _disagreements(reviews: list[Stored], root: DatasetRoot) -> list[Disagreement]:
    """Return the annotations that a majority judged wrong, sorted by prompt, to help improve the prompts."""
    by_place: dict[tuple[str, Dimension], list[Stored]] = {}
    for each in reviews:
        for dimension in each.review.answers:
            by_place.setdefault((each.review.twin_id, dimension), []).append(each)
    found, pictures = [], dict[str, tuple[str, ...]]()
    for (twin_id, dimension), of in by_place.items():
        if majority(each.review.answers[dimension] for each in of) != "no":
            continue
        against = [each.review for each in of if each.review.answers[dimension] == "no"]
        if twin_id not in pictures:
            pictures[twin_id] = tuple(pictures_of(root, twin_id))
        corrections = {name: value for review in against for name, value in review.corrections.of(dimension).items()}
        notes = tuple(dict.fromkeys(review.note for review in against if review.note))
        prompt = against[0].prompts.get(dimension, "not said")
        names = tuple(review.annotator for review in against)
        found.append(Disagreement(twin_id, dimension, names, prompt, corrections, notes, pictures[twin_id]))
    return sorted(found, key=lambda each: (DIMENSIONS.index(each.dimension), each.prompt, each.twin_id))


def _accuracy_line(each: Accuracy) -> str:
    judged = each.right + each.wrong
    low, high = each.interval
    share = "nothing judged" if each.share is None else f"{each.share:6.1%} [{low:.1%}, {high:.1%}]"
    paper = "" if each.paper is None else f"{each.paper:.1%}"
    between = each.agreement
    agreed = ""
    if between.raw is not None:
        alpha = "undefined" if between.alpha is None else f"{between.alpha:.2f}"
        agreed = f"{between.raw:.1%} of {between.items}, alpha {alpha}, AC1 {between.ac1:.2f}"
    return f"{each.dimension:<11} {each.right:>4} of {judged:<4}  {share:<22} {paper:>7}  {each.undecided:>6}  {agreed}"


def _accuracy_document(each: Accuracy) -> dict[str, Any]:
    between, (low, high) = each.agreement, each.interval
    return {
        "dimension": each.dimension, "right": each.right, "wrong": each.wrong, "undecided": each.undecided,
        "unsure_answers": each.unsure_answers, "accuracy": each.share, "low": low, "high": high, "paper": each.paper,
        "agreement": {"items": between.items, "raw": between.raw, "alpha": between.alpha, "gwet_ac": between.ac1},
    }  # fmt: skip


def _speed_line(each: Speed) -> str:
    pace = "" if each.median_s is None else f", {each.median_s:.0f} s each"
    rest = f", {each.left} left" if each.left else ""
    about = f" (about {each.left_s / 60:.0f} min)" if each.left and each.left_s is not None else ""
    undone = f", {each.undone} taken back" if each.undone else ""
    return f"{each.annotator}: {each.reviews} reviews{pace}{rest}{about}{undone}"


def _abbreviated_list(twin_ids: list[str]) -> str:
    return ", ".join(twin_ids[:SHOWN]) + (", ..." if len(twin_ids) > SHOWN else "")


def export_verdicts(dataset: str, path: Path) -> int:
    """Write all standing verdicts, including those on earlier revisions, in the format of the suffix; return the
    number of rows.
    """
    with ReviewStore(reviews_path(DatasetRoot(dataset)), make=False) as store:
        table = table_of(store.standing())
    write_verdicts(table, path)
    return len(table)
