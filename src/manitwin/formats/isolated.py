"""Calls in a process of their own: for libraries that end the whole process on some broken files, as USD's does."""

from __future__ import annotations

import atexit
import contextlib
import os
import pickle
import resource
import struct
import subprocess
import sys
import threading
import traceback
from importlib import import_module
from typing import IO, Any

MAX_MEMORY_BYTES = 8 << 30
"""Address space of the process, of which libraries take 2 GiB: a broken file of a kilobyte can ask for tens of them."""
_LENGTH = struct.Struct("<Q")
_READY = "ready"
_workers: dict[int, _Worker] = {}
_lock = threading.Lock()


class ProcessCrashed(Exception):
    """A call that has ended its process."""


def run_isolated(function: str, *arguments: Any) -> Any:
    """Return what ``package.module:function`` returns for arguments, in a worker process that is started once and again
    after a crash.

    Arguments and result are pickled. Raises what the function raises, MemoryError for more than ``MAX_MEMORY_BYTES``, and
    ProcessCrashed where the process has ended.
    """
    with _lock:
        mine = os.getpid()  # a forked process must not share its parent's pipes
        if mine not in _workers:
            _workers[mine] = _Worker()
        answer = _workers[mine].ask((function, arguments))
        if answer is None:
            _workers.pop(mine).close()
            raise ProcessCrashed(f"{function} has ended its process")
    returned, value = answer
    if not returned:
        raise value
    return value


class _Worker:
    """A process that answers calls."""

    def __init__(self) -> None:
        command = [sys.executable, "-P", "-m", "manitwin.formats.isolated"]
        self._process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # what a library complains of comes as an error too
        )
        assert self._process.stdin is not None and self._process.stdout is not None
        self._to: Any = self._process.stdin
        self._from: Any = self._process.stdout
        atexit.register(self.close)
        if _received(self._from) != _READY:
            raise RuntimeError(f"the worker process does not start: {' '.join(command)}")

    def ask(self, call: tuple[str, tuple[Any, ...]]) -> Any:
        """Return the answer to a call, None where the process ended."""
        try:
            _send(self._to, call)
            return _received(self._from)
        except BrokenPipeError:
            return None

    def close(self) -> None:
        """End the process."""
        atexit.unregister(self.close)
        with contextlib.suppress(BrokenPipeError):  # what a crashed process has not taken is still to be written
            self._to.close()
        self._from.close()
        self._process.wait()


def _send(stream: IO[bytes], value: Any) -> None:
    data = pickle.dumps(value, protocol=pickle.HIGHEST_PROTOCOL)
    stream.write(_LENGTH.pack(len(data)) + data)
    stream.flush()


def _received(stream: IO[bytes]) -> Any:
    """Return the next value, None where the other side is gone."""
    head = stream.read(_LENGTH.size)
    if len(head) < _LENGTH.size:
        return None
    (length,) = _LENGTH.unpack(head)
    data = stream.read(length)
    return pickle.loads(data) if len(data) == length else None


def _serve() -> None:
    resource.setrlimit(resource.RLIMIT_AS, (MAX_MEMORY_BYTES, MAX_MEMORY_BYTES))
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing that a library prints may come between
    _send(answers, _READY)
    while (call := _received(sys.stdin.buffer)) is not None:
        _send(answers, _answer(*call))


def _answer(function: str, arguments: tuple[Any, ...]) -> tuple[bool, Any]:
    """Return whether a call returned, and what it returned or raised."""
    module, _, name = function.partition(":")
    try:
        return True, getattr(import_module(module), name)(*arguments)
    except Exception as error:
        error.add_note(traceback.format_exc())
        try:
            pickle.loads(pickle.dumps(error))
        except Exception:  # an error that cannot be sent
            return False, RuntimeError(f"{function}:\n{traceback.format_exc()}")
        return False, error


if __name__ == "__main__":
    _serve()
