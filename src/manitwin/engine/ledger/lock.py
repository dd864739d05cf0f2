"""The lock beside a ledger, which ends with the process that holds it: one run writes at a time."""

from __future__ import annotations

import fcntl
import os
from contextlib import suppress
from pathlib import Path
from typing import TextIO

from manitwin.errors import UsageError


def lock_file(ledger: Path) -> Path:
    """Return the path of a ledger's lock."""
    return ledger.with_suffix(".lock")


def hold_lock(ledger: Path) -> TextIO:
    """Return the lock of a ledger, held until it is closed; raises UsageError where another run holds it."""
    path = lock_file(ledger)
    while True:
        lock = path.open("w")
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError as error:
            lock.close()
            raise UsageError(f"{ledger}: another run is writing it now; wait for its end, or stop it") from error
        with suppress(FileNotFoundError):
            if os.path.samestat(path.stat(), os.fstat(lock.fileno())):
                return lock
        lock.close()  # the run that held it removed it after it was opened here


def is_written(ledger: Path) -> bool:
    """Tell whether a run is at work on a ledger now."""
    try:
        lock = lock_file(ledger).open()
    except FileNotFoundError:
        return False
    with lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except BlockingIOError:
            return True
    return False
