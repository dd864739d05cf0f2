"""Ctrl-C and SIGTERM: the first ends a command in order, the second at once; neither shows a traceback.

This is imported before all else, and imports nothing that takes time.
"""

from __future__ import annotations

import atexit
import os
import signal
from contextlib import suppress
from functools import cache
from types import FrameType
from typing import NoReturn

RESUMABLE = frozenset({"build", "run", "layout", "trajectories", "render", "publish", "import"})
"""Commands that go on where they stopped."""
RESUMABLE_STATUS = 4
INTERRUPTED_STATUS = 130
"""128 and the number of SIGINT, as shells say it: nothing is there that the same command could go on with."""
SIGNALS = (signal.SIGINT, signal.SIGTERM)
TRACKER_WARNING = "ignore:resource_tracker"
"""What keeps multiprocessing's resource tracker from telling of semaphores that it removes (``PYTHONWARNINGS``)."""


@cache
def keep_exit_status() -> None:
    """Ignore signals once Python takes itself down, after all exit functions that are registered after this one.

    Until then it would give each signal back its default, and one that comes would end the process without its exit status.
    """

    def ignore() -> None:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)

    atexit.register(ignore)  # what is registered first is called last


def leave_when_interrupted() -> None:
    """End the process at a signal, while its imports are under way and there is nothing to end in order."""
    keep_exit_status()
    starting = Interrupts()

    def leave(number: int, frame: FrameType | None) -> NoReturn:
        starting.say()
        os._exit(starting.status)

    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as a shell's background jobs have it
            signal.signal(number, leave)


class Interrupts:
    """Handle interrupts of a command: ``command`` is its name, once it is known."""

    def __init__(self) -> None:
        self.command = ""
        self._seen = 0
        self._said = False

    @property
    def status(self) -> int:
        """The exit status of an interrupted command."""
        return RESUMABLE_STATUS if self.command in RESUMABLE else INTERRUPTED_STATUS

    @property
    def message(self) -> str:
        """The message of an interrupted command."""
        again = "; run the same command again to go on where it stopped" if self.command in RESUMABLE else ""
        return f"{f'manitwin {self.command}'.rstrip()}: interrupted{again}"

    def listen(self) -> None:
        """Raise KeyboardInterrupt at the first signal, and end the process at the second."""
        keep_exit_status()
        # a second signal leaves no time to remove semaphores: the tracker of this process does, and need not say so
        filters = os.environ.get("PYTHONWARNINGS", "")
        if TRACKER_WARNING not in filters.split(","):
            os.environ["PYTHONWARNINGS"] = ",".join(filter(None, (filters, TRACKER_WARNING)))
        for number in SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:  # as a shell's background jobs have it
                signal.signal(number, self._caught)

    def say(self) -> None:
        """Say once that the command was interrupted: straight to stderr, so that a second signal can do it anywhere."""
        if not self._said:
            self._said = True
            with suppress(OSError):
                os.write(2, f"{self.message}\n".encode())

    def ending(self, status: int) -> None:
        """From now on a signal ends the process with its status at once: what was to be done is done."""

        def leave(number: int, frame: FrameType | None) -> NoReturn:
            os._exit(status)

        for number in SIGNALS:
            signal.signal(number, leave)

    def _caught(self, number: int, frame: FrameType | None) -> None:
        self._seen += 1
        if self._seen == 1:
            raise KeyboardInterrupt
        self.say()
        import multiprocessing

        for child in multiprocessing.active_children():
            child.kill()
        os._exit(self.status)
