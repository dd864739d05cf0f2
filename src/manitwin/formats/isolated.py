"""Calls in an isolated process with limits of time and memory.

They are for untrusted data, and for libraries that crash the whole process on some broken files, such as USD's.
"""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import resource
import select
import signal
import struct
import subprocess
import sys
import threading
import time
import traceback
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from itertools import islice
from typing import IO, Any, TypeVar

from manitwin.errors import Unavailable

MAX_MEMORY_BYTES = 8 << 30
"""Address space of the process, of which libraries use 2 GiB: a broken file of a kilobyte can request tens of GiB."""
MAX_SECONDS = 1800.0
_START_SECONDS = 120.0
_GRACE_SECONDS = 5
"""Difference between the limit kept by this process and that of the kernel, which acts if this process is gone."""
_LENGTH = struct.Struct("<Q")
_READY = "ready"
_NOT_STARTED = "the process that reads untrusted files does not start"
_REMEDY = "check the limits of memory, files and processes (ulimit -a)"
_CHUNK = 256
_TELL_EVERY_SECONDS = 0.05
_READ_BYTES = 1 << 20
_workers: dict[int, _Worker] = {}
_lock = threading.Lock()

Argument = TypeVar("Argument")
Answer = tuple[bool, Any]
"""Whether a call returned, and the value that it returned or raised."""


class ProcessCrashed(Exception):
    """A call crashed its process."""


class ProcessTimeout(ProcessCrashed):
    """A call exceeded its time limit, and its process was killed."""


@dataclass(frozen=True)
class Limits:
    """Limits of a call in seconds, and of the address space of its process, part of which libraries use."""

    seconds: float = MAX_SECONDS
    memory_bytes: int = MAX_MEMORY_BYTES


DEFAULT_LIMITS = Limits()


def run_isolated(function: str, *arguments: Any, limits: Limits = DEFAULT_LIMITS) -> Any:
    """Return the result of ``package.module:function`` in a worker process, which is started once and again after a crash.

    Arguments and result are pickled. Raises what the function raises, MemoryError above the memory limit, TookTooLong, and
    ProcessCrashed if the process has ended.
    """
    with _lock:
        returned, value = next(
            _call_worker(function, [arguments], limits, one_by_one=True), (False, _crashed(function))
        )
    if not returned:
        raise value
    return value


def iterate_isolated(
    function: str, arguments: Iterable[Argument], limits: Limits = DEFAULT_LIMITS
) -> Iterator[tuple[Argument, Answer]]:
    """Yield each argument with the result or exception of ``package.module:function``, in order.

    ``limits`` apply to each call separately: one that crashes, hangs or uses too much memory does not affect the others. Calls
    are sent in chunks, so that 100,000 of them cost only a few CPU-seconds more than in this process.
    """
    waiting = iter(arguments)
    while chunk := list(islice(waiting, _CHUNK)):
        with _lock:
            answers = list(_call_worker(function, [(each,) for each in chunk], limits))
            # the call that caused a crash is unknown, so that unanswered ones are repeated one by one
            while len(answers) < len(chunk):
                answers += _call_worker(function, [(each,) for each in chunk[len(answers) :]], limits, one_by_one=True)
        yield from zip(chunk, answers, strict=True)


def _call_worker(
    function: str, calls: list[tuple[Any, ...]], limits: Limits, *, one_by_one: bool = False
) -> Iterator[Answer]:
    """Yield answers to calls until all are answered or the process ends; with ``one_by_one``, the last one is the cause."""
    mine = os.getpid()  # a forked process must not share its parent's pipes
    if mine in _workers and not _workers[mine].alive:  # killed from outside since the last call
        _workers.pop(mine).end()
    if mine not in _workers:
        _workers[mine] = _Worker()
    worker = _workers[mine]
    left = len(calls)
    error: Exception = _crashed(function)
    try:
        worker.send((function, calls, limits, one_by_one, _working_folder()))
        while left:
            answers = worker.receive(limits.seconds + (0.0 if one_by_one else _TELL_EVERY_SECONDS))
            if answers is None:
                break
            left -= len(answers)
            yield from answers
    except TimeoutError:
        error = ProcessTimeout(f"{function} took longer than {limits.seconds:g} s")
    except BrokenPipeError:
        pass  # it ended before it received the call
    finally:
        if left:  # also after an interruption of this process: later answers would be misattributed
            _workers.pop(mine).end()
    if left and one_by_one:
        yield False, error


def _working_folder() -> str | None:
    """Return the working folder of this process, None if it no longer exists."""
    try:
        return os.getcwd()
    except OSError:
        return None


def _crashed(function: str) -> ProcessCrashed:
    return ProcessCrashed(f"{function} has crashed its process")


class _Worker:
    """A process that answers calls."""

    def __init__(self) -> None:
        command = [sys.executable, "-P", "-m", "manitwin.formats.isolated"]
        try:
            self._process = subprocess.Popen(
                command,
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,  # errors of a library are also raised
                bufsize=0,
            )
        except OSError as error:
            raise Unavailable(f"{_NOT_STARTED} ({error.strerror or error}); {_REMEDY}") from error
        assert self._process.stdin is not None and self._process.stdout is not None
        self._to: Any = self._process.stdin
        self._from: Any = self._process.stdout
        self._unread = bytearray()
        atexit.register(self.end)
        try:
            ready = self.receive(_START_SECONDS)
        except TimeoutError:
            ready = None
        except BaseException:
            self.end()
            raise
        if ready != _READY:
            self.end()
            raise Unavailable(f"{_NOT_STARTED}; {_REMEDY}")

    @property
    def alive(self) -> bool:
        """Whether the process still runs."""
        return self._process.poll() is None

    def send(self, value: Any) -> None:
        """Send a value; raises BrokenPipeError if the process has ended."""
        data = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
        left = memoryview(_LENGTH.pack(len(data)) + data)
        while left:
            left = left[self._to.write(left) :]

    def receive(self, seconds: float) -> Any:
        """Return the next value, None if the process has ended; raises TimeoutError."""
        until = time.monotonic() + seconds
        head = self._read(_LENGTH.size, until)
        data = None if head is None else self._read(_LENGTH.unpack(head)[0], until)
        return None if data is None else pickle.loads(data)

    def _read(self, size: int, until: float) -> bytes | None:
        poll = select.poll()
        poll.register(self._from, select.POLLIN)
        while len(self._unread) < size:
            if not poll.poll(max(0.0, until - time.monotonic()) * 1000):
                raise TimeoutError
            read = os.read(self._from.fileno(), _READ_BYTES)
            if not read:
                return None
            self._unread += read
        data = bytes(self._unread[:size])
        del self._unread[:size]
        return data

    def end(self) -> None:
        """Kill the process."""
        atexit.unregister(self.end)
        self._process.kill()
        with contextlib.suppress(BrokenPipeError):  # a crashed process leaves unwritten data
            self._to.close()
        self._from.close()
        self._process.wait()


def _serve() -> None:
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # keeps output of libraries out of the answers
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    _send(answers, _READY)
    while (asked := _received(sys.stdin.buffer)) is not None:
        function, calls, limits, one_by_one, folder = asked
        if folder is not None:  # relative paths are those of the calling process
            os.chdir(folder)
        limit_address_space(limits.memory_bytes)
        done: list[Answer] = []
        told = time.monotonic()
        for arguments in calls:
            # a kernel timer also ends native code that never returns, in a process whose parent was killed
            signal.setitimer(signal.ITIMER_REAL, limits.seconds + _GRACE_SECONDS)
            done.append(_answer(function, arguments))
            if one_by_one or time.monotonic() - told > _TELL_EVERY_SECONDS:
                _send(answers, done)
                done, told = [], time.monotonic()
        signal.setitimer(signal.ITIMER_REAL, 0)
        if done:
            _send(answers, done)


def limit_address_space(memory_bytes: int) -> None:
    """Limit the address space of this process: beyond it, Python raises MemoryError, and native code may crash."""
    _, hard = resource.getrlimit(resource.RLIMIT_AS)
    allowed = memory_bytes if hard == resource.RLIM_INFINITY else min(memory_bytes, hard)
    resource.setrlimit(resource.RLIMIT_AS, (allowed, hard))


def call_function(function: str, arguments: tuple[Any, ...]) -> Any:
    """Return the result of ``package.module:function`` in this process."""
    module, _, name = function.partition(":")
    return getattr(import_module(module), name)(*arguments)


def _send(stream: IO[bytes], value: Any) -> None:
    data = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(_LENGTH.pack(len(data)) + data)
    stream.flush()


def _received(stream: IO[bytes]) -> Any:
    """Return the next value, None if the other side is gone."""
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = stream.read(length)
    return pickle.loads(data) if len(data) == length else None


def _answer(function: str, arguments: tuple[Any, ...]) -> Answer:
    try:
        return True, call_function(function, arguments)
    except Exception as error:
        error.add_note(traceback.format_exc())
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # an error that cannot be pickled
            return False, RuntimeError(f"{function}:\n{traceback.format_exc()}")
        return False, error


if __name__ == "__main__":
    _serve()
    os._exit(0)  # the calling process is gone, and tearing down the libraries would take another second
