"""Fork server for worker processes: workers start at once and share the memory of the imported modules.

The server is a fork of this program, which has imported the modules that its workers need. The fork server of multiprocessing
is a fresh process that would import them again. Forking is only safe if no unknown threads run, because a lock that another
thread holds at that moment stays locked in the fork for ever. In that case workers are spawned instead.
"""

from __future__ import annotations

import atexit
import gc
import logging
import os
import signal
import socket
import sys
import threading
import warnings
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from importlib import import_module
from multiprocessing import connection, forkserver, resource_tracker
from multiprocessing.context import ForkServerProcess
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any, NoReturn

from manitwin.engine.interrupts import SIGNALS, deferred_interrupts
from manitwin.engine.process_limits import limit_library_threads, set_parent_death_signal

RUN = logging.getLogger("manitwin.run")
LAST_PYTHON = (3, 13)
"""Later versions have a fork server that requires an authentication key."""
BREAK_IN_FORKS = ("sapien", "torch", "ray")
"""Libraries that keep drivers, devices or connections open once loaded."""
THREADS_THAT_MAY_RUN = frozenset({"jemalloc_bg_thd"})
"""Arrow's allocator acquires its own locks during a fork, and works without this thread afterwards (``jemalloc_prefork``)."""

_state: Any = forkserver._forkserver
_forked_by: int | None = None


def fork_obstacle(idle_threads: Collection[str] = ()) -> str | None:
    """Return why this process must not be forked; None if it may be.

    ``idle_threads`` are the names of Python threads that hold no lock.
    """
    if not sys.platform.startswith("linux") or sys.version_info[:2] > LAST_PYTHON:
        return f"this is {sys.platform} with Python {sys.version_info.major}.{sys.version_info.minor}"
    loaded = [name for name in BREAK_IN_FORKS if sys.modules.get(name) is not None]
    if loaded:
        return f"{', '.join(loaded)} is loaded"
    if threading.current_thread() is not threading.main_thread():
        return "this is not the main thread"
    others = {each.name for each in threading.enumerate()} - {threading.main_thread().name, *idle_threads}
    running = [name for name in _thread_names() if name not in THREADS_THAT_MAY_RUN]
    if others or len(running) > threading.active_count():
        return f"other threads run: {', '.join(sorted(others)) or f'{len(running)} of {running[0]}'}"
    return None


@contextmanager
def forked_workers(modules: Iterable[str], idle_threads: Collection[str] = ()) -> Iterator[None]:
    """Import modules, and fork the workers that are started within the ``with`` statement from this process as it is now.

    If forking is not safe, workers are spawned. ``idle_threads`` are the names of Python threads that hold no lock.
    """
    for name in modules:
        import_module(name)
    why_not = fork_obstacle(idle_threads)
    if why_not is not None:
        RUN.debug("each worker imports what it needs: %s", why_not)
        yield
        return
    _start()
    try:
        yield
    finally:
        _stop()


def start_forked(process: BaseProcess) -> Any:
    """Fork a process from the server and return its multiprocessing Popen object; None if no server runs."""
    if not _runs():
        return None
    try:
        return ForkServerProcess._Popen(process)
    except (EOFError, OSError):  # the server was killed just now
        _stop()
        return None


def parent_of_workers(driver: int) -> int:
    """Return the pid of this worker's parent: the fork server, or else the driver."""
    return driver if _forked_by is None else _forked_by


def _thread_names() -> list[str]:
    return [path.read_text().strip() for path in Path("/proc/self/task").glob("*/comm")]


def _start() -> None:
    """Fork the server and register it with multiprocessing; signals are deferred, as the server is a copy of the program."""
    with deferred_interrupts():
        _fork_server()


def _fork_server() -> None:
    resource_tracker.ensure_running()
    address = connection.arbitrary_address("AF_UNIX")  # type: ignore[attr-defined]
    driver = os.getpid()
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(address)
        if not address.startswith("\0"):
            os.chmod(address, 0o600)
        listener.listen()
        alive, kept = os.pipe()  # the server ends when all copies of the write end are closed
        gc.freeze()  # otherwise the first collection in each worker would write to all objects and so copy their pages
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # Python 3.12 and later warn of idle threads too
            before = signal.pthread_sigmask(signal.SIG_BLOCK, SIGNALS)
            server = os.fork()
        if server == 0:
            os.close(kept)
            _serve(driver, listener.detach(), alive)
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
        gc.unfreeze()
        os.close(alive)
    _state._forkserver_address, _state._forkserver_alive_fd, _state._forkserver_pid = address, kept, server


def _serve(driver: int, listener: int, alive: int) -> NoReturn:
    """Run the server process: fork workers until the driver ends."""
    global _forked_by
    try:
        set_parent_death_signal(driver)
        _reset_inherited_state()
        limit_library_threads()
        _forked_by = os.getpid()
        forkserver.main(listener, alive, [])
    finally:
        os._exit(1)


def _reset_inherited_state() -> None:
    """Reset state that a spawned process would not inherit: signal handlers, log handlers and exit handlers.

    SIGINT stays blocked, as in ``shield_from_interrupts``.
    """
    atexit._clear()
    sys.unraisablehook = sys.__unraisablehook__
    signal.set_wakeup_fd(-1)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)
    signal.pthread_sigmask(signal.SIG_SETMASK, {signal.SIGINT})
    for logger in (logging.getLogger(), *map(logging.getLogger, logging.Logger.manager.loggerDict)):
        logger.handlers = [each for each in logger.handlers if isinstance(each, logging.NullHandler)]


def _runs() -> bool:
    """Return whether the server is alive; clear its state if it has ended."""
    if _state._forkserver_pid is None:
        return False
    try:
        ended, _ = os.waitpid(_state._forkserver_pid, os.WNOHANG)
    except ChildProcessError:
        ended = _state._forkserver_pid
    if ended:
        _forget_server()
    return not ended


def _stop() -> None:
    """Kill the server, and with it all remaining workers."""
    with deferred_interrupts():
        if _runs():
            server = _state._forkserver_pid
            _forget_server()
            with suppress(ProcessLookupError, ChildProcessError):
                os.kill(server, signal.SIGKILL)
                os.waitpid(server, 0)


def _forget_server() -> None:
    os.close(_state._forkserver_alive_fd)
    address = _state._forkserver_address
    if not address.startswith("\0"):
        Path(address).unlink(missing_ok=True)
    _state._forkserver_address = _state._forkserver_alive_fd = _state._forkserver_pid = None
