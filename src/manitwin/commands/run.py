"""``manitwin run``: build a data set."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from manitwin.commands.console import err_console, out_console

if TYPE_CHECKING:
    from manitwin.engine.driver import ItemEnded

STYLES = {"accepted": "green", "rejected": "yellow", "failed": "red", "duplicate": "dim"}


def run(
    inputs: Annotated[
        list[Path] | None,
        typer.Argument(
            help="A .csv or .jsonl manifest, folders, files; none: go on with what is there.", metavar="MANIFEST"
        ),
    ] = None,
    dataset: Annotated[
        str, typer.Option("--dataset", "-o", help="The data set: a folder, or a URL (s3://, gs://).")
    ] = "",
    config: Annotated[Path | None, typer.Option(help="A TOML file of settings; default: the data set's own.")] = None,
    executor: Annotated[str, typer.Option(help="local, or ray for a cluster.")] = "local",
    address: Annotated[
        str | None, typer.Option(help="Ray's address ('auto'); none: a cluster of this machine.")
    ] = None,
    jobs: Annotated[int | None, typer.Option("--jobs", "-j", help="Processes; default: one a core.")] = None,
    seed: Annotated[int | None, typer.Option(help="Seed of everything random.")] = None,
    gripper: Annotated[list[str] | None, typer.Option(help="A gripper to verify for; may be repeated.")] = None,
    require_agreement: Annotated[
        bool, typer.Option("--require-agreement", help="Verify only grasps that both engines hold.")
    ] = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="One engine, one trial a grasp: no second opinion, no robustness.")
    ] = False,
    units: Annotated[str, typer.Option(help="Units of meshes: m, cm, mm or auto.")] = "auto",
    up: Annotated[str, typer.Option(help="Up axis of meshes: y, z or auto.")] = "auto",
    license: Annotated[str | None, typer.Option(help="Licence of the inputs (SPDX).")] = None,
    attribution: Annotated[str | None, typer.Option(help="Whom to credit for the inputs.")] = None,
    lines: Annotated[bool, typer.Option("--lines/--no-lines", help="Print a line for every item that ends.")] = True,
) -> None:
    """Build a data set of twins; run it again to go on where it stopped."""
    from manitwin.api import with_flags
    from manitwin.config import load_config
    from manitwin.dataset_root import DatasetRoot
    from manitwin.dataset_run import run as run_dataset
    from manitwin.dataset_run import stored_config
    from manitwin.errors import UsageError
    from manitwin.render.device import require_renderer

    if not dataset:
        raise UsageError("no data set; give a folder or URL with -o")
    settings = load_config(config) if config else stored_config(DatasetRoot(dataset))
    settings = with_flags(settings, seed, gripper or None, require_agreement, quick)
    if jobs is not None:
        if jobs < 1:
            raise UsageError(f"jobs is {jobs}; give 1 or more")
        settings = settings.model_copy(update={"run": settings.run.model_copy(update={"cpu": jobs})})
    if executor == "local":
        require_renderer()

    def started(items: int, opened: int) -> None:
        out_console.print(f"{items} items, {opened} to do", markup=False)

    report = run_dataset(
        inputs or [],
        dataset,
        config=settings,
        executor="ray" if executor == "ray" else _local(executor),
        address=address,
        defaults={"units": units, "up": up, "license": license, "attribution": attribution},
        on_start=started,
        on_ended=_print_item if lines else lambda event: None,
    )
    for remark in report.remarks:
        err_console.print(remark, markup=False)
    out_console.print(", ".join(f"{count} {state}" for state, count in report.counts.items()), markup=False)
    if report.left:
        err_console.print(f"{report.left} items wait for a service that does not answer", markup=False)
    if report.stopped:
        err_console.print(f"stopped: {report.stopped}", markup=False, style="red")
    if report.exit_code == 4:
        err_console.print(f"manitwin status {dataset} says more; run the same command again to go on", markup=False)
    raise typer.Exit(report.exit_code)


def _local(executor: str) -> Literal["local"]:
    from manitwin.dataset_run import EXECUTORS
    from manitwin.errors import UsageError, choose_from

    if executor != "local":
        raise UsageError(choose_from("executor", executor, EXECUTORS))
    return "local"


def _print_item(event: ItemEnded) -> None:
    item = event.item
    title = Path(item.file).name if item.file else f"'{(item.text or '')[:40]}'"
    style = STYLES.get(event.state, "")
    out_console.print(f"{event.state:<10} {event.twin_id} {title}: {event.detail}", markup=False, style=style)
