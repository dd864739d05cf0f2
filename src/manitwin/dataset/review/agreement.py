"""Agreement of several raters with missing ratings: raw agreement, Krippendorff's alpha, Gwet's AC1."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

Ratings = Mapping[str, Mapping[str, str]]
"""Labels by item, then by rater."""


@dataclass(frozen=True)
class Agreement:
    """Agreement on the ``items`` with two or more ratings; coefficients are None where undefined.

    ``raw`` is the mean over items of the share of agreeing rater pairs. ``alpha`` is undefined if all labels are equal, since
    agreement then cannot be told from chance. Use ``ac1`` if nearly all labels are equal (K. L. Gwet 2008: kappa's paradox).
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
    """Return the mean, over items with two or more raters, of the share of rater pairs that agree (Gwet 2014, eq. 2.7)."""
    shares = []
    for of in items:
        raters = len(of)
        if raters >= 2:
            shares.append(sum(n * (n - 1) for n in Counter(of.values()).values()) / (raters * (raters - 1)))
    return sum(shares) / len(shares)


def krippendorff_alpha(ratings: Ratings) -> float | None:
    """Return Krippendorff's alpha for nominal labels, computed by NLTK; None if all labels are equal."""
    if len({label for of in ratings.values() if len(of) >= 2 for label in of.values()}) < 2:
        return None
    from nltk.metrics.agreement import AnnotationTask  # the import takes 1.5 CPU-s

    rows = [(rater, item, label) for item, of in ratings.items() for rater, label in of.items()]
    return float(AnnotationTask(data=rows).alpha())


def gwet_ac1(items: Iterable[Mapping[str, str]], labels: Sequence[str]) -> float | None:
    """Return Gwet's AC1 for several raters with missing ratings; None if no item has two ratings.

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
