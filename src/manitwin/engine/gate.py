"""Rate limiter and circuit breaker of a resource: limits the rate of jobs, and pauses after failures of a service."""

from __future__ import annotations

from collections.abc import Callable

FIRST_PAUSE_S, LONGEST_PAUSE_S = 1.0, 60.0


class Gate:
    """Decides when the next job of a resource may start.

    The rate (jobs per minute, None: unlimited) is limited by a token bucket that holds ten seconds' worth. After a failure the
    service is paused for a time that doubles with each further failure. It is given up ``patience_s`` after the first failure
    if no answer came in between.
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
        """Return the seconds until the next job may start; 0: now."""
        now = self._clock()
        wait = max(0.0, self._paused_until - now)
        if self._per_second is not None:
            self._tokens = min(self._burst, self._tokens + (now - self._filled_at) * self._per_second)
            self._filled_at = now
            wait = max(wait, (1 - self._tokens) / self._per_second)
        return wait

    def begin(self) -> None:
        """Count a starting job against the rate limit."""
        if self._per_second is not None:
            self._tokens -= 1

    def record_answer(self) -> None:
        """Record an answer of the service: reset the failure state."""
        self._down_since, self._pause_s = None, FIRST_PAUSE_S

    def wait(self, seconds: float | None) -> None:
        """Pause the service for ``seconds``, as it asked, or for the current pause, which then doubles."""
        if seconds is None:
            seconds = self._pause_s
            self._pause_s = min(2 * self._pause_s, LONGEST_PAUSE_S)
        self._paused_until = max(self._paused_until, self._clock() + seconds)

    def record_outage(self) -> None:
        """Record that the service did not answer. Failures of jobs that started before the current pause are ignored."""
        now = self._clock()
        if now < self._paused_until:
            return
        self._down_since = now if self._down_since is None else self._down_since
        self.wait(None)

    @property
    def remaining_patience_s(self) -> float | None:
        """Seconds for which a service that is down is still retried; None if it is not down."""
        if self._down_since is None:
            return None
        return max(0.0, self._down_since + self._patience_s - self._clock())

    @property
    def is_patience_exhausted(self) -> bool:
        """True if the service has been down for longer than ``patience_s``."""
        return self.remaining_patience_s == 0
