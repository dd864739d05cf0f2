"""Agreement of several raters, not all of whom rated everything: raw, Krippendorff's alpha, Gwet's AC1."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

Ratings = Mapping[str, Mapping[str, str]]
"""Label by rater, by item."""


@dataclass(frozen=True)
class Agreement:
    """Agreement on the ``items`` that two or more rated; None where it is not defined.

    ``raw`` is the mean over items of the share of agreeing pairs. ``alpha`` is not defined where all labels are equal: nothing
    can be told from chance then. ``ac1`` is what to read where nearly all labels are (K. L. Gwet 2008: kappa's paradox).
    """

    items: int
    raw: float | None
    alpha: float | None
    ac1: float | None


def agreement_of(ratings: Ratings, labels: Sequence[str]) -> Agreement:
    """Return the agreement of raters who chose among ``labels``."""
    shared = {item: of for item, of in ratings.items() if len(of) >= 2}
    if not shared:
        return Agreement(0, None, None, None)
    raw = raw_agreement(shared.values())
    return Agreement(len(shared), raw, krippendorff_alpha(shared), gwet_ac1(ratings.values(), labels))


def raw_agreement(items: Iterable[Mapping[str, str]]) -> float:
    """Return the mean over items with two raters or more of the share of pairs that agree (Gwet 2014, eq. 2.7)."""
    shares = []
    for of in items:
        raters = len(of)
        if raters >= 2:
            shares.append(sum(n * (n - 1) for n in Counter(of.values()).values()) / (raters * (raters - 1)))
    return sum(shares) / len(shares)


def krippendorff_alpha(ratings: Ratings) -> float | None:
    """Return Krippendorff's alpha of nominal labels (NLTK's); None where all labels are equal."""
    if len({label for of in ratings.values() if len(of) >= 2 for label in of.values()}) < 2:
        return None
    from nltk.metrics.agreement import AnnotationTask  # takes 1.5 CPU-s

    rows = [(rater, item, label) for item, of in ratings.items() for rater, label in of.items()]
    return float(AnnotationTask(data=rows).alpha())


def gwet_ac1(items: Iterable[Mapping[str, str]], labels: Sequence[str]) -> float | None:
    """Return Gwet's AC1 of several raters with missing ratings; None where nothing was rated twice.

    K. L. Gwet, Computing inter-rater reliability and its variance in the presence of high agreement, 2008, eq. 13 to 15, with
    missing ratings as in his Handbook of Inter-Rater Reliability, 4th ed., 2014, section 2.5.
    """
    rated = [of for of in items if of]
    if not any(len(of) >= 2 for of in rated):
        return None
    observed = raw_agreement(rated)
    prevalence = [sum(Counter(of.values())[label] / len(of) for of in rated) / len(rated) for label in labels]
    chance = sum(share * (1 - share) for share in prevalence) / (len(labels) - 1)
    return (observed - chance) / (1 - chance)
