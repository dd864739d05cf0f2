"""What reaches the terminal beside the consoles: warnings, tracebacks and logs of libraries, escaped like everything else."""

from __future__ import annotations

import io
import logging
import sys
import traceback
import warnings
from types import TracebackType

from manitwin.formats.printable import printable


class _PrintableFormatter(logging.Formatter):
    """Lines of a library's log as a terminal may show them."""

    def format(self, record: logging.LogRecord) -> str:
        """Return the record as text."""
        return printable(super().format(record))


def escape_terminal_output() -> None:
    """Escape what Python itself prints, and write what the terminal's encoding lacks as escapes instead of failing."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    warnings.formatwarning = _warning_text
    sys.excepthook = _print_traceback
    if logging.lastResort is not None:
        logging.lastResort.setFormatter(_PrintableFormatter())


def _warning_text(
    message: Warning | str, category: type[Warning], filename: str, lineno: int, line: str | None = None
) -> str:
    return printable(f"{filename}:{lineno}: {category.__name__}: {message}") + "\n"


def _print_traceback(kind: type[BaseException], error: BaseException, trace: TracebackType | None) -> None:
    sys.stderr.write(printable("".join(traceback.format_exception(kind, error, trace))))
