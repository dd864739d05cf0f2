"""Directions that are thinned out evenly."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.even_directions import evenly_spread


def _circle(turns_deg: np.ndarray) -> np.ndarray:
    turns = np.deg2rad(turns_deg)
    return np.column_stack([np.cos(turns), np.sin(turns), np.zeros(len(turns))])


@pytest.mark.parametrize("times", [2, 3, 5])
def test_of_equal_turns_every_second_third_or_fifth_is_kept_as_near_as_can_be(times: int) -> None:
    turns = np.arange(72 * times) * 360 / (72 * times)
    kept = evenly_spread(_circle(turns), 72)
    gaps = np.diff([*turns[kept], 360])
    assert len(kept) == 72 and kept[0] == 0 and (np.diff(kept) > 0).all()
    assert gaps.max() <= 2 * 5 and gaps.min() >= 5 / 2
    if times == 2:
        assert gaps == pytest.approx(np.full(72, 5))


def test_what_was_taken_often_from_one_side_is_thinned_there() -> None:
    turns = np.concatenate([np.arange(0, 360, 6), np.linspace(40, 50, 300)])
    kept = turns[evenly_spread(_circle(turns), 60)]
    assert ((kept >= 40) & (kept <= 50)).sum() <= 4
    assert np.diff(np.sort([*kept, 360])).max() <= 12


def test_the_first_is_kept_and_copies_go_first() -> None:
    directions = _circle(np.array([0, 0, 0, 90, 180, 270.0]))
    assert evenly_spread(directions, 4).tolist() == [0, 3, 4, 5]
    assert evenly_spread(directions, 6).tolist() == list(range(6))
    assert evenly_spread(directions, 1).tolist() == [0]
