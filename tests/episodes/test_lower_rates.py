"""Recordings at a lower rate."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import numpy as np
import pytest
from synthetic_episodes import recording

from manitwin.episodes.downsampling import RATES_HZ, downsample, rows_per_frame
from manitwin.episodes.recording import joint_delta
from manitwin.episodes.settings import PicturesConfig
from manitwin.errors import EpisodesError, UsageError


def test_states_of_a_lower_rate_are_those_recorded_and_actions_lead_from_one_to_the_next() -> None:
    whole = recording(3, 43)
    slow = downsample(whole, 5)
    assert slow.steps == 10 and len(slow.joint_positions_rad) == 11
    assert np.array_equal(slow.object_positions_m, whole.object_positions_m[:41:4])
    assert np.array_equal(slow.action_joint_positions_rad, whole.action_joint_positions_rad[3:40:4])
    assert np.allclose(slow.action_joint_positions_rad, slow.joint_positions_rad[1:], atol=1e-6)
    assert np.allclose(joint_delta(slow)[:, :7], np.diff(slow.joint_positions_rad, axis=0), atol=1e-6)
    assert np.array_equal(slow.phase, whole.phase[:40:4])
    assert slow.target == whole.target


def test_a_contact_between_two_states_of_a_lower_rate_is_told_by_the_second() -> None:
    touched = np.zeros(13, bool)
    touched[[0, 5, 12]] = True
    slow = downsample(replace(recording(0, 12), unplanned_contact=touched), 10)
    assert np.flatnonzero(slow.unplanned_contact).tolist() == [0, 3, 6]


def test_goals_of_several_literals_and_granules_are_thinned_too() -> None:
    literal = (np.arange(8) >= 5).astype(np.uint8)
    granules = np.arange(9 * 2 * 3, dtype=np.float32).reshape(9, 2, 3)
    slow = downsample(replace(recording(0, 8), active_literal=literal, granule_positions_m=granules), 10)
    assert slow.active_literal is not None and slow.active_literal.tolist() == [0, 0, 0, 1]
    assert np.array_equal(np.asarray(slow.granule_positions_m), granules[::2])


def test_the_recorded_rate_changes_nothing() -> None:
    whole = recording(1, 9)
    assert downsample(whole, 20) is whole


@pytest.mark.parametrize("rate_hz", [0, -10, 15, 40, True])
def test_other_rates_are_refused_with_those_that_are_valid(rate_hz: int) -> None:
    with pytest.raises(UsageError, match="5"):
        rows_per_frame(rate_hz)


def test_pictures_may_have_these_rates() -> None:
    assert get_args(PicturesConfig.model_fields["rate_hz"].annotation) == RATES_HZ


def test_what_is_shorter_than_a_frame_is_refused() -> None:
    with pytest.raises(EpisodesError, match="3 steps are less than one at 5 Hz"):
        downsample(recording(0, 3), 5)
