"""How large and heavy a thing is that nobody has named, by what it may be: a mean over the likeliest names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from manitwin.models.annotators.prior_names import lookup
from manitwin.models.annotators.prior_records import Interval
from manitwin.models.annotators.priors import unknown_prior
from manitwin.twin.record_values import Estimate

OF_LIKELY_NAMES = "prior:likeliest"
"""The source of Estimates that are a mean over the names that a thing may have, and over anything else."""
_STANDARD_NORMAL_95 = 1.645
_GRID = 2001


@dataclass(frozen=True)
class Usual:
    """What is usual of a thing that has one of several names, or none of them."""

    longest_axis_m: Estimate
    bulk_density_kg_m3: Estimate


def usual_of(likely: Sequence[tuple[str, float]]) -> Usual:
    """Return what is usual of a thing with one of the ``likely`` names, each with its probability, or of anything with the rest.

    A thing that a classifier cannot name is seldom far from its guesses in size: pliers are taken for a can opener. The value
    is the mean of logarithms, the interval holds 90 % of the mixture. Source ``prior:likeliest``, or that of anything where
    there is no name of the priors.
    """
    anything = unknown_prior()
    known = [(prior, share) for name, share in likely if (prior := lookup(name)) is not None]
    priors = [*(prior for prior, _ in known), anything]
    weights = np.array([*(share for _, share in known), max(0.0, 1.0 - sum(share for _, share in known))])
    source = OF_LIKELY_NAMES if known else anything.source
    densities = [
        each for prior in priors if (each := prior.bulk_density_kg_m3 or anything.bulk_density_kg_m3) is not None
    ]
    return Usual(
        _mixed([prior.longest_axis_m for prior in priors], weights).estimate(source),
        _mixed(densities, weights).estimate(source),
    )


def _mixed(intervals: list[Interval], weights: np.ndarray) -> Interval:
    """Return the mean and the 90 % interval of a mixture of log-normal halves, two for each interval; of one that one."""
    if len(intervals) == 1:
        return intervals[0]
    weights = weights / weights.sum()
    low, typical, high = (np.log([getattr(each, end) for each in intervals]) for end in ("low", "typical", "high"))
    at = np.linspace(low.min(), high.max(), _GRID)
    spread = np.where(at[:, None] < typical, typical - low, high - typical)
    from_typical = _STANDARD_NORMAL_95 * (at[:, None] - typical) / np.maximum(spread, 1e-9)
    below = ndtr(from_typical) @ weights
    mean = float(weights @ typical)
    ends = np.interp((0.05, 0.95), below, at)
    return Interval(
        low=float(np.exp(min(ends[0], mean))), typical=float(np.exp(mean)), high=float(np.exp(max(ends[1], mean)))
    )
