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

from manitwin.commands.check import check
from manitwin.commands.console import err_console, out_console
from manitwin.commands.index import index
from manitwin.commands.publish import publish
from manitwin.commands.query import query
from manitwin.commands.retry import retry
from manitwin.commands.run import run
from manitwin.commands.stats import stats
from manitwin.commands.status import status
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


@app.command()
def build(
    inputs: Annotated[
        list[Path], typer.Argument(help="Images, meshes, folders, or .csv/.jsonl manifests.", metavar="INPUT...")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="The folder to write twins into.")],
    name: Annotated[str | None, typer.Option(help="What the object is ('mug'): the key to the priors.")] = None,
    units: Annotated[str, typer.Option(help="Units of meshes: m, cm, mm or auto.")] = "auto",
    up: Annotated[str, typer.Option(help="Up axis of meshes: y, z or auto.")] = "auto",
    license: Annotated[str | None, typer.Option(help="Licence of the inputs (SPDX).")] = None,
    attribution: Annotated[str | None, typer.Option(help="Whom to credit for the inputs.")] = None,
    jobs: Annotated[int | None, typer.Option("--jobs", "-j", help="Processes; default: one a core.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of everything random; default: the configuration's.")] = None,
    config: Annotated[Path | None, typer.Option(help="A TOML file of settings.")] = None,
    gripper: Annotated[
        list[str] | None, typer.Option(help="A gripper to verify for; may be repeated, the first is the twin's own.")
    ] = None,
    require_agreement: Annotated[
        bool, typer.Option("--require-agreement", help="Verify only grasps that both engines hold.")
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="One engine, one trial a grasp: no second opinion, no robustness.")
    ] = False,
) -> None:
    """Build a verified twin of every input."""
    from manitwin.api import build as build_twins
    from manitwin.progress import BuildProgress
    from manitwin.render.device import require_renderer
    from manitwin.run_summary import grasp_lines, summarize_grasps

    require_renderer()
    progress = BuildProgress(out_console, err_console)
    with progress:
        report = build_twins(
            inputs,
            out,
            name=name,
            units=units,
            up=up,
            license=license,
            attribution=attribution,
            jobs=jobs,
            seed=seed,
            config=config,
            grippers=gripper or None,
            require_agreement=require_agreement,
            quick=quick,
            on_start=progress.start,
            on_stage=progress.stage,
            on_result=progress.result,
        )
    for remark in report.remarks:
        err_console.print(remark, markup=False)
    accepted, rejected, unfinished = (report.count(s) for s in ("accepted", "rejected", "unfinished"))
    out_console.print(f"{accepted} accepted, {rejected} rejected, {unfinished} unfinished, in {out}", markup=False)
    for line in grasp_lines(summarize_grasps(report.records())):
        out_console.print(line, markup=False)
    if unfinished:
        err_console.print("run the same command again to go on where it stopped", markup=False)
    raise typer.Exit(report.exit_code)


for command in (run, status, retry, check, index, query, stats, publish):
    app.command()(command)


@app.command()
def show(twin: Annotated[Path, typer.Argument(help="A twin folder.", metavar="TWIN")]) -> None:
    """Print a readable summary of a twin, after checking its files."""
    from manitwin.api import load
    from manitwin.summary import print_summary

    print_summary(load(twin, verify=True), out_console)


@app.command()
def doctor() -> None:
    """Say what is there and what is missing on this machine."""
    from manitwin.doctor import examine

    findings = examine()
    for finding in findings:
        mark = "ok     " if finding.ok else "missing"
        out_console.print(f"{mark} {finding.name}: {finding.detail}", markup=False)
    raise typer.Exit(0 if all(finding.ok for finding in findings) else 4)


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
