"""How many of the ways in which reality may differ a grasp survives, with a sequential test that stops when it is clear.

Wald 1945, "Sequential tests of statistical hypotheses": after each trial the log likelihood ratio of "holds in
``robust_share`` of the cases" against "holds in ``fragile_share``" is looked at; beyond ln((1 - error) / error) to either
side the question is settled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class SequentialTest:
    """The two shares that are told apart, the chance of confusing them, and the most trials."""

    robust_share: float
    fragile_share: float
    error: float
    max_trials: int


@dataclass(frozen=True)
class Robustness:
    """How many of how many trials held."""

    held: int
    trials: int

    @property
    def share(self) -> float:
        """The share of trials that held."""
        return self.held / self.trials

    @property
    def rank_value(self) -> float:
        """The mean of the share's posterior under a uniform prior (Laplace): one that held 8 of 8 is before 4 of 4."""
        return (self.held + 1) / (self.trials + 2)


def try_until_clear(holds: Callable[[int], bool], test: SequentialTest) -> Robustness:
    """Call ``holds(0)``, ``holds(1)``, ... until the test is settled or ``max_trials`` are done."""
    gain = math.log(test.robust_share / test.fragile_share)
    loss = math.log((1 - test.robust_share) / (1 - test.fragile_share))
    bound = math.log((1 - test.error) / test.error)
    ratio, held = 0.0, 0
    for number in range(test.max_trials):
        success = holds(number)
        held += success
        ratio += gain if success else loss
        if abs(ratio) >= bound:
            return Robustness(held, number + 1)
    return Robustness(held, test.max_trials)
