"""``--json``: one document on stdout, and nothing else; docs/json.md names the keys."""

from __future__ import annotations

import json
import sys
from typing import Annotated, Any

import typer

from manitwin.cli.console import out_console

FLAG = "--json"


# the base of what typer raises for a wrong command line; it has no public name of its own
CommandLineError: type[Exception] = next(
    base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException"
)

_wanted = False


def _keep_stdout(wanted: bool) -> bool:
    """Send what is printed for a person to stderr, or no more."""
    global _wanted
    _wanted = out_console.stderr = wanted
    return wanted


Json = Annotated[
    bool,
    typer.Option(
        FLAG, callback=_keep_stdout, help="Print one JSON document on stdout; all that is for a person goes to stderr."
    ),
]


def print_document(document: dict[str, Any]) -> None:
    """Print the document of a command."""
    sys.stdout.write(json.dumps(document, indent=1, allow_nan=False) + "\n")


def print_failure(error: BaseException, message: str, exit_status: int) -> None:
    """Print the document of a command that could not be carried out."""
    print_document({"error": {"type": type(error).__name__, "message": message, "exit_status": exit_status}})


def asked_for_json(error: BaseException) -> bool:
    """Return whether a command that ended with ``error`` was asked for JSON."""
    return _wanted or (isinstance(error, CommandLineError) and _stands_in(sys.argv[1:], getattr(error, "ctx", None)))


def _stands_in(arguments: list[str], context: typer.Context | None) -> bool:
    """Return whether the flag stands in a wrong command line, of which nothing may have been parsed: not as a value."""
    parameters = [] if context is None else [*context.command.params, *context.find_root().command.params]
    take_value = {
        name
        for each in parameters
        for name in each.opts
        if each.param_type_name == "option" and not each.is_flag  # type: ignore[attr-defined]
    }
    left = iter(arguments)
    for argument in left:
        if argument in (FLAG, "--"):
            return argument == FLAG
        if argument in take_value:
            next(left, None)
    return False
