"""Rate limiter and circuit breaker of a service: its rate, and the pause after it failed."""

from __future__ import annotations

from collections.abc import Callable

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0


class Gate:
    """Open while jobs of a resource may begin.

    A rate (jobs a minute, None: any) is kept by a token bucket of ten seconds' worth. A service that is down is left alone
    for a time that doubles; ``patience_s`` after the first failure without an answer in between it is given up.
    """

    def __init__(self, per_minute: float | None, patience_s: float, clock: Callable[[], float]):
        self._clock, self._patience_s = clock, patience_s
        self._per_second = None if per_minute is None else per_minute / 60
        self._burst = 0.0 if self._per_second is None else max(1.0, 10 * self._per_second)
        self._tokens, self._filled_at = self._burst, clock()
        self._paused_until = 0.0
        self._pause_s = FIRST_PAUSE_S
        self._down_since: float | None = None

    def opens_in_s(self) -> float:
        """Return how long to wait until the next job may begin; 0: now."""
        now = self._clock()
        wait = max(0.0, self._paused_until - now)
        if self._per_second is not None:
            self._tokens = min(self._burst, self._tokens + (now - self._filled_at) * self._per_second)
            self._filled_at = now
            wait = max(wait, (1 - self._tokens) / self._per_second)
        return wait

    def begin(self) -> None:
        """Count a job that begins against the rate of the service."""
        if self._per_second is not None:
            self._tokens -= 1

    def answered(self) -> None:
        """Note that the service works."""
        self._down_since, self._pause_s = None, FIRST_PAUSE_S

    def wait(self, seconds: float | None) -> None:
        """Leave the service alone for as long as it asks, or as it was left alone last time and again as long."""
        if seconds is None:
            seconds = self._pause_s
            self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
        self._paused_until = max(self._paused_until, self._clock() + seconds)

    def down(self) -> None:
        """Note that the service did not answer. Jobs that began before its pause say nothing new."""
        now = self._clock()
        if now < self._paused_until:
            return
        self._down_since = now if self._down_since is None else self._down_since
        self.wait(None)

    @property
    def given_up_in_s(self) -> float | None:
        """For how many seconds a service that is down is still asked again; None where it is not down."""
        if self._down_since is None:
            return None
        return max(0.0, self._down_since + self._patience_s - self._clock())

    @property
    def given_up(self) -> bool:
        """True where the service has been down for longer than a run waits."""
        return self.given_up_in_s == 0
