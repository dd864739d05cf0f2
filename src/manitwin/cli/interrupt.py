"""Ctrl-C, SIGTERM and SIGHUP: the first ends a command in order, the second at once; neither shows a traceback.

This is imported before all else, and imports nothing that takes time.
"""

from __future__ import annotations

import atexit
import os
import select
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import cache
from types import CodeType, FrameType
from typing import NoReturn

from manitwin.engine.interrupts import SIGNALS, is_deferred

RESUMABLE = frozenset(
    {"build", "run", "layout", "tasks", "trajectories", "render", "publish", "import", "collect add", "collect draw"}
)
"""Commands that go on where they stopped."""
RESUMABLE_STATUS = 4
INTERRUPTED_STATUS = 130
"""128 and the number of SIGINT, as shells say it: nothing is there that the same command could go on with."""
NATIVE_PATIENCE_S = 1.5
"""So long native code, in which Python answers no signal, may go on after one: DuckDB's or pyarrow's, say."""
AGAIN = 0
"""What is written to the thread that watches for signals where an interrupt is to come again: no signal has this number."""
LOOKS_EVERY_S = 0.02
"""Between two looks whether what lost an interrupt, or would lose one, has returned."""
IMPORT = "<frozen importlib._bootstrap>"
"""The file name of the functions that a module is imported by."""
WATCH = "interrupts"
"""The name of the thread that ends a command in native code; it waits for a signal, and holds no lock."""
TRACKER_WARNING = "ignore:resource_tracker"
"""What keeps multiprocessing's resource tracker from telling of semaphores that it removes (``PYTHONWARNINGS``)."""


_left_with: list[int] = []
"""The exit status with which an interrupted process leaves once its exit functions are done."""


@cache
def keep_exit_status() -> None:
    """Ignore signals once Python takes itself down, after all exit functions that are registered after this one.

    Until then it would give each signal back its default, and one that comes would end the process without its exit status.
    """

    def ignore() -> None:
        for number in SIGNALS:
            signal.signal(number, signal.SIG_IGN)
        if _left_with and _flushed():
            os._exit(_left_with[0])

    atexit.register(ignore)  # what is registered first is called last


def exit_before_teardown(status: int) -> None:
    """End the process after its exit functions: taking modules down costs 0.5 CPU-s, and who interrupts waits for it."""
    _left_with[:] = [status]


def _flushed() -> bool:
    """Write what was printed; False where that fails, which Python then tells as it does."""
    try:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
    except (OSError, ValueError, AttributeError):  # closed, or never there
        return False
    return True


def exit_on_interrupt() -> None:
    """End the process at a signal, while its imports are under way and there is nothing to end in order."""
    keep_exit_status()
    starting = Interrupts()

    def leave(number: int, frame: FrameType | None) -> NoReturn:
        starting.print_message()
        os._exit(starting.status)

    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as a shell's background jobs have it
            signal.signal(number, leave)


@contextmanager
def call_on_first_interrupt(stop: Callable[[], None], numbers: tuple[signal.Signals, ...]) -> Iterator[None]:
    """Have the first of these signals call ``stop``, which ends a server in order; a second one ends what does not stop.

    Nothing is raised where the signal comes. While the context lasts no thread waits for the command's own handler
    (``Interrupts``): a server that waits for its last answers is not one that hangs.
    """
    before = {number: signal.getsignal(number) for number in numbers}
    watched = signal.set_wakeup_fd(-1)

    def interrupted(number: int, frame: FrameType | None) -> None:
        signal.signal(number, before[signal.Signals(number)])
        stop()

    for number in numbers:
        signal.signal(number, interrupted)
    try:
        yield
    finally:
        signal.set_wakeup_fd(watched, warn_on_full_buffer=False)
        for number, handler in before.items():
            signal.signal(number, handler)


@contextmanager
def wait_for_interrupt(numbers: tuple[signal.Signals, ...]) -> Iterator[Callable[[], None]]:
    """Yield what waits for the first of these signals, also where that has come already; a second one ends what does not stop.

    It reads a pipe that Python's handler in C writes to. A lock may be waited for for ever: a signal that comes just before is
    only looked at after, and an Event that is set where it comes may wait for the lock that its own ``wait`` holds.
    """
    heard, tell = os.pipe()
    os.set_blocking(tell, False)

    def wait() -> None:
        while os.read(heard, 1)[0] not in numbers:  # others have handlers of their own
            pass

    try:
        with call_on_first_interrupt(lambda: None, numbers):
            signal.set_wakeup_fd(tell, warn_on_full_buffer=False)
            yield wait
    finally:
        os.close(heard)
        os.close(tell)


class Interrupts:
    """Handle interrupts of a command: ``command`` is its name, once it is known."""

    def __init__(self) -> None:
        self.command = ""
        self._seen = 0
        self._said = False
        self._over = False
        self._tell: int | None = None
        self._sent_again = False
        self._begun_in: CodeType | None = None

    @property
    def interrupted(self) -> bool:
        """Tell whether a signal came, or the command was said to be interrupted."""
        return self._seen > 0 or self._said

    @property
    def status(self) -> int:
        """The exit status of an interrupted command."""
        return RESUMABLE_STATUS if self.command in RESUMABLE else INTERRUPTED_STATUS

    @property
    def message(self) -> str:
        """The message of an interrupted command."""
        again = "; rerun the same command to resume" if self.command in RESUMABLE else ""
        return f"{f'manitwin {self.command}'.rstrip()}: interrupted{again}"

    def listen(self) -> None:
        """Raise KeyboardInterrupt at the first signal, and end the process at the second.

        None is raised while a module is imported: modules that can do without another one catch whatever its import raises
        (trimesh: ``except BaseException``), and the command would go on without it. It comes once that is done.
        """
        keep_exit_status()
        # a second signal leaves no time to remove semaphores: the tracker of this process does, and need not say so
        filters = os.environ.get("PYTHONWARNINGS", "")
        if TRACKER_WARNING not in filters.split(","):
            os.environ["PYTHONWARNINGS"] = ",".join(filter(None, (filters, TRACKER_WARNING)))
        self._begun_in = sys._getframe(1).f_code
        self._watch()
        for number in SIGNALS:
            if signal.getsignal(number) is not signal.SIG_IGN:  # as a shell's background jobs have it
                signal.signal(number, self._handle_signal)

    def _watch(self) -> None:
        """Have a thread end the process where the main thread does not answer a signal, or goes on after a second one.

        It may be in native code that does not return, or wait for a lock. An interrupt that came in a function whose exceptions
        Python only prints, as it collects garbage, is lost: it is sent again, as is one that came while a module was imported.
        """
        heard, self._tell = os.pipe()
        os.set_blocking(self._tell, False)
        # written by Python's handler in C, which runs at once
        signal.set_wakeup_fd(self._tell, warn_on_full_buffer=False)
        print_unraisable = sys.unraisablehook

        def unraisable(lost: sys.UnraisableHookArgs) -> None:
            if not isinstance(lost.exc_value, KeyboardInterrupt):
                print_unraisable(lost)
            elif not self._over:
                self._request_resend()

        sys.unraisablehook = unraisable
        threading.Thread(target=self._wait_for_signals, args=(heard,), daemon=True, name=WATCH).start()

    def _wait_for_signals(self, heard: int) -> None:
        came = own = 0
        asked_at: float | None = None
        ends_at: float | None = None
        while True:
            waits = [] if ends_at is None else [ends_at - time.monotonic()]
            waits += [] if asked_at is None else [LOOKS_EVERY_S]
            ready, _, _ = select.select([heard], [], [], max(0.0, min(waits)) if waits else None)
            numbers = os.read(heard, 64) if ready else b""
            now = time.monotonic()
            for number in numbers:
                if number == AGAIN:
                    asked_at = now
                elif number in SIGNALS and own:
                    own -= 1
                elif number in SIGNALS:
                    came, ends_at = came + 1, now + NATIVE_PATIENCE_S
            if ends_at is not None and now >= ends_at:
                ends_at = None
                if (self._seen == 0 and not is_deferred()) or came > 1:
                    self._exit_unless_finished()
            if asked_at is not None and not ready and not self._is_main_thread_importing():
                asked_at, own = None, own + 1
                self._resend_signal()
            elif asked_at is not None and now > asked_at + NATIVE_PATIENCE_S:
                self._exit_unless_finished()

    def _request_resend(self) -> None:
        if self._tell is not None:
            os.write(self._tell, bytes((AGAIN,)))

    def _resend_signal(self) -> None:
        main = threading.main_thread().ident
        if main is not None and not self._over:
            self._sent_again = True
            signal.pthread_kill(main, signal.SIGINT)

    def _exit_unless_finished(self) -> None:
        if not self._over:
            self._exit_immediately()

    def _is_main_thread_importing(self) -> bool:
        return self._is_importing(sys._current_frames().get(threading.main_thread().ident or 0))

    def _is_importing(self, frame: FrameType | None) -> bool:
        """Tell whether a module is imported in a frame, since the command began."""
        while frame is not None and frame.f_code is not self._begun_in:
            if frame.f_code.co_filename == IMPORT:
                return True
            frame = frame.f_back
        return False

    def print_message(self) -> None:
        """Say once that the command was interrupted: straight to stderr, so that a second signal can do it anywhere."""
        if not self._said:
            self._said = True
            with suppress(OSError):
                os.write(2, f"{self.message}\n".encode())

    def exit_on_next_signal(self, status: int) -> None:
        """From now on a signal ends the process with its status at once: what was to be done is done."""

        def leave(number: int, frame: FrameType | None) -> NoReturn:
            os._exit(status)

        self._over = True
        for number in SIGNALS:
            signal.signal(number, leave)

    def _handle_signal(self, number: int, frame: FrameType | None) -> None:
        if self._sent_again:
            self._sent_again = False
        else:
            self._seen += 1
        if self._seen > 1:
            self._exit_immediately()
        if self._is_importing(frame):
            self._request_resend()
        else:
            raise KeyboardInterrupt

    def _exit_immediately(self) -> NoReturn:
        self.print_message()
        try:
            processes = sys.modules.get("multiprocessing.process")  # imported elsewhere, or there are none
            for child in processes.active_children() if processes is not None else ():
                child.kill()
        finally:
            os._exit(self.status)
