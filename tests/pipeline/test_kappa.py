"""Cohen's kappa against tables that were worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.pipeline.second_opinion import cohens_kappa


def verdicts(both: int, first_only: int, second_only: int, neither: int) -> tuple[np.ndarray, np.ndarray]:
    first = np.array([True] * (both + first_only) + [False] * (second_only + neither))
    second = np.array([True] * both + [False] * first_only + [True] * second_only + [False] * neither)
    return first, second


@pytest.mark.parametrize(
    ("table", "kappa"),
    [
        ((20, 5, 10, 15), 0.4),  # p_o = 0.7, p_e = 0.5 * 0.6 + 0.5 * 0.4 = 0.5
        ((45, 15, 25, 15), 0.06 / 0.46),  # p_o = 0.6, p_e = 0.6 * 0.7 + 0.4 * 0.3 = 0.54
        ((10, 0, 0, 10), 1.0),
        ((0, 10, 10, 0), -1.0),
        ((25, 25, 25, 25), 0.0),
        ((90, 5, 5, 0), -1 / 19),  # nearly all hold: 90 % agreement says nothing
        ((8, 2, 0, 0), 0.0),  # one engine holds all: no better than chance
    ],
)
def test_kappa_of_a_two_by_two_table(table: tuple[int, int, int, int], kappa: float) -> None:
    assert cohens_kappa(*verdicts(*table)) == pytest.approx(kappa, abs=1e-12)
    assert cohens_kappa(*reversed(verdicts(*table))) == pytest.approx(kappa, abs=1e-12)


@pytest.mark.parametrize("table", [(0, 0, 0, 0), (12, 0, 0, 0), (0, 0, 0, 12)])
def test_kappa_is_none_where_chance_alone_agrees(table: tuple[int, int, int, int]) -> None:
    assert cohens_kappa(*verdicts(*table)) is None
