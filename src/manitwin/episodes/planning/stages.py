"""The order of the stages at which a grasp can fail."""

from __future__ import annotations

from typing import get_args

from manitwin.episodes.planning.problem import PlanFailure

STAGES: tuple[PlanFailure, ...] = get_args(PlanFailure)


def later(first: PlanFailure, second: PlanFailure) -> PlanFailure:
    """Return the failure that came later on the way to a plan: the more telling one of two attempts."""
    return max(first, second, key=STAGES.index)
