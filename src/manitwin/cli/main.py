"""The command line: one twin or many, a data set, and what is asked of both.

Exit status: 0 all accepted, 3 some rejected, 4 some unfinished and resumable, 2 wrong use or configuration,
130 interrupted where nothing can be resumed.
"""

from __future__ import annotations

import json
import os
import sys
from pathlib import Path
from typing import Annotated

import typer
from typer.completion import completion_init, get_completion_script

from manitwin.cli import options
from manitwin.cli.arguments import CheckedCommand, MultiWordCommandGroup, register
from manitwin.cli.commands.affordances import affordances
from manitwin.cli.commands.audit import audit
from manitwin.cli.commands.build import build, run
from manitwin.cli.commands.capture import capture
from manitwin.cli.commands.carve import carve
from manitwin.cli.commands.catalog import catalog
from manitwin.cli.commands.collect import collect_add, collect_draw, collect_plan, collect_status
from manitwin.cli.commands.doctor import doctor
from manitwin.cli.commands.evaluate import evaluate
from manitwin.cli.commands.export import export
from manitwin.cli.commands.fake import fake
from manitwin.cli.commands.gripper import gripper
from manitwin.cli.commands.import_ import import_
from manitwin.cli.commands.layout import layout
from manitwin.cli.commands.locate import locate
from manitwin.cli.commands.maintenance import check, index, retry
from manitwin.cli.commands.models import models
from manitwin.cli.commands.plan import plan
from manitwin.cli.commands.prompts import prompts
from manitwin.cli.commands.publish import publish
from manitwin.cli.commands.query import query
from manitwin.cli.commands.render import render
from manitwin.cli.commands.review import review, review_apply, review_import, review_report, review_sample, review_tune
from manitwin.cli.commands.review_cutouts import review_cutouts
from manitwin.cli.commands.search import search
from manitwin.cli.commands.segmentation import segmentation
from manitwin.cli.commands.stats import stats
from manitwin.cli.commands.status import status
from manitwin.cli.commands.tasks import tasks
from manitwin.cli.commands.trajectories import trajectories
from manitwin.cli.commands.view import view
from manitwin.cli.commands.vqa import vqa
from manitwin.cli.console import error_console, out_console, write_text
from manitwin.cli.documents import (
    CommandLineError,
    Json,
    is_json_requested,
    print_document,
    print_failure,
    reset_json_output,
)
from manitwin.cli.interrupt import Interrupts
from manitwin.cli.lazy_help import only_asked_for
from manitwin.cli.machine_limits import RESUMABLE_STATUS, USAGE_STATUS, machine_error_message
from manitwin.cli.option_values import SHELLS
from manitwin.cli.reporting import LOG, Quiet, Verbose, set_global_verbosity, with_reporting_options
from manitwin.cli.run_log import end_log
from manitwin.cli.terminal import escape_terminal_output
from manitwin.errors import BackendError, ManiTwinError, Unavailable
from manitwin.formats.installation import import_remedy, installed_version, names_shared_library
from manitwin.formats.printable import printable_line

PROGRAM = "manitwin"
COMPLETION_VARIABLE = f"_{PROGRAM.upper()}_COMPLETE"
"""Where a shell's script asks for completions instead of a command to be run: typer's convention."""
TYPER_INTERRUPTED = 130
"""What typer returns where it caught a KeyboardInterrupt by itself."""
LONGEST_LINE = 1500
"""An error quotes what was given, which may be of any length: more characters are left out in the middle."""

_interrupts = Interrupts()
app = typer.Typer(
    cls=MultiWordCommandGroup,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["--help", "-h"]},
)


def _print_version(wanted: bool) -> None:
    if wanted:
        out_console.print(f"{PROGRAM} {installed_version()}")
        raise typer.Exit


@app.callback(invoke_without_command=True)
def _manitwin(
    context: typer.Context,
    version: Annotated[
        bool, typer.Option("--version", help="Print the version and exit.", callback=_print_version, is_eager=True)
    ] = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Turn photos, texts and meshes into data-generation-ready digital twins."""
    _interrupts.command = context.invoked_subcommand or ""
    set_global_verbosity(verbose, quiet)
    if context.invoked_subcommand is None:
        out_console.print(context.get_help(), paragraph=True)


for watched in (build, layout, tasks, trajectories, render):
    register(app, with_reporting_options(watched, own_log=True))
register(app, with_reporting_options(run, own_log=True), "run", hidden=True)
for making in (index, stats, publish, export, segmentation, affordances, catalog, vqa):
    register(app, with_reporting_options(making))
register(app, with_reporting_options(import_), "import")
for other in (
    status, retry, check, query, search, plan, doctor, gripper, models, fake, prompts, audit, carve, evaluate, capture, locate,
    view,
):  # fmt: skip
    register(app, other)
register(app, review)
for name, reviewing in (
    ("sample", review_sample),
    ("import", review_import),
    ("report", review_report),
    ("apply", review_apply),
    ("cutouts", review_cutouts),
    ("tune", review_tune),
):
    register(app, reviewing, f"review {name}")
for name, collecting in (
    ("add", collect_add),
    ("status", collect_status),
    ("plan", collect_plan),
    ("draw", collect_draw),
):
    register(app, collecting, f"collect {name}")


@app.command(cls=CheckedCommand)
def show(
    twin: Annotated[
        Path, options.existing_path_argument("A twin folder.", "TWIN", "a folder that manitwin build made")
    ],
    json_: Json = False,
) -> None:
    """Print a readable summary of a twin, after checking its files."""
    from manitwin.api import load
    from manitwin.cli.documents import show_document
    from manitwin.cli.summary import print_summary

    loaded = load(twin, verify=True)
    if json_:
        print_document(show_document(loaded))
    else:
        print_summary(loaded, out_console)


@app.command(cls=CheckedCommand)
def completion(
    shell: Annotated[str, SHELLS.argument(help="bash, zsh or fish.", metavar="SHELL")],
) -> None:
    """Print the script for shell completion of commands, options and names."""
    script = get_completion_script(prog_name=PROGRAM, complete_var=COMPLETION_VARIABLE, shell=shell)
    write_text(f"{script.strip()}\n")


@app.command(cls=CheckedCommand)
def schema() -> None:
    """Print the JSON Schema of twin.json."""
    from manitwin.api import schema as record_schema

    write_text(json.dumps(record_schema(), indent=1) + "\n")


def _report_error(error: Exception) -> tuple[int, str]:
    """Tell who asked for JSON of an error, and return its exit status and the line that a person reads."""
    path = f"{PROGRAM} {_interrupts.command}".rstrip()
    if isinstance(error, CommandLineError):
        message = getattr(error, "format_message", error.__str__)()
        message = f"{_shown(message).removesuffix('.')}{'' if message.endswith('?') else '.'} See {path} --help"
    else:
        message = _shown(str(error))
    status = RESUMABLE_STATUS if isinstance(error, BackendError) else USAGE_STATUS
    if isinstance(error, OSError):
        message, status = _os_error_message(error)
    if is_json_requested(error):
        print_failure(error, message, status)
    return status, f"{path}: {message}"


def _shown(message: str) -> str:
    return printable_line(" ".join(message.split()), max_characters=LONGEST_LINE)


def _os_error_message(error: OSError) -> tuple[str, int]:
    """Return one line for what the system refused and no other part of the program has explained, and the exit status."""
    known = machine_error_message(error)
    if known is not None:
        return _shown(known[0]), known[1]
    named = os.fsdecode(error.filename) if isinstance(error.filename, str | bytes) else "a file"
    return _shown(f"{named}: {error.strerror or error}; check the path"), USAGE_STATUS


def _run() -> int:
    """Run what the command line says and return the exit status; every error is one line."""
    reset_json_output()
    try:
        words = sys.argv[1:]
        asked = app if COMPLETION_VARIABLE in os.environ else only_asked_for(app, words)
        status = asked(words, prog_name=PROGRAM, standalone_mode=False)
        if status == TYPER_INTERRUPTED:
            raise KeyboardInterrupt
        return int(status or 0)
    except (KeyboardInterrupt, typer.Abort) as error:
        LOG.warning("interrupted")
        if is_json_requested(error):
            print_failure(error, _interrupts.message, _interrupts.status)
        _interrupts.print_message()
        return _interrupts.status
    except (CommandLineError, ManiTwinError, OSError) as error:
        LOG.debug("the error came from here", exc_info=error)
        code, line = _report_error(error)
        error_console.print(line, style="red")
        return code
    except ImportError as error:
        if not names_shared_library(error):
            LOG.exception("a defect in manitwin")
            raise
        LOG.debug("the error came from here", exc_info=error)
        code, line = _report_error(Unavailable(f"{error}: {import_remedy(error, '')}"))
        error_console.print(line, style="red")
        return code
    except Exception as error:
        found = machine_error_message(error)
        if found is None:
            LOG.exception("a defect in manitwin")
            raise
        LOG.error("the error came from here", exc_info=error)
        message, code = found
        if is_json_requested(error):
            print_failure(error, message, code)
        line = f"{PROGRAM} {_interrupts.command}".rstrip()
        error_console.print(f"{line}: {printable_line(message)}", markup=False, style="red")
        return code


def main() -> None:
    """Run the command line."""
    global _interrupts
    _interrupts = Interrupts()
    _interrupts.listen()
    escape_terminal_output()
    if COMPLETION_VARIABLE in os.environ:
        completion_init()
    try:
        status = _run()
        LOG.info("ends with exit status %d", status)
        _interrupts.exit_on_next_signal(status)
    except KeyboardInterrupt:  # as the first interrupt came while an error was said
        _interrupts.print_message()
        status = _interrupts.status
        _interrupts.exit_on_next_signal(status)
    finally:
        end_log()
    sys.exit(status)


def interrupted() -> bool:
    """Tell whether the command line was interrupted."""
    return _interrupts.interrupted


if __name__ == "__main__":
    main()
