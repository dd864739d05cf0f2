"""Likelihood of a known object size for each class: a mug is not as long as a bucket."""

from __future__ import annotations

import math
from functools import cache

import numpy as np

from manitwin.models.annotators.prior_names import named
from manitwin.models.annotators.prior_records import Interval
from manitwin.models.annotators.priors import unknown_prior
from manitwin.models.classifiers.imagenet import load_names

OTHER_SIZE_SHARE = 0.1
"""Share of objects with an unusual size: a toy, a sample, or a file in another unit."""
ANY_SIZE_LOG_M = math.log(200)
"""Width of the uniform distribution of the logarithm of an unusual size: 5 mm to 1 m."""
_STANDARD_NORMAL_95 = 1.645
_LEAST_LOG_SPREAD = 0.05


def size_likelihoods(longest_m: float) -> np.ndarray:
    """Return the likelihood ``(1000,)`` of the longest side ``longest_m`` for each ImageNet class.

    It is the density of the logarithm of the length, from the usual interval of the class's name, or that of unknown objects
    if it has no name.
    """
    table = load_names()
    likelihoods = np.full(table.members.shape[1], _density(unknown_prior().longest_axis_m, longest_m))
    for usual, members in zip(_usual_lengths_m(), table.members, strict=True):
        likelihoods[members] = _density(usual, longest_m)
    return likelihoods


@cache
def _usual_lengths_m() -> tuple[Interval, ...]:
    priors = [named(name) for name in load_names().names]
    return tuple((unknown_prior() if prior is None else prior).longest_axis_m for prior in priors)


def _density(usual: Interval, longest_m: float) -> float:
    """Return the density of a two-sided log-normal with 90 % in the usual interval, mixed with a uniform one.

    The uniform part covers unusual sizes.
    """
    below, above = (
        max(abs(math.log(end / usual.typical)) / _STANDARD_NORMAL_95, _LEAST_LOG_SPREAD)
        for end in (usual.low, usual.high)
    )
    off = math.log(longest_m / usual.typical)
    peak = 1 / (math.sqrt(math.pi / 2) * (below + above))
    own = peak * math.exp(-0.5 * (off / (below if off < 0 else above)) ** 2)
    return (1 - OTHER_SIZE_SHARE) * own + OTHER_SIZE_SHARE / ANY_SIZE_LOG_M
