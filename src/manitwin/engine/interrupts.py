"""Defer signal handlers during code that must not be interrupted.

Python calls signal handlers in the main thread between any two bytecodes, so a KeyboardInterrupt may be raised after a library
has acquired a lock and before it enters the ``with`` block that releases it. ``threading.Condition`` is written in Python, and
so are the queues, events and futures built on it: the next thread that wants such a lock waits for ever. Similarly, a process
that has just been started may not be registered yet.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)

_deferred = [0]
"""The number of deferred signals; the only state of this module."""


def is_deferred() -> bool:
    """Return whether a signal is waiting for the end of ``deferred_interrupts``."""
    return _deferred[0] > 0


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Defer Python signal handlers until the end of the ``with`` statement.

    A second signal is not deferred: both handlers are then called immediately. Only handlers written in Python and only the
    signals in ``SIGNALS`` are deferred. Outside the main thread, where handlers are never called, this does nothing. It may be
    nested.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before: dict[signal.Signals, Callable[[int, FrameType | None], Any]] = {}
    came: list[signal.Signals] = []
    deferring = False

    def noted(number: int, frame: FrameType | None) -> None:
        if deferring and not came:
            came.append(signal.Signals(number))
            _deferred[0] += 1
            return
        with suppress(KeyboardInterrupt):
            call_first(frame)
        before[signal.Signals(number)](number, frame)

    def call_first(frame: FrameType | None) -> None:
        if came:
            _deferred[0] -= 1
            first = came.pop()
            before[first](first, frame)

    try:
        for each in SIGNALS:
            handler = signal.getsignal(each)
            if callable(handler):
                before[each] = handler
                signal.signal(each, noted)
        deferring = True
        yield
    finally:
        deferring = False  # later signals go to the original handlers
        for each, handler in before.items():
            signal.signal(each, handler)
        call_first(sys._getframe())
