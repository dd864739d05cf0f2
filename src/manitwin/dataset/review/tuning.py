"""Proposals for stricter acceptance thresholds that agree best with the verdicts on accepted twins.

Since only accepted twins are reviewed, the verdicts cannot show that a threshold rejects too much: thresholds are only tightened,
never loosened. A proposal must hold on twins that it was not chosen on (cross-validation).
"""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import comb
from typing import Any

import numpy as np

from manitwin.config import BuildConfig
from manitwin.dataset.index.query import Index
from manitwin.dataset.review.review_subjects import read_twin, revisions
from manitwin.dataset.review.store import ReviewStore, Stored, reviews_path
from manitwin.dataset.review.tally import majority
from manitwin.dataset.review.verdicts import Dimension
from manitwin.engine.ledger.location import CONFIG
from manitwin.errors import UsageError
from manitwin.formats.json_file import read_json_object
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Interval
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.twin.record import TwinRecord

FOLDS = 5
LEAST_OF_EACH = 10
"""Minimum number of twins judged right, and of twins judged wrong, to choose a threshold."""
SURE = 0.05
"""Significance level of all proposals together (Bonferroni correction)."""


@dataclass(frozen=True)
class Tunable:
    """A threshold of the configuration. ``value`` returns the compared quantity of a twin, None if the record lacks it.

    ``at_least``: smaller values are rejected, else larger ones.
    """

    section: str
    name: str
    dimension: Dimension
    at_least: bool
    value: Callable[[TwinRecord, float], float | None]

    @property
    def key(self) -> str:
        """Full name of the setting."""
        return f"{self.section}.{self.name}"

    def current(self, configuration: Mapping[str, Any]) -> float:
        """Return the threshold in a data set's configuration, else the default."""
        section = configuration.get(self.section)
        said = section.get(self.name) if isinstance(section, Mapping) else None
        if isinstance(said, (int, float)) and not isinstance(said, bool):
            return float(said)
        return float(getattr(getattr(BuildConfig(), self.section), self.name))


@dataclass(frozen=True)
class TuningResult:
    """Results for one threshold, as counts of twins.

    ``best`` agrees most with all verdicts. The held-out counts refer to thresholds chosen without the twins that they are applied
    to: ``mended`` twins are judged wrong and rejected, ``lost`` twins are judged right and rejected. ``chance`` is the p-value of
    the exact sign test on these counts. ``why_not`` says why the threshold is not proposed; None if it is.
    """

    key: str
    dimension: Dimension
    current: float
    right: int
    wrong: int
    best: float | None
    refused_right: int
    refused_wrong: int
    mended: int
    lost: int
    chance: float
    why_not: str | None

    @property
    def agreement_now(self) -> float:
        """Share of verdicts that agree with the current acceptance."""
        return self.right / max(self.right + self.wrong, 1)

    @property
    def agreement_held_out(self) -> float:
        """Cross-validated share of verdicts that agree with the chosen threshold."""
        return (self.right - self.lost + self.mended) / max(self.right + self.wrong, 1)

    def line(self) -> str:
        """Return the result as a line of text."""
        judged = self.right + self.wrong
        if self.best is None:
            return f"{self.key} = {self.current:g}: {self.why_not} ({self.right} right, {self.wrong} wrong in {self.dimension})"
        verb = "propose" if self.why_not is None else f"{self.why_not};"
        return (
            f"{self.key} = {self.current:g}: {verb} {self.best:.4g}: would refuse {self.refused_wrong} of {self.wrong} called"
            f" wrong in {self.dimension} and {self.refused_right} of {self.right} called right; agreement with {judged} verdicts"
            f" {self.agreement_now:.1%} now, {self.agreement_held_out:.1%} cross-validated (by luck {self.chance:.2g})"
        )


def tune_dataset(dataset: str) -> list[TuningResult]:
    """Return the result for each threshold from the verdicts on the current revisions of a data set's twins.

    Raises UsageError if there is no index or no current review.
    """
    root = DatasetRoot(dataset)
    with ReviewStore(reviews_path(root), make=False) as store:
        stored = store.standing()
    now = revisions(Index(root))
    reviews = [each for each in stored if now.get(each.review.twin_id) == each.review.revision]
    if not reviews:
        raise UsageError(
            f"{dataset}: no twin was reviewed in its current revision; start with `manitwin review {dataset}`"
        )
    records = {twin_id: read_twin(root, twin_id) for twin_id in sorted({each.review.twin_id for each in reviews})}
    configuration: dict[str, Any] = {}
    if root.local is not None and (root.local / CONFIG).is_file():
        configuration = read_json_object(root.local / CONFIG, UsageError, remedy="run `manitwin check` on the data set")
    return tune(reviews, records, configuration)


def tune(
    reviews: Iterable[Stored], records: Mapping[str, TwinRecord], configuration: Mapping[str, Any]
) -> list[TuningResult]:
    """Return the result for each threshold; ``records`` are the reviewed accepted twins by id."""
    answers: dict[tuple[str, Dimension], list[str]] = {}
    for review in (each.review for each in reviews):
        for dimension, answer in review.answers.items():
            answers.setdefault((review.twin_id, dimension), []).append(answer)
    decided = {place: majority(of) for place, of in answers.items()}
    return [_tune_threshold(each, decided, records, each.current(configuration)) for each in TUNABLES]


def proposals_toml(tuned: Sequence[TuningResult]) -> str:
    """Return the proposals as TOML configuration with their evidence as comments; empty if there are none."""
    sections: dict[str, list[str]] = {}
    for each in tuned:
        if each.why_not is None and each.best is not None:
            section, name = each.key.split(".")
            sections.setdefault(section, []).append(f"# {each.line()}\n{name} = {each.best:.6g}\n")
    return "\n".join(f"[{section}]\n{''.join(lines)}" for section, lines in sections.items())


def best_threshold(values: np.ndarray, right: np.ndarray, current: float, at_least: bool) -> float:
    """Return the threshold that agrees with most verdicts, midway between two values; ties go to the one nearest to ``current``.

    ``values (N,)`` and ``right (N,) bool``. Only thresholds at least as strict as ``current`` are considered.
    """
    distinct = np.unique(values)
    between = (distinct[1:] + distinct[:-1]) / 2
    stricter = between[between > current] if at_least else between[between < current]
    candidates = np.concatenate([[current], stricter])
    kept = values[None] >= candidates[:, None] if at_least else values[None] <= candidates[:, None]
    agreeing = (kept == right[None]).sum(1)
    best = np.flatnonzero(agreeing == agreeing.max())
    return float(candidates[best[np.abs(candidates[best] - current).argmin()]])


def sign_test(better: int, worse: int) -> float:
    """Return the probability of at least ``better`` improvements among all changes if improvement and deterioration are equally
    likely (one-sided exact sign test).
    """
    changed = better + worse
    return sum(comb(changed, count) for count in range(better, changed + 1)) / 2**changed


def _tune_threshold(
    tunable: Tunable, decided: Mapping[tuple[str, Dimension], str], records: Mapping[str, TwinRecord], current: float
) -> TuningResult:
    judged = []
    for (twin_id, dimension), answer in decided.items():
        if dimension == tunable.dimension and answer != "unsure" and twin_id in records:
            value = tunable.value(records[twin_id], current)
            if value is not None:
                judged.append((hashlib.sha256(twin_id.encode()).digest(), value, answer == "yes"))
    judged.sort()
    values = np.array([value for _, value, _ in judged], float)
    right = np.array([answer for _, _, answer in judged], bool)
    counts = int(right.sum()), int((~right).sum())
    nothing = (tunable.key, tunable.dimension, current, *counts)
    if min(counts) < LEAST_OF_EACH:
        return TuningResult(*nothing, None, 0, 0, 0, 0, 1.0, f"too few verdicts, {LEAST_OF_EACH} of each are needed")
    best = best_threshold(values, right, current, tunable.at_least)
    refused = _refused(values, best, tunable.at_least)
    held_out = np.zeros(len(values), bool)
    fold = np.empty(len(values), int)
    for said in (True, False):  # stratified folds: equally many of each answer
        fold[right == said] = np.arange((right == said).sum()) % FOLDS
    for number in range(FOLDS):
        others = fold != number
        chosen = best_threshold(values[others], right[others], current, tunable.at_least)
        held_out[~others] = _refused(values[~others], chosen, tunable.at_least)
    mended, lost = int((held_out & ~right).sum()), int((held_out & right).sum())
    chance = sign_test(mended, lost)
    why_not = None
    if best == current:
        why_not = "nothing stricter agrees better"
    elif chance > SURE / len(TUNABLES):
        why_not = "not proposed, may be luck"
    return TuningResult(
        *nothing, best, int((refused & right).sum()), int((refused & ~right).sum()), mended, lost, chance, why_not
    )


def _refused(values: np.ndarray, threshold: float, at_least: bool) -> np.ndarray:
    return values < threshold if at_least else values > threshold


def _check_value(record: TwinRecord, name: str) -> tuple[float | None, float | None]:
    for check in record.quality.checks:
        if check.name == name and isinstance(check.value, float):
            return check.value, check.limit if isinstance(check.limit, float) else None
    return None, None


def _matte(record: TwinRecord, current: float) -> float | None:
    return _check_value(record, "matte")[0]


def _thickness_share(record: TwinRecord, current: float) -> float | None:
    value, limit = _check_value(record, "positive_volume")
    return current * value / limit if value is not None and limit else None


def _named_by_classifier(record: TwinRecord, current: float) -> float | None:
    return None if record.naming is None or record.naming.name is None else record.naming.probability.value


def _excess_factor(value: float, usual: Interval) -> float:
    """Return the factor by which a value lies outside its usual interval; 1 inside."""
    return max(usual.low / value, value / usual.high, 1.0)


def _size_excess(record: TwinRecord, current: float) -> float | None:
    prior = None if record.language is None else find_prior(record.language.category)
    if prior is None or record.physical is None:
        return None
    return _excess_factor(max(record.physical.extents_m), prior.longest_axis_m)


def _mass_excess(record: TwinRecord, current: float) -> float | None:
    prior = None if record.language is None else find_prior(record.language.category)
    if prior is None or record.physical is None:
        return None
    return _excess_factor(record.physical.mass_kg.value, prior.mass_kg)


def _radius(record: TwinRecord, current: float) -> float | None:
    return None if record.grasps is None else record.grasps.association_radius_m


TUNABLES = (
    Tunable("matting", "min_confidence", "mesh", True, _matte),
    Tunable("gate", "min_thickness_share", "mesh", True, _thickness_share),
    Tunable("naming", "min_probability", "category", True, _named_by_classifier),
    Tunable("physical", "size_margin", "physical", False, _size_excess),
    Tunable("physical", "mass_margin", "physical", False, _mass_excess),
    Tunable("grasps", "association_radius_m", "grasp", False, _radius),
)
"""Configuration thresholds that accept or reject a twin by a number stored in its record."""
