"""Usual size and density of an unnamed object: a mixture over its most probable names."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Interval
from manitwin.models.annotators.priors import unknown_prior
from manitwin.twin.record_values import Estimate

OF_LIKELY_NAMES = "prior:likeliest"
"""Source of estimates that are a mixture over an object's probable names and the unknown object."""
_STANDARD_NORMAL_95 = 1.645
_GRID = 2001


@dataclass(frozen=True)
class UsualValues:
    """Usual values of an object that has one of several names, or none of them."""

    longest_axis_m: Estimate
    bulk_density_kg_m3: Estimate


def usual_values(likely: Sequence[tuple[str, float]]) -> UsualValues:
    """Return the usual values of an object with one of the ``likely`` names (name, probability); the rest is an unknown object.

    An object that a classifier cannot name usually has the size of its guesses: pliers are taken for a can opener. The value
    is the mean of the logarithms, and the interval holds 90 % of the mixture. The source is ``prior:likeliest``, or that of
    the unknown object if no name is in the priors.
    """
    anything = unknown_prior()
    known = [(prior, share) for name, share in likely if (prior := find_prior(name)) is not None]
    priors = [*(prior for prior, _ in known), anything]
    weights = np.array([*(share for _, share in known), max(0.0, 1.0 - sum(share for _, share in known))])
    source = OF_LIKELY_NAMES if known else anything.source
    densities = [
        each for prior in priors if (each := prior.bulk_density_kg_m3 or anything.bulk_density_kg_m3) is not None
    ]
    return UsualValues(
        _mixture_interval([prior.longest_axis_m for prior in priors], weights).estimate(source),
        _mixture_interval(densities, weights).estimate(source),
    )


def _mixture_interval(intervals: list[Interval], weights: np.ndarray) -> Interval:
    """Return the mean and the 90 % interval of a mixture of two-sided log-normals; a single interval is returned unchanged."""
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
