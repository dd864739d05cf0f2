"""``--json``: one document on stdout, and nothing else; docs/json.md names the keys."""

from __future__ import annotations

import json
import sys
from typing import Annotated, Any

import typer

from manitwin.commands.console import out_console

FLAG = "--json"


def _keep_stdout(wanted: bool) -> bool:
    """Send what is printed for a person to stderr, or no more."""
    out_console.stderr = wanted
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
    """Print why a command could not be carried out, where it was asked for JSON."""
    if FLAG in sys.argv[1:]:
        name = type(error).__name__
        print_document({"error": {"type": name, "message": message, "exit_status": exit_status}})
