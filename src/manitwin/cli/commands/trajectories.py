"""``manitwin trajectories``: demonstrations of twins, planned and proven in physics."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.causes import causes_of, print_causes
from manitwin.cli.console import err_console, out_console, print_error
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.engine.drive import RunReport
    from manitwin.episodes.retirement import Retirement


def trajectories(
    source: Annotated[
        str,
        typer.Argument(
            help="A data set, a folder of twins, or scenes of `manitwin layout`.",
            metavar="DATASET|SCENES",
            callback=choices.must_exist("a data set, a folder of twins, or what manitwin layout wrote"),
        ),
    ],
    out: Annotated[
        Path, typer.Option("--out", "-o", help="The folder to write episodes into.", callback=choices.folder_to_write)
    ],
    count: Annotated[
        int, typer.Option("-n", help="How many episodes to attempt.", callback=choices.count_of("-n"))
    ] = 100,
    robot: Annotated[
        str | None, choices.ROBOTS.option(help="A robot by name, or a TOML file that describes one.")
    ] = None,
    skill: Annotated[str | None, choices.SKILLS.option(help="What to do: pick_place.")] = None,
    twins: options.Twins = None,
    others: Annotated[int | None, typer.Option(help="So many other objects around, where twins are given.")] = None,
    retire: Annotated[
        bool, typer.Option("--retire/--no-retire", help="Retire grasps that fail, in their twins' records.")
    ] = True,
    formats: Annotated[
        str,
        choices.EPISODE_FORMATS.option(
            "--format", help="What to write beside the batches: lerobot, maniskill, or both by a comma."
        ),
    ] = "lerobot,maniskill",
    seed: options.Seed = None,
    config: options.Config = None,
    jobs: options.Jobs = None,
    executor: options.Executor = "local",
    address: options.Address = None,
    json: Json = False,
) -> None:
    """Plan and execute pick-and-place episodes, and keep what succeeded; run it again to go on where it stopped."""
    from manitwin.episodes.settings import TrajectoriesConfig
    from manitwin.scenes.run_settings import load_settings

    given = {"seed": seed, "robot": robot, "skill": skill, "others": others, "run": options.run_settings(jobs)}
    settings = load_settings(TrajectoriesConfig, config, given)
    from manitwin.cli.documents import trajectories_document
    from manitwin.cli.progress import WatchedRun
    from manitwin.engine.ledger.location import local_log
    from manitwin.episodes.collect import chosen_formats, collect
    from manitwin.episodes.episodes_run import make_episodes, retire_failing
    from manitwin.twin.dataset_root import DatasetRoot

    wanted = chosen_formats(formats)
    with WatchedRun("batches", lambda: local_log(DatasetRoot(out))) as watched:
        report = make_episodes(
            source, out, count, settings, twins=twins, executor=options.executor_name(executor), address=address,
            on_start=watched.start, on_stage=watched.progress.stage, on_ended=watched.progress.item_ended,
        )  # fmt: skip
    for remark in report.remarks:
        err_console.print(remark, markup=False)
    if report.exit_code == 4:
        _print_unfinished(report, out)
        if json:
            print_document(trajectories_document(report, str(out), causes_of(str(out)), None, [], 0))
        raise typer.Exit(4)
    collected = collect(out, wanted)
    found, fresh = retire_failing(out) if retire else ([], 0)
    for line in collected.lines:
        out_console.print(line, markup=False)
    if retire:
        _print_retired(found, fresh)
    out_console.print(f"manitwin stats {out} says more", markup=False)
    if json:
        print_document(trajectories_document(report, str(out), causes_of(str(out)), collected, found, fresh))


def _print_unfinished(report: RunReport, out: Path) -> None:
    if report.stopped:
        print_error(f"stopped: {report.stopped}")
    print_causes(str(out))
    if report.open:
        err_console.print(f"manitwin status {out} says more; run the same command again to go on", markup=False)


def _print_retired(found: list[Retirement], fresh: int) -> None:
    out_console.print(f"{len(found)} grasps fail end to end, {fresh} of them retired now", markup=False)
    for each in found:
        what = ", ".join(f"{n} {outcome}" for outcome, n in each.outcomes.items())
        out_console.print(f"  {each.twin_id} {each.grasp_id}: {each.failed} of {each.executed} ({what})", markup=False)
