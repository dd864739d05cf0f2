"""Scoring rules of annotations against labels; each question is answered right or wrong, or not asked."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial

from manitwin.dataset.evaluation.labels import Interval, Label
from manitwin.dataset.evaluation.part_names import is_on_any, matches_any, words_of
from manitwin.models.annotators.prior_names import normalise_name
from manitwin.twin.record import TwinRecord
from manitwin.twin.record_values import Estimate

DIMENSIONS = ("category", "language", "functional", "physical", "grasp")
"""The paper's dimensions of annotation quality."""
MASS_FACTOR = 1.6


@dataclass(frozen=True)
class Score:
    """One question about one twin: dimension, question, verdict, the annotation and the label."""

    twin_id: str
    dimension: str
    question: str
    right: bool
    said: str
    truth: str


def score_annotations(record: TwinRecord, label: Label) -> Iterator[Score]:
    """Yield a score for every question that the label can answer; dimensions without a label have none."""
    language, physical, points = record.language, record.physical, record.points
    if language is None or physical is None or points is None:
        return

    score = partial(_score, record.twin_id)
    if label.categories:
        names = {normalise_name(name) for name in label.categories}
        yield score(
            "category", "category", normalise_name(language.category) in names, language.category, label.categories
        )
    for question, said, truth in (
        ("color", language.color, label.colors),
        ("material", language.material, label.materials),
    ):
        if truth:
            yield score("language", question, _contains_any(said, truth), said, truth)
    for point in points.functional if label.parts else ():
        yield score("functional", point.id, is_on_any(point.label, label.named_parts), point.label, label.named_parts)
    if label.mass_kg is not None:
        yield from _mass_scores(record.twin_id, physical.mass_kg, label.mass_kg)
    if label.longest_side_m is not None:
        longest, side = max(physical.extents_m), label.longest_side_m
        yield score("physical", "longest side", side.low <= longest <= side.high, f"{longest:.3f} m", side)
    for grasp in points.grasp:
        if label.grasp_types:
            yield score("grasp", f"{grasp.id} type", grasp.type in label.grasp_types, grasp.type, label.grasp_types)
        region = grasp.label or ""
        if region and (label.good_regions or label.bad_regions):
            bad = matches_any(region, label.bad_regions) and not matches_any(region, label.good_regions)
            yield score("grasp", f"{grasp.id} region", not bad, region, label.good_regions)


def _mass_scores(twin_id: str, said: Estimate, true: Interval) -> Iterator[Score]:
    """Yield the scores of a mass. An exact mass (given, or derived from parts) must lie in the labelled interval."""
    text = f"{said.value:.3g} kg ({said.low:.3g} to {said.high:.3g})"
    factor = max(said.value / true.middle, true.middle / said.value)
    is_exact = said.low == said.high
    inside = true.low <= said.value <= true.high if is_exact else said.low <= true.middle <= said.high
    yield _score(twin_id, "physical", "mass interval", inside, text, true)
    yield _score(twin_id, "physical", f"mass within {MASS_FACTOR}", factor <= MASS_FACTOR, text, true)


def _score(
    twin_id: str, dimension: str, question: str, right: bool, said: str, truth: Interval | tuple[str, ...]
) -> Score:
    return Score(twin_id, dimension, question, right, said, _text(truth))


def _contains_any(said: str, truth: Iterable[str]) -> bool:
    """Return whether a text contains at least one of the labelled words; one dominant colour or one material suffices."""
    words = words_of(re.sub(r"\([^)]*\)", " ", said))
    return any(words_of(each) <= words for each in truth)


def _text(truth: Interval | tuple[str, ...]) -> str:
    return f"{truth.low:.3g} to {truth.high:.3g}" if isinstance(truth, Interval) else "; ".join(truth)
