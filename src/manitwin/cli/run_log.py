"""The log of a run: a file that everything said of it is appended to, one line each with its time (UTC)."""

from __future__ import annotations

import errno
import logging
import os
import re
import time
from pathlib import Path

from manitwin.errors import UsageError
from manitwin.formats.printable import printable

PACKAGE = logging.getLogger("manitwin")
SECRET_NAMES = re.compile(r"KEY|TOKEN|SECRET|PASSWORD|CREDENTIAL", re.IGNORECASE)
SHORTEST_SECRET = 6
CREDENTIALS_IN_URL = re.compile(r"(?<=://)[^/@\s]+@")
HIDDEN = "***"


class RedactingFormatter(logging.Formatter):
    """Lines with their time in UTC, in which no key of the environment stands, nor a URL's user and password.

    Nothing in them is obeyed by a terminal that shows the file, and what follows in a record of several lines is indented: no
    name of a file begins a line that looks like one of the log.
    """

    converter = staticmethod(time.gmtime)
    default_msec_format = "%s.%03dZ"

    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)-7s %(message)s")

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as text; the lines of a traceback follow its own, indented."""
        text = CREDENTIALS_IN_URL.sub(f"{HIDDEN}@", super().format(record))
        for secret in secrets():
            text = text.replace(secret, HIDDEN)
        return printable(text).replace("\n", "\n    ")


def secrets() -> list[str]:
    """Return the values of environment variables that are named like keys, the longest first."""
    found = {value for name, value in os.environ.items() if SECRET_NAMES.search(name) and len(value) >= SHORTEST_SECRET}
    return sorted(found, key=len, reverse=True)


class RunLog(logging.Handler):
    """Keeps what the package logs until a file is named, then appends it there; without one it is forgotten.

    A command that is refused has begun nothing, and leaves no file behind.
    """

    def __init__(self) -> None:
        super().__init__(logging.DEBUG)
        self.setFormatter(RedactingFormatter())
        self._kept: list[logging.LogRecord] = []
        self._file: logging.FileHandler | None = None

    def emit(self, record: logging.LogRecord) -> None:
        """Write a record, or keep it."""
        if self._file is None:
            self._kept.append(record)
        else:
            self._file.emit(record)

    def open(self, path: Path) -> None:
        """Append to a file from now on, unless one is open; raises UsageError where it cannot be written."""
        if self._file is not None:
            return
        try:
            if os.path.exists(path) and not os.path.isfile(path):  # a pipe would be waited for
                raise OSError(errno.EINVAL, "no regular file")
            path.parent.mkdir(parents=True, exist_ok=True)
            self._file = logging.FileHandler(path, encoding="utf-8", errors="backslashreplace")
        except (OSError, ValueError) as error:
            cause = getattr(error, "strerror", None) or error
            raise UsageError(f"{path}: cannot be written ({cause}); give another file with --log") from error
        self._file.setFormatter(self.formatter)
        for record in self._kept:
            self._file.emit(record)
        self._kept.clear()

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()
            self._file = None
        self._kept.clear()
        super().close()


_log: RunLog | None = None


def begin_log(path: Path | None, place_follows: bool = False) -> None:
    """Keep a log from now on: at ``path``, or where ``open_run_log`` will say if that ``place_follows``, else none.

    Raises UsageError.
    """
    global _log
    end_log()
    if path is None and not place_follows:
        return
    _log = RunLog()
    PACKAGE.setLevel(logging.DEBUG)
    PACKAGE.addHandler(_log)
    if path is not None:
        _log.open(path)


def open_run_log(path: Path) -> None:
    """Append the log to a file, where a log is kept and ``--log`` has not named another one."""
    if _log is not None:
        _log.open(path)


def end_log() -> None:
    """Close the log."""
    global _log
    if _log is not None:
        PACKAGE.removeHandler(_log)
        _log.close()
        _log = None
