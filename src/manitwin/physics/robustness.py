"""How many of the ways in which reality may differ a grasp survives, with a sequential test that stops when it is clear.

Wald 1945, "Sequential tests of statistical hypotheses": after each trial the log likelihood ratio of "holds in
``robust_share`` of the cases" against "holds in ``fragile_share``" is looked at; beyond ln((1 - error) / error) to either
side the question is settled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

ROUNDING = 1e-9  # of the sums of logarithms: a ratio that reaches the bound exactly is beyond it


@dataclass(frozen=True)
class SequentialTest:
    """The two shares that are told apart, the chance of confusing them, and the most trials."""

    robust_share: float
    fragile_share: float
    error: float
    max_trials: int

    def log_ratio(self, held: int, trials: int) -> float:
        """Return the logarithm of how much likelier ``held`` of ``trials`` is for a robust grasp than for a fragile one."""
        gain = math.log(self.robust_share / self.fragile_share)
        loss = math.log((1 - self.robust_share) / (1 - self.fragile_share))
        return held * gain + (trials - held) * loss

    def is_clear(self, held: int, trials: int) -> bool:
        """Tell whether no further trial is needed."""
        bound = math.log((1 - self.error) / self.error)
        return trials >= self.max_trials or abs(self.log_ratio(held, trials)) >= bound - ROUNDING

    def is_robust(self, held: int, trials: int) -> bool:
        """Tell whether what was seen is likelier for a robust grasp; also where ``max_trials`` ended it undecided."""
        return self.log_ratio(held, trials) > 0


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
    held = 0
    for number in range(test.max_trials):
        held += holds(number)
        if test.is_clear(held, number + 1):
            break
    return Robustness(held, number + 1)
