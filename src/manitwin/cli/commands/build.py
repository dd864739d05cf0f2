"""``manitwin build``: twins of a few inputs, in one folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import err_console, error_console, out_console, print_error, print_estimate
from manitwin.cli.json_output import Json, print_document
from manitwin.cli.planned import DryRun, print_plan
from manitwin.cli.why import causes_of_build, print_causes_of_build

if TYPE_CHECKING:
    from manitwin.api import BuildReport
    from manitwin.pipeline.build_item import ItemResult

STYLES = {"accepted": "green", "rejected": "yellow", "unfinished": "red"}
BUILD_LOG = "build.log"


def build(
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="Images, meshes, folders, or .csv/.jsonl manifests.",
            metavar="INPUT...",
            callback=choices.must_exist("an image, a mesh, a folder, or a .csv or .jsonl manifest"),
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", "-o", help="The folder to write twins into.", callback=choices.folder_to_write),
    ] = None,
    text: options.Text = None,
    name: Annotated[str | None, typer.Option(help="What the object is ('mug'): the key to the priors.")] = None,
    units: options.Units = "auto",
    up: options.Up = "auto",
    license: options.License = None,
    attribution: options.Attribution = None,
    strict: options.Strict = False,
    jobs: options.Jobs = None,
    seed: options.Seed = None,
    config: options.Config = None,
    gripper: options.Grippers = None,
    vlm: options.Vlm = None,
    generator: options.Generator = None,
    grasper: options.Grasper = None,
    max_cost: options.MaxCost = None,
    record: options.Record = None,
    require_agreement: options.RequireAgreement = False,
    quick: options.Quick = False,
    json: Json = False,
    dry_run: DryRun = False,
) -> None:
    """Build a verified twin of every input."""
    from manitwin.errors import UsageError

    if out is None:
        raise UsageError("no folder to write twins into; give one with -o")
    defaults = {
        "name": name, "units": units, "up": up, "license": license, "attribution": attribution, "strict": strict,
    }  # fmt: skip
    flags = {
        "seed": seed, "grippers": gripper or None, "vlm": vlm, "generator": generator, "grasper": grasper,
        "max_cost_usd": max_cost, "record": record, "require_agreement": require_agreement, "quick": quick,
    }  # fmt: skip
    if dry_run:
        from manitwin.api import request_build
        from manitwin.cli.dry_run import plan_build

        request = request_build(inputs or [], out, text or [], config, defaults=defaults, flags=flags)
        plan = plan_build(request.items, request.place, request.settings, request.notes.remarks)
        print_plan(plan, str(out), as_json=json)
        return
    report = _build(inputs or [], out, texts=text or [], jobs=jobs, config=config, **defaults, **flags)
    _print_report(report, out)
    if json:
        from manitwin.cli.documents import build_document

        print_document(build_document(report, str(out), causes_of_build(report)))
    raise typer.Exit(report.exit_code)


def _build(inputs: list[Path], out: Path, **arguments: Any) -> BuildReport:
    """Build while a person watches; ``arguments`` are those of ``api.build``."""
    from manitwin.api import build as build_twins
    from manitwin.cli.watched_run import WatchedRun
    from manitwin.render.device import require_renderer
    from manitwin.twin.store import WORK

    require_renderer()

    def ended(result: ItemResult) -> None:
        watched.progress.ended(result.item, result.status, result.reused)
        _print_result(result)

    with WatchedRun("inputs", lambda: out / WORK / BUILD_LOG) as watched:
        return build_twins(
            inputs, out, **arguments, on_estimate=print_estimate, on_start=watched.start,
            on_stage=watched.progress.stage, on_result=ended,
        )  # fmt: skip


def _print_report(report: BuildReport, out: Path) -> None:
    from manitwin.cli.run_summary import grasp_lines, summarize_grasps

    for remark in report.remarks:
        err_console.print(remark, markup=False)
    accepted, rejected, unfinished = (report.count(s) for s in ("accepted", "rejected", "unfinished"))
    out_console.print(f"{accepted} accepted, {rejected} rejected, {unfinished} unfinished, in {out}", markup=False)
    for line in grasp_lines(summarize_grasps(report.records())):
        out_console.print(line, markup=False)
    print_causes_of_build(report)
    if unfinished:
        print_error("run the same command again to go on where it stopped")


def _print_result(result: ItemResult) -> None:
    again = " (already there)" if result.reused else ""
    shown = result.folder / "card.png" if result.folder is not None and result.status == "accepted" else result.folder
    where = f" -> {shown}" if shown is not None else ""
    line = f"{result.status:<10} {result.item.title}: {result.detail}{again}{where}"
    # what has not been made is an error, though a person who looks on reads of it among the other items
    console = error_console if out_console.quiet and result.status == "unfinished" else out_console
    console.print(line, style=STYLES[result.status], markup=False)
