"""When a service is asked again, by a clock of the test's own."""

from __future__ import annotations

import pytest

from manitwin.engine.gate import Gate


class Clock:
    now = 100.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


def test_rate_is_kept_over_any_minute_but_for_the_burst(clock: Clock) -> None:
    gate = Gate(per_minute=60, patience_s=0, clock=clock)
    begun = []
    for _ in range(600):
        while gate.opens_in_s() <= 0:
            gate.begin()
            begun.append(clock.now)
        clock.now += 0.1
    assert len([at for at in begun if at < 101]) == 10, "ten seconds' worth at once, then one a second"
    assert 68 <= len(begun) <= 71


def test_without_a_rate_it_is_open(clock: Clock) -> None:
    gate = Gate(None, 0, clock)
    for _ in range(1000):
        assert gate.opens_in_s() == 0
        gate.begin()


def test_pauses_double_to_a_minute_and_an_answer_ends_them(clock: Clock) -> None:
    gate = Gate(None, 10_000, clock)
    waits = []
    for _ in range(8):
        gate.record_outage()
        gate.record_outage()  # others that began before the pause
        waits.append(gate.opens_in_s())
        clock.now += waits[-1]
    assert waits == [1, 2, 4, 8, 16, 32, 60, 60]
    gate.record_answer()
    gate.record_outage()
    assert gate.opens_in_s() == 1


def test_what_the_service_asks_for_is_waited(clock: Clock) -> None:
    gate = Gate(None, 0, clock)
    gate.wait(7.5)
    gate.wait(2.0)
    assert gate.opens_in_s() == 7.5
    assert not gate.is_patience_exhausted, "who asks to wait is not down"


def test_given_up_after_the_patience_since_the_first_failure(clock: Clock) -> None:
    gate = Gate(None, 5, clock)
    assert gate.remaining_patience_s is None
    for seconds, left_s in ((0, 5), (1, 4), (2, 2)):
        clock.now += seconds
        gate.record_outage()
        assert not gate.is_patience_exhausted and gate.remaining_patience_s == left_s
    clock.now += 4
    gate.record_outage()
    assert gate.is_patience_exhausted and gate.remaining_patience_s == 0
    gate.record_answer()
    assert not gate.is_patience_exhausted and gate.remaining_patience_s is None
