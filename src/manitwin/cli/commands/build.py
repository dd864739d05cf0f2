"""``manitwin build``: twins of one input or of 100,000, in a data set."""

from __future__ import annotations

import gc
from contextlib import nullcontext
from functools import partial, wraps
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from manitwin.cli import option_values, options
from manitwin.cli.arguments import parse_azimuths_deg
from manitwin.cli.causes import print_causes
from manitwin.cli.console import err_console, error_console, out_console, print_error, print_estimate
from manitwin.cli.documents import Json, print_document
from manitwin.cli.interrupt import WATCH
from manitwin.formats.installation import block_import, defer_import

if TYPE_CHECKING:
    from manitwin.engine.drive import ExecutorName
    from manitwin.engine.events import StageEvent
    from manitwin.pipeline.build_report import BuildReport, ItemResult
    from manitwin.pipeline.settings import BuildRequest

STYLES = {"accepted": "green", "rejected": "yellow", "unfinished": "red", "duplicate": "dim"}
MOST_LINES = 50
"""So many inputs that were there already, or wait, have a line of their own at the end."""
MOST_RECORDS = 1000
"""The grasps of so many twins are added up at the end: each record is read for it; `manitwin stats` does it for any number."""
OF_WORKERS = ("manitwin.dataset.build", "manitwin.engine.executors.local_worker")
"""The modules that import what a worker needs."""
RUN_RENAMED = "`manitwin run` is deprecated and will be removed in the next version; use `manitwin build`"


@options.with_options({**options.OF_INPUTS, **options.FLAGS}, before="strict")
def build(
    inputs: Annotated[
        list[Path] | None,
        options.existing_path_argument(
            "Images, meshes, folders, or .csv/.jsonl manifests; without any, resume the data set.",
            "INPUT",
            "an image, a mesh, a folder, or a .csv or .jsonl manifest; put the description of an object behind --text",
        ),
    ] = None,
    out: Annotated[str, options.output_folder("The data set: a folder, or a URL (s3://, gs://).")] = "",
    text: options.Text = None,
    count: options.Count = 1,
    views: options.Views = False,
    turns: options.Turns = None,
    poses: options.Poses = None,
    strict: options.Strict = False,
    config: options.Config = None,
    executor: options.Executor = "local",
    address: options.Address = None,
    jobs: options.Jobs = None,
    lines: Annotated[bool, typer.Option("--lines/--no-lines", help="Print a line for every finished input.")] = True,
    json: Json = False,
    dry_run: options.DryRun = False,
    **said: Any,
) -> None:
    """Build a verified twin of every input; rerun the command to resume."""
    from manitwin.errors import UsageError

    if not out:
        raise UsageError("no data set given; give the folder or URL to write twins into with -o")
    arguments: dict[str, Any] = {
        "texts": text or [], "count": count, "strict": strict, "jobs": jobs, "config": config, "views": views,
        "turns_deg": None if turns is None else _turns(turns, inputs or [], views), "poses": poses,
    }  # fmt: skip
    if dry_run:
        _print_dry_run(inputs or [], out, arguments, said, as_json=json)
        return
    request = _request(inputs or [], out, arguments, said)
    report, told = _build_with_progress(request, lines=lines, executor=cast("ExecutorName", executor), address=address)
    _print_report(report, lines, told)
    if json:
        from manitwin.cli.causes import read_causes
        from manitwin.cli.documents import build_document

        print_document(build_document(report, read_causes(out, report.run.given)))
    raise typer.Exit(report.exit_code)


def _turns(turns: str, inputs: list[Path], views: bool) -> Any:
    """Return the turns, or where a folder is among the inputs what makes them once it is listed."""
    if views and any(path.is_dir() for path in inputs):
        return partial(parse_azimuths_deg, turns)
    return parse_azimuths_deg(turns, len(inputs))


Dataset = Annotated[str, typer.Option("--dataset", "--out", "-o", callback=option_values.check_output_folder)]


@options.with_options({"out": (Dataset, "")})
@wraps(build)
def run(**given: Any) -> None:
    """Run ``build``: the deprecated name of that command for many inputs."""
    err_console.print(RUN_RENAMED)
    build(**given)


def _print_dry_run(
    inputs: list[Path], out: str, arguments: dict[str, Any], said: dict[str, Any], *, as_json: bool
) -> None:
    request = _request(inputs, out, arguments, said)
    from manitwin.cli.build_plan import plan_build  # after what is put off
    from manitwin.cli.dry_run import print_plan

    print_plan(plan_build(request.items, request.root, request.settings, request.notes.remarks), out, as_json=as_json)


def _request(inputs: list[Path], out: str, arguments: dict[str, Any], said: dict[str, Any]) -> BuildRequest:
    """Check what was said; ``arguments`` are those of ``request_build``, ``said`` defaults of the inputs and flags."""
    from manitwin.engine.process_limits import limit_library_threads

    limit_library_threads()  # before NumPy is loaded: with its threads this process could not be forked
    defer_import("networkx", "Graph")  # a tenth of the imports, which trimesh asks for and few things use
    defer_import("collada")  # a twentieth, which reads one format of many
    defer_import("cascadio")  # 32 MB in each worker: what reads STEP runs in a process of its own
    gc.disable()  # imports leave next to nothing to be collected, and a twentieth of their time went into looking for it
    try:
        from manitwin.pipeline.settings import Flags, request_build

        defaults = {name: said[name] for name in options.OF_INPUTS}
        flags = {name: value for name, value in said.items() if name not in defaults}
        return request_build(inputs, out, **arguments, defaults=defaults, flags=cast(Flags, flags))
    finally:
        gc.enable()


def _build_with_progress(
    request: BuildRequest, *, lines: bool, executor: ExecutorName, address: str | None
) -> tuple[BuildReport, int]:
    """Build while a person watches; returns the report, and how many of its remarks were told as the work began."""
    from manitwin.cli.progress import RunDisplay
    from manitwin.dataset.build import build_requested
    from manitwin.engine.fork_server import forked_workers
    from manitwin.engine.stage import INPUT
    from manitwin.render.device import require_driver, require_renderer, share_device_search

    if executor == "inline":
        require_renderer()
    elif executor == "local":
        require_driver()  # what renders is looked for by the first stage that draws
    asked: list[bool] = []
    told = 0

    def started(items: int, opened: int) -> None:
        nonlocal told
        watched.start(items, opened)
        told = len(request.notes.remarks)
        for remark in request.notes.remarks:  # before days of work: why what is there is made again
            err_console.print(remark)

    def require_device_once() -> None:
        """End a build that has begun its work and could not draw; one that finds all of it done needs no device."""
        if executor == "local" and not asked:
            asked.append(True)
            require_renderer()

    def staged(event: StageEvent) -> None:
        watched.stage(event)
        if getattr(event, "state", None) == "done" and event.stage != INPUT:
            require_device_once()

    def ended(result: ItemResult) -> None:
        watched.progress.record_ended(result.item, result.status, result.reused)
        if not result.reused:
            require_device_once()
        if lines:
            _print_result(result)

    forked = forked_workers(OF_WORKERS, [WATCH]) if executor == "local" else nullcontext()
    watch = RunDisplay("inputs", request.out, lambda: request.notes.under_way)
    # pandas is 30 MB in each worker that Arrow takes where it finds it; forked before threads show how far it is
    with block_import("pandas"), share_device_search(), forked, watch as watched:
        report = build_requested(
            request, executor=executor, address=address, on_estimate=print_estimate, on_start=started, on_stage=staged,
            on_result=ended,
        )  # fmt: skip
    return report, told


def _print_report(report: BuildReport, lines: bool, told: int) -> None:
    from manitwin.cli.run_summary import grasp_lines, other_gripper_lines, summarize_grasps

    for remark in report.remarks[told:]:
        err_console.print(remark)
    if lines:
        _print_others(report)
    counted = {status: report.count(status) for status in STYLES}
    said = ", ".join(f"{count} {status}" for status, count in counted.items() if count or status != "duplicate")
    out_console.print(f"{said}, in {report.dataset}")
    if counted["accepted"] <= MOST_RECORDS:
        records = list(report.records())
        for line in [*grasp_lines(summarize_grasps(records)), *other_gripper_lines(records)]:
            out_console.print(line)
    if report.run.left:
        # a build that was stopped says by itself what for: no money left, a key that is refused
        why = "" if report.run.stopped else " for a service that does not answer"
        err_console.print(f"{report.run.left} inputs are waiting{why}")
    if report.run.stopped:
        print_error(f"stopped: {report.run.stopped}")
    told = len(report.run.given) == 1 and lines and not out_console.quiet
    print_causes(report.dataset, report.run.given, told=told)
    if report.open:
        err_console.print(f"manitwin status {report.dataset} shows details; rerun the same command to resume")


def _print_others(report: BuildReport) -> None:
    """Print what became of inputs that did not end now: they were there already, or wait."""
    others = (each for each in report.iterate() if each.number not in report.ended)
    for result in islice(others, MOST_LINES):
        _print_result(result)
    more = sum(1 for _ in others)
    if more:
        out_console.print(f"... and {more} more from earlier runs (--json lists all)")


def _print_result(result: ItemResult) -> None:
    again = " (already there)" if result.reused else ""
    shown = result.folder / "card.png" if result.folder is not None and result.status == "accepted" else result.folder
    where = f" -> {shown}" if shown is not None else ""
    line = f"{result.status:<10} {result.item.title}: {result.detail}{again}{where}"
    # what has not been made is an error, though a person who looks on reads of it among the other inputs
    console = error_console if out_console.quiet and result.status == "unfinished" else out_console
    console.print(line, style=STYLES[result.status])
