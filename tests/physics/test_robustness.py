"""The sequential test against exact arithmetic and exact error rates, and robustness itself in the engine."""

from __future__ import annotations

from fractions import Fraction
from itertools import product

import numpy as np
import pytest

from manitwin.physics.robustness import (
    PerturbationRanges,
    Robustness,
    SequentialTest,
    draw_perturbations,
    run_sequential_test,
)
from manitwin.physics.sapien.trial import SapienTrial
from rigid_boxes import FROM_ABOVE, SETTINGS, above, box, try_one

DEFAULT = (Fraction(9, 10), Fraction(1, 2), Fraction(1, 10))


def wald(outcomes: tuple[bool, ...], robust: Fraction, fragile: Fraction, error: Fraction) -> tuple[int, int, Fraction]:
    """Return held, trials and likelihood ratio where Wald's test ends, in exact fractions."""
    ratio, bound, held = Fraction(1), (1 - error) / error, 0
    for number, success in enumerate(outcomes, start=1):
        ratio *= robust / fragile if success else (1 - robust) / (1 - fragile)
        held += success
        if ratio >= bound or ratio <= 1 / bound:
            return held, number, ratio
    return held, len(outcomes), ratio


@pytest.mark.parametrize(
    ("robust", "fragile", "error"),
    [
        DEFAULT,
        (Fraction(3, 4), Fraction(1, 4), Fraction(1, 10)),  # two successes reach the bound of 9 exactly
        (Fraction(4, 5), Fraction(1, 5), Fraction(1, 5)),  # one does
        (Fraction(19, 20), Fraction(7, 10), Fraction(1, 20)),
    ],
)
@pytest.mark.parametrize("max_trials", [1, 3, 10])
def test_every_sequence_ends_where_exact_arithmetic_ends_it(
    robust: Fraction, fragile: Fraction, error: Fraction, max_trials: int
) -> None:
    test = SequentialTest(float(robust), float(fragile), float(error), max_trials)
    for outcomes in product([True, False], repeat=max_trials):
        held, trials, ratio = wald(outcomes, robust, fragile, error)
        answer = run_sequential_test(lambda number, outcomes=outcomes: outcomes[number], test)
        assert (answer.held, answer.trials) == (held, trials), outcomes
        if ratio != 1:
            assert test.is_robust(held, trials) == (ratio > 1), outcomes


def test_default_settles_after_four_successes_or_two_failures() -> None:
    test = SequentialTest(0.9, 0.5, 0.1, 10)
    # (0.9 / 0.5)^4 = 10.5 > 9; (0.1 / 0.5)^2 = 1 / 25 < 1 / 9
    assert run_sequential_test(lambda number: True, test) == Robustness(4, 4)
    assert run_sequential_test(lambda number: False, test) == Robustness(0, 2)
    # a failure among them costs three more successes and a bit: 1.8^7 / 5 = 12.2
    assert run_sequential_test(lambda number: number != 2, test) == Robustness(7, 8)
    assert test.is_robust(7, 8)


def test_trials_are_asked_for_in_order_and_never_beyond_the_limit() -> None:
    asked: list[int] = []

    def holds(number: int) -> bool:
        asked.append(number)
        return number % 4 != 1

    run_sequential_test(holds, SequentialTest(0.9, 0.5, 0.001, 6))
    assert asked == [0, 1, 2, 3, 4, 5]


def rate_of_robust(share: float, test: SequentialTest) -> tuple[float, float]:
    """Return the probability that a grasp of this share is called robust, and the expected trials; exactly."""
    open_: dict[int, float] = {0: 1.0}
    robust = trials = 0.0
    for number in range(1, test.max_trials + 1):
        then: dict[int, float] = {}
        for held, chance in open_.items():
            for success, part in ((1, share), (0, 1 - share)):
                then[held + success] = then.get(held + success, 0.0) + chance * part
        trials += sum(open_.values())
        open_ = {}
        for held, chance in then.items():
            if not test.is_decided(held, number):
                open_[held] = chance
            elif test.is_robust(held, number):
                robust += chance
    return robust, trials


def test_error_rates_are_those_that_were_asked_for() -> None:
    test = SequentialTest(0.9, 0.5, 0.1, 10)
    assert rate_of_robust(0.5, test)[0] < 0.1
    assert rate_of_robust(0.9, test)[0] > 0.9
    assert rate_of_robust(0.95, test)[0] > 0.97
    assert rate_of_robust(0.2, test)[0] < 0.002
    assert max(rate_of_robust(share, test)[1] for share in np.linspace(0, 1, 51)) < 6.5, "of ten"


def test_exact_rates_are_those_of_many_simulated_grasps() -> None:
    test = SequentialTest(0.9, 0.5, 0.1, 10)
    rng = np.random.default_rng(0)
    for share in (0.5, 0.75, 0.95):
        answers = [run_sequential_test(lambda number, p=share: bool(rng.random() < p), test) for _ in range(4000)]
        robust = np.mean([test.is_robust(answer.held, answer.trials) for answer in answers])
        expected, trials = rate_of_robust(share, test)
        assert robust == pytest.approx(expected, abs=4 * 0.5 / np.sqrt(4000))
        assert np.mean([answer.trials for answer in answers]) == pytest.approx(trials, rel=0.05)


def test_rank_value_prefers_more_evidence_for_the_same_share() -> None:
    # Laplace: (8 + 1) / (8 + 2), (4 + 1) / (4 + 2)
    assert Robustness(8, 8).rank_value == pytest.approx(0.9)
    assert Robustness(4, 4).rank_value == pytest.approx(5 / 6)
    assert Robustness(0, 2).rank_value == pytest.approx(1 / 4)
    assert Robustness(7, 8).share == 0.875


def test_box_gripped_at_its_center_of_mass_is_more_robust_than_one_gripped_at_its_end() -> None:
    # both hold as they are; the grip at the end needs nearly all the torque that the pads' friction gives
    body = box([0.03, 0.2, 0.03], 0.6)
    middle, end = above([0, 0, 0], FROM_ABOVE), above([0, 0.08, 0], FROM_ABOVE)
    engine = SapienTrial()
    assert {try_one(engine, body, pose).outcome for pose in (middle, end)} == {"held"}
    spread = PerturbationRanges(0.005, 5.0, (0.6, 1.4), (0.5, 1.0), (0.4, 0.9), 0.005)
    variants = [(draw, draw.body(body), draw.settings(SETTINGS)) for draw in draw_perturbations(spread, 10, seed=0)]

    def survives(pose: np.ndarray, number: int) -> bool:
        draw, other, settings = variants[number]
        return try_one(engine, other, draw.grasp(pose, 0.1034), settings).outcome == "held"

    test = SequentialTest(0.9, 0.5, 0.1, 10)
    near, far = (run_sequential_test(lambda n, pose=pose: survives(pose, n), test) for pose in (middle, end))
    assert near.rank_value > far.rank_value + 0.2
    assert test.is_robust(near.held, near.trials) and not test.is_robust(far.held, far.trials)
