"""Checks that every command makes of its arguments first: their length and characters, and that each option is given once."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable
from typing import Any

import typer
from typer.core import TyperCommand, TyperGroup

from manitwin.cli.lazy_help import import_quick_help
from manitwin.errors import UsageError

PLACES = frozenset(
    {
        "inputs",
        "paths",
        "twins",
        "twin",
        "dataset",
        "source",
        "episodes",
        "scenes",
        "prompts",
        "out",
        "draw",
        "config",
        "record",
        "log",
        "labels",
        "image",
        "baseline",
        "write_baseline",
        "depth",
        "poses",
        "rgb",
        "mask",
        "camera",
        "cloud",
        "base",
        "seen",
        "scene",
        "bag",
        "report",
        "html",
        "verdicts",
        "export",
        "form",
        "sheet",
        "static",
        "catalogue",
        "root",
        "clip",
        "ulip",
    }
)
"""The parameters, of whatever command, that name files, folders or URLs."""
LONGEST_PLACE = 4095
"""Bytes: PATH_MAX of Linux without its end (``limits.h``)."""
LONGEST_TEXT = 100_000
"""Characters: less than what Linux takes for one argument (``MAX_ARG_STRLEN``)."""


def check_no_repeated_options(order: Iterable[Any]) -> None:
    """Raise UsageError for an option that takes one value and is given twice; ``order`` are the parameters as they were given."""
    times = Counter(each for each in order if each.param_type_name == "option" and not (each.multiple or each.is_flag))
    for option, count in times.items():
        if count > 1:
            raise UsageError(
                f"{_parameter_label(option)}: given {count} times; this option takes one value, give it once"
            )


class CheckedCommand(TyperCommand):
    """A command whose texts and paths are checked before they are converted; numbers are checked by their own types."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the command line; raises UsageError for an argument that is empty, too long, or no text, and for a second value.

        Of two values of an option that takes one the parser would keep the last: half of what was asked for would be done.
        """
        given, _, order = self.make_parser(ctx).parse_args(args=list(args))
        check_no_repeated_options(order)
        for parameter in self.params:
            values = given.get(parameter.name or "")
            for value in values if isinstance(values, list | tuple) else [values]:
                if isinstance(value, str):
                    check_text(_parameter_label(parameter), value, place=parameter.name in PLACES)
        return super().parse_args(ctx, args)

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help of this command."""
        import_quick_help()
        super().format_help(ctx, formatter)


class MultiWordCommandGroup(TyperGroup):
    """A group of commands some of whose names are two words: ``review report`` is a command, and so is ``review``."""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Write the help of all commands."""
        import_quick_help()
        super().format_help(ctx, formatter)

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the first words name, and the arguments behind them."""
        both = " ".join(args[:2])
        return super().resolve_command(ctx, [both, *args[2:]] if len(args) > 1 and both in self.commands else args)


def check_text(called: str, value: str, *, place: bool) -> None:
    """Raise UsageError, naming the parameter, for a value that no command takes; ``place``: it names a file or folder."""
    if "\0" in value:
        raise UsageError(f"{called}: contains a NUL character; remove it")
    if len(value) > LONGEST_TEXT:
        raise UsageError(f"{called}: {len(value)} characters are too many; give at most {LONGEST_TEXT}")
    if not place:
        return
    if not value.strip():
        raise UsageError(f"{called}: is empty; give a path, such as . for this folder")
    try:
        length = len(os.fsencode(value))
    except UnicodeEncodeError as error:
        raise UsageError(f"{called}: {value!r} is not a valid file name; check the path") from error
    if length > LONGEST_PLACE:
        raise UsageError(f"{called}: {value[:40]!r}... has {length} bytes; a path has at most {LONGEST_PLACE}")


def parse_azimuths_deg(value: str, photos: int) -> list[float]:
    """Return the degrees of a list with commas; one that ends in ``...`` goes on by its last step, up to one a photo.

    Raises UsageError for what are no degrees, and where no step can be told.
    """
    said = [turn.strip() for turn in value.split(",")]
    goes_on = len(said) > 1 and said[-1] in ("...", "\N{HORIZONTAL ELLIPSIS}")
    try:
        turns = [float(turn) for turn in (said[:-1] if goes_on else said)]
    except ValueError:
        told = value if len(value) <= 60 else f"{value[:60]}..."
        raise UsageError(
            f"--turns {told!r}: not a list of degrees; give one angle per photo, such as 0,90,180, or 0,10,... for equal steps"
        ) from None
    if not goes_on:
        return turns
    if len(turns) < 2 or len(turns) > photos:
        raise UsageError(
            f"--turns {value!r}: does not fit {photos} photos; give two or more angles before the dots, at most one per photo"
        )
    step = turns[-1] - turns[-2]
    return turns + [turns[-1] + step * number for number in range(1, photos - len(turns) + 1)]


def _parameter_label(parameter: Any) -> str:
    return str(parameter.opts[0] if parameter.param_type_name == "option" else parameter.metavar or parameter.name)


def register(app: typer.Typer, function: Any, name: str | None = None, *, hidden: bool = False) -> None:
    """Make a function a command whose arguments are checked."""
    app.command(name, cls=CheckedCommand, hidden=hidden)(function)
