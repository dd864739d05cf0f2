"""Consoles of commands: one for results and remarks, which ``--quiet`` leaves out, and one for errors, which are always printed.

Whatever is printed on these consoles also goes to the log of the run, where there is one (``run_log``). Names of files,
captions, answers of servers and errors may hold anything: nothing that a terminal would obey, or hide, goes through
``LoggedConsole`` and ``write_text``, which escape it, and no text is read as Rich's markup.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

from rich.console import Console, ConsoleOptions, ConsoleRenderable, RenderHook
from rich.segment import Segment
from rich.text import Text

from manitwin.formats.printable import printable, printable_json, printable_line

PACKAGE = logging.getLogger("manitwin")


if TYPE_CHECKING:
    from manitwin.twin.dataset_root import DatasetRoot

SAID = logging.getLogger("manitwin.said")
"""What was printed; the log of a run has it, and ``--verbose`` does not print it again."""


class _EscapedRenderable:
    """Something to print with every text in it as a terminal may show it; what Rich itself says to the terminal stays."""

    def __init__(self, renderable: ConsoleRenderable):
        self._renderable = renderable

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> Iterator[Segment]:
        for segment in console.render(self._renderable, options):
            yield segment if segment.control else segment._replace(text=printable(segment.text))


class _PrintableHook(RenderHook):
    """Rich's hook for what is about to be printed."""

    def process_renderables(self, renderables: list[ConsoleRenderable]) -> list[ConsoleRenderable]:
        """Return what is to be printed, escaped."""
        return [_EscapedRenderable(each) for each in renderables]


class LoggedConsole(Console):
    """A console whose lines are also told to a logger, as ``level``; it escapes what a terminal would obey or hide."""

    def __init__(self, level: int, **options: Any):
        # 'host:x:' is no emoji, and '[red]' in a file's name no colour
        super().__init__(highlight=False, soft_wrap=True, emoji=False, markup=False, **options)
        self._level = level
        self.push_render_hook(_PrintableHook())

    def print(self, *objects: Any, logged: bool = True, paragraph: bool = False, **options: Any) -> None:
        """Print as ``rich.console.Console.print`` does; ``logged`` False: on the screen alone.

        A text takes one line, whatever stands in it; ``paragraph``: it has lines of its own.
        """
        escape = printable if paragraph else printable_line  # before Rich, which would leave some controls out unsaid
        objects = tuple(escape(each) if isinstance(each, str) else each for each in objects)
        lines = [each for each in objects if isinstance(each, str) and each.strip()]
        if logged and lines:
            SAID.log(self._level, "%s", " ".join(lines))
        super().print(*objects, **options)


def escape_cell_text(text: str) -> Text:
    """Return text of outsiders for a table's cell or a progress line: one line, no markup, nothing to be obeyed."""
    return Text(printable_line(text))


def write_text(text: str) -> None:
    """Write lines for a person, or a program, to stdout as they are, but for what a terminal would obey or hide."""
    sys.stdout.write(printable(text))


def write_json(text: str) -> None:
    """Write a JSON text to stdout; what a terminal would obey or hide stands in it as JSON's own escapes."""
    sys.stdout.write(printable_json(text))


out_console = LoggedConsole(logging.INFO)
err_console = LoggedConsole(logging.WARNING, stderr=True)
error_console = LoggedConsole(logging.ERROR, stderr=True)


class ConsoleLogHandler(logging.Handler):
    """Print what the package logs: what ``--verbose`` adds."""

    def emit(self, record: logging.LogRecord) -> None:
        """Print a record, unless it is of what was printed already."""
        if record.name != SAID.name:
            err_console.print(self.format(record), style="dim", logged=False, paragraph=True)


_printed_log = ConsoleLogHandler(logging.INFO)


def set_quiet(quiet: bool) -> None:
    """Leave out all but errors, or no more."""
    out_console.quiet = err_console.quiet = quiet


def set_verbose(verbose: bool) -> None:
    """Also print what the package logs, or no more."""
    PACKAGE.removeHandler(_printed_log)
    if verbose:
        PACKAGE.setLevel(logging.DEBUG)
        PACKAGE.addHandler(_printed_log)


def print_estimate(usd_by_kind: dict[str, float]) -> None:
    """Say about what services will charge for a twin, where they charge anything."""
    if any(usd_by_kind.values()):
        each = ", ".join(f"{usd:.4f} USD of {kind}" for kind, usd in usd_by_kind.items())
        err_console.print(f"approximate charges of services per twin: {each}")


def print_layout_notice(root: DatasetRoot) -> None:
    """Say so where a data set is of the layout of earlier versions."""
    if root.flat:
        err_console.print(f"{root.url}: uses the flat layout of earlier versions, which can be read but not extended")


def print_embedded_twin(twin_id: str) -> None:
    """Print that a twin was rendered and embedded for a search by picture."""
    err_console.print(f"{twin_id}: rendered and embedded; the result is cached", markup=False)


def print_error(message: str) -> None:
    """Say what went wrong with one of several things; ``--quiet`` does not leave it out."""
    error_console.print(message)
