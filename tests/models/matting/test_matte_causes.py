"""Why a cut-out is not believed: the doubt that costs it the most, or what may be why opinions differ."""

from __future__ import annotations

from dataclasses import fields, replace

import numpy as np

from manitwin.models.matting.belief import BEST, FEATURES
from manitwin.models.matting.causes import CAUSES, cause_of
from manitwin.models.matting.confidence import MatteScores

PERFECT = MatteScores(**{field.name: 1.0 for field in fields(MatteScores)})


def _with(**values: float) -> np.ndarray:
    features = BEST.copy()
    for name, value in values.items():
        features[FEATURES.index(name)] = value
    return features


def test_the_score_that_costs_the_most_is_the_cause() -> None:
    assert cause_of(_with(uncut=-3.0, network_beyond=-0.1), PERFECT) == "uncut"


def test_opinions_that_differ_are_explained_by_the_lowest_score() -> None:
    differing = _with(network_beyond=-4.0)
    assert cause_of(differing, replace(PERFECT, sharply_bounded=0.1, crisp=0.3)) == "sharply_bounded"
    assert cause_of(differing, replace(PERFECT, solid=0.2, crisp=0.3)) == "solid"
    assert cause_of(differing, replace(PERFECT, crisp=0.9)) == "stable"


def test_equally_low_scores_are_told_in_the_order_of_the_causes() -> None:
    differing = _with(network_beyond=-4.0)
    assert list(CAUSES).index("sharply_bounded") < list(CAUSES).index("outermost")
    assert cause_of(differing, replace(PERFECT, outermost=0.0, sharply_bounded=0.0)) == "sharply_bounded"
