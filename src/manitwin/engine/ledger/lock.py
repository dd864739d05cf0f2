"""The lock file of a ledger, held by one writing run at a time and released when its process ends."""

from __future__ import annotations

import fcntl
import os
import stat
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from manitwin.errors import UsageError


def lock_file(ledger: Path) -> Path:
    """Return the path of a ledger's lock file."""
    return ledger.with_suffix(".lock")


def _open_lock_file(path: Path, flags: int) -> TextIO:
    """Open a lock file. Links, pipes and devices are refused, because opening them could write elsewhere or block."""
    try:
        descriptor = os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC, 0o666)
    except OSError as error:
        if isinstance(error, FileNotFoundError):
            raise
        raise UsageError(f"{path}: cannot be opened ({error.strerror}); if it is a link, remove it") from error
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise UsageError(f"{path}: the lock of a ledger must be a regular file; remove it")
    return os.fdopen(descriptor, "r" if flags == os.O_RDONLY else "r+")


def hold_lock(ledger: Path) -> TextIO:
    """Acquire the lock of a ledger and return the open file that holds it. Raises UsageError if another run holds it."""
    path = lock_file(ledger)
    while True:
        lock = _open_lock_file(path, os.O_RDWR | os.O_CREAT)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.close()
            raise UsageError(f"{ledger}: another run is writing to it; wait until that run ends, or stop it") from error
        with suppress(FileNotFoundError):
            if os.path.samestat(path.stat(), os.fstat(lock.fileno())):
                return lock
        lock.close()  # the previous holder deleted the file after it was opened here


def is_written(ledger: Path) -> bool:
    """Return whether a run is writing a ledger now."""
    try:
        lock = _open_lock_file(lock_file(ledger), os.O_RDONLY)
    except FileNotFoundError:
        return False
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
