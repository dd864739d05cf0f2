"""``manitwin run``: build a data set."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import err_console, out_console, print_error, print_estimate
from manitwin.cli.json_output import Json, print_document
from manitwin.cli.planned import DryRun, print_plan
from manitwin.cli.why import causes_of, print_causes

if TYPE_CHECKING:
    from manitwin.config import BuildConfig
    from manitwin.engine.events import ItemEnded
    from manitwin.pipeline.dataset_run import ExecutorName, RunReport

STYLES = {"accepted": "green", "rejected": "yellow", "failed": "red", "duplicate": "dim"}


def run(
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="A .csv or .jsonl manifest, folders, files; none: go on with what is there.",
            metavar="MANIFEST",
            callback=choices.must_exist("an image, a mesh, a folder, or a .csv or .jsonl manifest"),
        ),
    ] = None,
    dataset: Annotated[
        str,
        typer.Option(
            "--dataset", "-o", help="The data set: a folder, or a URL (s3://, gs://).", callback=choices.folder_to_write
        ),
    ] = "",
    config: options.Config = None,
    text: options.Text = None,
    executor: options.Executor = "local",
    address: options.Address = None,
    jobs: options.Jobs = None,
    seed: options.Seed = None,
    gripper: options.Grippers = None,
    vlm: options.Vlm = None,
    generator: options.Generator = None,
    grasper: options.Grasper = None,
    max_cost: options.MaxCost = None,
    record: options.Record = None,
    require_agreement: options.RequireAgreement = False,
    quick: options.Quick = False,
    units: options.Units = "auto",
    up: options.Up = "auto",
    license: options.License = None,
    attribution: options.Attribution = None,
    strict: options.Strict = False,
    lines: Annotated[bool, typer.Option("--lines/--no-lines", help="Print a line for every item that ends.")] = True,
    json: Json = False,
    dry_run: DryRun = False,
) -> None:
    """Build a data set of twins; run it again to go on where it stopped."""
    from manitwin.errors import UsageError

    if not dataset:
        raise UsageError("no data set; give a folder or URL with -o")
    from manitwin.api import with_flags
    from manitwin.config import load_config
    from manitwin.pipeline.dataset_run import stored_config
    from manitwin.twin.dataset_root import DatasetRoot

    settings = load_config(config) if config else stored_config(DatasetRoot(dataset))
    settings = with_flags(
        settings, seed=seed, grippers=gripper or None, vlm=vlm, generator=generator, grasper=grasper,
        max_cost_usd=max_cost, record=record, require_agreement=require_agreement, quick=quick,
    )  # fmt: skip
    if jobs is not None:
        settings = settings.model_copy(update={"run": settings.run.model_copy(update={"cpu": jobs})})
    defaults: dict[str, str | None] = {"units": units, "up": up, "license": license, "attribution": attribution}
    given: dict[str, Any] = {"texts": text or [], "defaults": defaults, "strict": strict}
    if dry_run:
        _print_dry_run(inputs or [], dataset, settings, given, as_json=json)
        return
    report = _run(
        inputs or [], dataset, lines=lines, executor=options.executor_name(executor), address=address, config=settings,
        **given,
    )  # fmt: skip
    _print_report(report, dataset)
    if json:
        from manitwin.cli.documents import run_document

        print_document(run_document(report, dataset, causes_of(dataset)))
    raise typer.Exit(report.exit_code)


def _print_dry_run(
    inputs: list[Path], dataset: str, settings: BuildConfig, given: dict[str, Any], *, as_json: bool
) -> None:
    from manitwin.cli.dry_run import plan_run
    from manitwin.pipeline.dataset_run import require_work
    from manitwin.pipeline.generator_input import refusal
    from manitwin.pipeline.manifest import Notes, iterate_items
    from manitwin.pipeline.recipe import check_names
    from manitwin.twin.dataset_root import DatasetRoot

    require_work(DatasetRoot(dataset), inputs, given["texts"])
    check_names(settings)
    notes = Notes()
    items = iterate_items(inputs, notes=notes, refusal=refusal(settings), **given)
    print_plan(plan_run(items, DatasetRoot(dataset), settings, notes.remarks), dataset, as_json=as_json)


def _run(inputs: list[Path], dataset: str, *, lines: bool, executor: ExecutorName, **arguments: Any) -> RunReport:
    """Run while a person watches; ``arguments`` are those of ``dataset_run.run``."""
    from manitwin.cli.watched_run import WatchedRun
    from manitwin.dataset.index.parts import IndexTables
    from manitwin.pipeline.dataset_run import local_log
    from manitwin.pipeline.dataset_run import run as run_dataset
    from manitwin.render.device import require_renderer
    from manitwin.twin.dataset_root import DatasetRoot

    if executor != "ray":
        require_renderer()

    def ended(event: ItemEnded) -> None:
        watched.progress.item_ended(event)
        if lines:
            _print_item(event)

    with WatchedRun("items", lambda: local_log(DatasetRoot(dataset))) as watched:
        return run_dataset(
            inputs, dataset, tables=IndexTables(), executor=executor, **arguments,
            on_estimate=print_estimate, on_start=watched.start, on_stage=watched.progress.stage, on_ended=ended,
        )  # fmt: skip


def _print_report(report: RunReport, dataset: str) -> None:
    for remark in report.remarks:
        err_console.print(remark, markup=False)
    out_console.print(", ".join(f"{count} {state}" for state, count in report.counts.items()), markup=False)
    if report.left:
        # a run that was stopped says by itself what for: no money left, a key that is refused
        why = "" if report.stopped else " for a service that does not answer"
        err_console.print(f"{report.left} items wait{why}", markup=False)
    if report.stopped:
        print_error(f"stopped: {report.stopped}")
    print_causes(dataset)
    if report.open:
        err_console.print(f"manitwin status {dataset} says more; run the same command again to go on", markup=False)


def _print_item(event: ItemEnded) -> None:
    style = STYLES.get(event.state, "")
    out_console.print(
        f"{event.state:<10} {event.task.item_id} {event.task.payload.title}: {event.detail}", markup=False, style=style
    )
