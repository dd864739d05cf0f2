"""Ctrl-C and SIGTERM: the first ends a command in order, the second at once; neither shows a traceback."""

from __future__ import annotations

import multiprocessing
import os
import signal
from contextlib import suppress
from types import FrameType
from typing import NoReturn

RESUMABLE = frozenset({"build", "run", "layout", "trajectories", "render", "publish", "import"})
"""Commands that go on where they stopped."""
RESUMABLE_STATUS = 4
INTERRUPTED_STATUS = 130
"""128 and the number of SIGINT, as shells say it: nothing is there that the same command could go on with."""
SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Interrupts:
    """What an interrupt does to a command: ``command`` is its name, once it is known."""

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
        """What is said of an interrupted command."""
        again = "; run the same command again to go on where it stopped" if self.command in RESUMABLE else ""
        return f"{f'manitwin {self.command}'.rstrip()}: interrupted{again}"

    def listen(self) -> None:
        """Raise KeyboardInterrupt at the first signal, and end the process at the second."""
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
        for child in multiprocessing.active_children():
            child.kill()
        os._exit(self.status)
