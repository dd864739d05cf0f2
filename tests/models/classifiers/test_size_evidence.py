"""How usual a size is speaks for and against names, and no size makes a thing certain that looks like nothing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

from manitwin.models.annotators.prior_records import Interval
from manitwin.models.classifiers.imagenet import load_names
from manitwin.models.classifiers.size_evidence import ANY_SIZE_LOG_M, OTHER_SIZE_SHARE, _density, size_likelihoods


def likelihood(name: str, longest_m: float) -> float:
    table = load_names()
    (value,) = set(size_likelihoods(longest_m)[table.members[table.names.index(name)]].tolist())
    return float(value)


def test_a_cups_length_speaks_for_a_mug_and_a_buckets_for_a_bucket() -> None:
    assert likelihood("mug", 0.11) > 5 * likelihood("bucket", 0.11)
    assert likelihood("bucket", 0.3) > 5 * likelihood("mug", 0.3)


def test_ninety_percent_of_a_name_is_in_its_usual_interval() -> None:
    usual = Interval(low=0.08, typical=0.11, high=0.2)
    any_size = OTHER_SIZE_SHARE / ANY_SIZE_LOG_M

    def own(log_m: float) -> float:
        return _density(usual, float(np.exp(log_m))) - any_size

    whole, _ = quad(own, np.log(0.001), np.log(10), points=np.log([0.08, 0.11, 0.2]).tolist())
    inside, _ = quad(own, np.log(0.08), np.log(0.2), points=[float(np.log(0.11))])
    assert whole == pytest.approx(1 - OTHER_SIZE_SHARE, rel=1e-3)
    assert inside == pytest.approx(0.9 * whole, rel=1e-3)


@pytest.mark.parametrize("longest_m", [1e-9, 1e-3, 3.0, 250.0])
def test_what_is_as_long_as_nothing_is_says_little(longest_m: float) -> None:
    likelihoods = size_likelihoods(longest_m)
    assert np.isfinite(likelihoods).all() and likelihoods.min() > 0
    assert likelihoods.max() < 60 * likelihoods.min(), "one in ten sizes is wrong"
