"""The command line: one twin or many, a data set, and what is asked of both.

Exit status: 0 all accepted, 3 some rejected, 4 some unfinished and resumable, 2 wrong use or configuration.
"""

from __future__ import annotations

import json
import signal
import sys
from pathlib import Path
from typing import Annotated, NoReturn

import typer

from manitwin.commands.audit import audit
from manitwin.commands.build import build
from manitwin.commands.check import check
from manitwin.commands.console import err_console, out_console
from manitwin.commands.doctor import doctor
from manitwin.commands.export import export
from manitwin.commands.fake import fake
from manitwin.commands.import_ import import_
from manitwin.commands.index import index
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

app = typer.Typer(
    add_completion=False,
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    help="Turn photos, texts and meshes into data-generation-ready digital twins.",
)


for command in (build, run, status, retry, check, index, query, stats, publish, doctor, fake, prompts, export, audit):
    app.command()(command)


app.command("import")(import_)
app.command()(layout)
app.command()(trajectories)
app.command()(render)


@app.command()
def show(twin: Annotated[Path, typer.Argument(help="A twin folder.", metavar="TWIN")]) -> None:
    """Print a readable summary of a twin, after checking its files."""
    from manitwin.api import load
    from manitwin.summary import print_summary

    print_summary(load(twin, verify=True), out_console)


@app.command()
def schema() -> None:
    """Print the JSON Schema of twin.json."""
    from manitwin.api import schema as record_schema

    sys.stdout.write(json.dumps(record_schema(), indent=1) + "\n")


def _fail(message: str, code: int) -> NoReturn:
    err_console.print(f"manitwin: {' '.join(message.split())}", markup=False, style="red")
    sys.exit(code)


def _interrupt(signal_number: int, frame: object) -> NoReturn:
    raise KeyboardInterrupt


def main() -> None:
    """Run the command line; every error is one line."""
    signal.signal(signal.SIGTERM, _interrupt)
    try:
        status = app(standalone_mode=False)
        if status == TYPER_INTERRUPTED:
            raise KeyboardInterrupt
        sys.exit(status)
    except CommandLineError as error:
        _fail(f"{getattr(error, 'format_message', error.__str__)()} See manitwin --help", 2)
    except (KeyboardInterrupt, typer.Abort):
        _fail("interrupted; run the same command again to go on where it stopped", 4)
    except UsageError as error:
        _fail(str(error), 2)
    except BackendError as error:
        _fail(str(error), 4)
    except ManiTwinError as error:
        _fail(str(error), 2)


if __name__ == "__main__":
    main()
