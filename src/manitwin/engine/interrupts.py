"""Put interrupts off while something is done that may not be left in the middle.

Python calls the handler of a signal in the main thread between any two steps of what runs there, so a KeyboardInterrupt may come
where a library has taken a lock and not yet entered the statement that gives it back: ``threading.Condition`` is written in
Python, and with it queues, events and futures. Whoever wants that lock next waits for ever. The same holds for a process that
is started and that nobody has noted yet.
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
"""How many signals wait for the end of a ``with`` statement, the only one that this module changes."""


def is_deferred() -> bool:
    """Tell whether a signal has come that waits for the end of ``deferred_interrupts``."""
    return _deferred[0] > 0


@contextmanager
def deferred_interrupts() -> Iterator[None]:
    """Call no handler of a signal in the ``with`` statement: the one of a signal that comes is called as the statement ends.

    A second signal is not put off: both handlers are called where it comes. Only handlers written in Python are put off, those of
    ``SIGNALS``; elsewhere than in the main thread, where none is called, nothing is done. May be nested.
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
        deferring = False  # one that comes from here on goes to the handler that it is meant for
        for each, handler in before.items():
            signal.signal(each, handler)
        call_first(sys._getframe())
