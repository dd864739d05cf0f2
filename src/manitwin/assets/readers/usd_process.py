"""Read USD in a process of its own: the USD library ends the whole process on some broken files."""

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
from pathlib import Path
from typing import IO, Any

from manitwin.assets.asset import Asset
from manitwin.errors import AssetError, ManiTwinError

_LENGTH = struct.Struct("<Q")
_MAX_MEMORY = 8 << 30  # of address space, of which libraries take 2
_processes: dict[int, _Reader] = {}
_lock = threading.Lock()


def read_apart(path: Path) -> Asset:
    """Read an asset with ``readers.usd.read_here`` in the reading process, started once and again after a crash.

    Raises AssetError as that does, and where the file ends the process.
    """
    with _lock:
        mine = os.getpid()  # a forked process must not share its parent's pipes
        if mine not in _processes:
            _processes[mine] = _Reader()
        answer = _processes[mine].ask(path)
        if answer is None:
            _processes.pop(mine).close()
            raise AssetError(f"{path}: its USD is so broken that the USD library crashes on it; export it again")
    if isinstance(answer, Exception):
        raise answer
    asset: Asset = answer
    return asset


class _Reader:
    """The reading process: a path goes in, an asset or an error comes out."""

    def __init__(self) -> None:
        self._process = subprocess.Popen(
            [sys.executable, "-P", "-m", "manitwin.assets.readers.usd_process"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,  # what the library complains of comes as an error too
        )
        assert self._process.stdin is not None and self._process.stdout is not None
        self._to: Any = self._process.stdin
        self._from: Any = self._process.stdout
        atexit.register(self.close)
        if _received(self._from) != "ready":
            raise RuntimeError(
                f"the process that reads USD does not start: {sys.executable} -m manitwin.assets.readers.usd_process"
            )

    def ask(self, path: Path) -> Any:
        """Return what comes back for a path, None where the process ended."""
        try:
            _send(self._to, path.absolute())
            answer = _received(self._from)
        except BrokenPipeError:
            return None
        return answer

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
    from manitwin.assets.readers.usd import read_here

    # a broken file of a kilobyte can ask for tens of gigabytes: let it be refused
    resource.setrlimit(resource.RLIMIT_AS, (_MAX_MEMORY, _MAX_MEMORY))
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # nothing that the library prints may come between
    _send(answers, "ready")
    while (path := _received(sys.stdin.buffer)) is not None:
        try:
            _send(answers, read_here(path))
        except ManiTwinError as error:
            _send(answers, error)
        except MemoryError:
            _send(answers, AssetError(f"{path}: it asks for more than {_MAX_MEMORY >> 30} GiB of memory; simplify it"))
        except Exception:
            _send(answers, RuntimeError(f"reading {path}:\n{traceback.format_exc()}"))  # a bug here, to be seen as one


if __name__ == "__main__":
    _serve()
