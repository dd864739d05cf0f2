"""The command line: one twin or many, a data set, and what is asked of both.

Exit status: 0 all accepted, 3 some rejected, 4 some unfinished and resumable, 2 wrong use or configuration.
"""

from __future__ import annotations

import json
import os
import signal
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from manitwin.commands.audit import audit
from manitwin.commands.build import build
from manitwin.commands.check import check
from manitwin.commands.choices import there
from manitwin.commands.completion import COMPLETION_VARIABLE, PROGRAM, completion, completion_init
from manitwin.commands.console import err_console, out_console
from manitwin.commands.doctor import doctor
from manitwin.commands.export import export
from manitwin.commands.fake import fake
from manitwin.commands.import_ import import_
from manitwin.commands.index import index
from manitwin.commands.json_output import Json, print_document, print_failure
from manitwin.commands.layout import layout
from manitwin.commands.prompts import prompts
from manitwin.commands.publish import publish
from manitwin.commands.query import query
from manitwin.commands.render import render
from manitwin.commands.retry import retry
from manitwin.commands.run import run
from manitwin.commands.stats import stats
from manitwin.commands.status import status
from manitwin.commands.trajectories import trajectories
from manitwin.errors import BackendError, ManiTwinError, UsageError

TYPER_INTERRUPTED = 130
"""What typer returns where it caught a KeyboardInterrupt by itself."""

# the base of what typer raises for a wrong command line; it has no public name of its own
CommandLineError: type[Exception] = next(
    base for base in typer.BadParameter.__mro__ if base.__name__ == "ClickException"
)

_command_path = PROGRAM  # of the command that is at work: an error names it
app = typer.Typer(add_completion=False, pretty_exceptions_enable=False)


def _print_version(wanted: bool) -> None:
    if wanted:
        from importlib.metadata import version

        out_console.print(f"{PROGRAM} {version(PROGRAM)}", markup=False)
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _manitwin(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version, and end.", callback=_print_version, is_eager=True)
    ] = False,
) -> None:
    """Turn photos, texts and meshes into data-generation-ready digital twins."""
    global _command_path
    _command_path = f"{PROGRAM} {context.invoked_subcommand or ''}".rstrip()
    if context.invoked_subcommand is None:
        out_console.print(context.get_help(), markup=False)


for command in (build, run, status, retry, check, index, query, stats, publish, doctor, fake, prompts, export, audit):
    app.command()(command)


app.command("import")(import_)
app.command()(layout)
app.command()(trajectories)
app.command()(render)
app.command()(completion)


@app.command()
def show(
    twin: Annotated[
        Path, typer.Argument(help="A twin folder.", metavar="TWIN", callback=there("a folder that manitwin build made"))
    ],
    json_: Json = False,
) -> None:
    """Print a readable summary of a twin, after checking its files."""
    from manitwin.api import load
    from manitwin.commands.documents import show_document
    from manitwin.summary import print_summary

    loaded = load(twin, verify=True)
    if json_:
        print_document(show_document(loaded))
    else:
        print_summary(loaded, out_console)


@app.command()
def schema() -> None:
    """Print the JSON Schema of twin.json."""
    from manitwin.api import schema as record_schema

    sys.stdout.write(json.dumps(record_schema(), indent=1) + "\n")


def _fail(error: BaseException, message: str, code: int) -> NoReturn:
    print_failure(error, message, code)
    err_console.print(f"{_command_path}: {' '.join(message.split())}", markup=False, style="red")
    sys.exit(code)


def _interrupt(signal_number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line; every error is one line."""
    signal.signal(signal.SIGTERM, _interrupt)
    if COMPLETION_VARIABLE in os.environ:
        completion_init()
    try:
        status = app(prog_name=PROGRAM, standalone_mode=False)
        if status == TYPER_INTERRUPTED:
            raise KeyboardInterrupt
        sys.exit(status)
    except CommandLineError as error:
        message = getattr(error, "format_message", error.__str__)()
        _fail(error, f"{message.removesuffix('.')}{'' if message.endswith('?') else '.'} See {_command_path} --help", 2)
    except (KeyboardInterrupt, typer.Abort) as error:
        _fail(error, "interrupted; run the same command again to go on where it stopped", 4)
    except UsageError as error:
        _fail(error, str(error), 2)
    except BackendError as error:
        _fail(error, str(error), 4)
    except ManiTwinError as error:
        _fail(error, str(error), 2)


if __name__ == "__main__":
    main()
