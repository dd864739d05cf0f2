"""The noise of a depth camera is what it says, and is measured of a picture."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.errors import UsageError
from manitwin.scenes.locate.depth_noise import DepthNoise
from manitwin.scenes.locate.depth_view import MOST_ROUNDING_M, DepthView, measured_noise_m

K = np.array([[300.0, 0, 100], [0, 300, 100], [0, 0, 1]])


@pytest.mark.parametrize("depth_m", [0.6, 1.2, 2.0])
def test_the_spread_on_a_wall_is_that_of_the_model_and_is_measured_without_the_truth(depth_m: float) -> None:
    noise = DepthNoise()
    told = noise.simulate_depth(np.full((200, 200), depth_m), np.random.default_rng(0))
    known = told[told > 0]
    wanted = float(noise.sigma_m(np.array([depth_m]))[0])
    assert known.std() == pytest.approx(wanted, rel=0.06)
    assert (told == 0).mean() == pytest.approx(noise.lost_anywhere, abs=0.003)
    assert np.abs(known / noise.step_m - np.rint(known / noise.step_m)).max() < 1e-6
    measured = measured_noise_m(DepthView(told, K), np.ones_like(told, bool))
    assert measured == pytest.approx(wanted, rel=0.2)


def test_depths_beside_a_jump_are_lost_and_none_is_invented() -> None:
    true = np.where(np.arange(200)[None] < 100, 0.7, 1.4) * np.ones((200, 1))
    told = DepthNoise().simulate_depth(true, np.random.default_rng(0))
    assert (told[:, 98:102] == 0).mean() > 0.2 > (told[:, :80] == 0).mean()
    known = told[told > 0]
    assert np.minimum(np.abs(known - 0.7), np.abs(known - 1.4)).max() < 0.03


def test_a_mask_of_lone_pixels_has_no_noise_to_measure() -> None:
    with pytest.raises(UsageError, match="too few adjacent ones"):
        measured_noise_m(DepthView(np.ones((40, 40)), K), np.indices((40, 40)).sum(0) % 3 == 0)


def test_coarse_steps_are_noise_though_most_neighbours_are_the_same() -> None:
    slope = np.round((0.8 + 0.0005 * np.arange(200)[None] * np.ones((200, 1))) / 0.01) * 0.01
    everywhere = np.ones_like(slope, bool)
    assert measured_noise_m(DepthView(slope, K), everywhere) < 1e-6
    assert measured_noise_m(DepthView(slope, K, step_m=0.01), everywhere) == pytest.approx(0.01 / np.sqrt(12))
    assert measured_noise_m(DepthView(slope, K, step_m=0.1), everywhere) == MOST_ROUNDING_M
