"""Consoles of commands: one for results and remarks, which ``--quiet`` leaves out, and one for errors, which are always printed.

Whatever is printed on these consoles also goes to the log of the run, where there is one (``run_log``).
"""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

from rich.console import Console

PACKAGE = logging.getLogger("manitwin")


if TYPE_CHECKING:
    from manitwin.twin.dataset_root import DatasetRoot

SAID = logging.getLogger("manitwin.said")
"""What was printed; the log of a run has it, and ``--verbose`` does not print it again."""


class LoggedConsole(Console):
    """A console whose lines are also told to a logger, as ``level``."""

    def __init__(self, level: int, **options: Any):
        super().__init__(highlight=False, soft_wrap=True, emoji=False, **options)  # 'host:x:' is no emoji
        self._level = level

    def print(self, *objects: Any, logged: bool = True, **options: Any) -> None:
        """Print as ``rich.console.Console.print`` does; ``logged`` False: on the screen alone."""
        lines = [each for each in objects if isinstance(each, str) and each.strip()]
        if logged and lines:
            SAID.log(self._level, "%s", " ".join(lines))
        super().print(*objects, **options)


out_console = LoggedConsole(logging.INFO)
err_console = LoggedConsole(logging.WARNING, stderr=True)
error_console = LoggedConsole(logging.ERROR, stderr=True)


class PrintedLog(logging.Handler):
    """Print what the package logs: what ``--verbose`` adds."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, unless it is of what was printed already."""
        if record.name != SAID.name:
            err_console.print(self.format(record), markup=False, style="dim", logged=False)


_printed_log = PrintedLog(logging.INFO)


def be_quiet(quiet: bool) -> None:
    """Leave out all but errors, or no more."""
    out_console.quiet = err_console.quiet = quiet


def be_verbose(verbose: bool) -> None:
    """Also print what the package logs, or no more."""
    PACKAGE.removeHandler(_printed_log)
    if verbose:
        PACKAGE.setLevel(logging.DEBUG)
        PACKAGE.addHandler(_printed_log)


def print_estimate(usd_by_kind: dict[str, float]) -> None:
    """Say about what services will charge for a twin, where they charge anything."""
    if any(usd_by_kind.values()):
        each = ", ".join(f"{usd:.4f} USD of {kind}" for kind, usd in usd_by_kind.items())
        err_console.print(f"services charge about, for a twin: {each}", markup=False)


def note_old_layout(root: DatasetRoot) -> None:
    """Say so where a data set is of the layout of earlier versions."""
    if root.flat:
        err_console.print(
            f"{root.url}: in the flat layout of earlier versions, which is read and not added to", markup=False
        )


def print_error(message: str) -> None:
    """Say what went wrong with one of several things; ``--quiet`` does not leave it out."""
    error_console.print(message, markup=False)
