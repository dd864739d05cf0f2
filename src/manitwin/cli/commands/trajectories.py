"""``manitwin trajectories``: demonstrations of twins, planned and proven in physics."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import option_values, options
from manitwin.cli.causes import print_causes, read_causes
from manitwin.cli.console import err_console, out_console, print_error
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.engine.drive import RunReport
    from manitwin.episodes.retirement import Retirement


@options.with_options(options.RUN, before="json")
def trajectories(
    source: Annotated[
        str,
        options.existing_path_argument(
            "A data set, a folder of twins, scenes of `manitwin layout`, or tasks of `manitwin tasks`.",
            "DATASET|SCENES|TASKS",
            "a data set, a folder of twins, or what manitwin layout or manitwin tasks wrote",
        ),
    ],
    out: Annotated[Path, options.output_folder("The folder to write episodes into.")],
    count: Annotated[
        int, typer.Option("-n", help="Number of episodes to attempt.", callback=option_values.count_callback("-n"))
    ] = 100,
    robot: Annotated[
        str | None, option_values.ROBOTS.option(help="Robot: a name, or a TOML file that describes one.")
    ] = None,
    skill: Annotated[
        str | None,
        option_values.SKILLS.option(help="Skill: pick_place, place_in, stack, left_of ... (docs/skills.md)."),
    ] = None,
    twins: options.Twins = None,
    others: Annotated[
        int | None, typer.Option(help="Number of clutter objects, if twins are given.", min=0, max=20)
    ] = None,
    retire: Annotated[
        bool,
        typer.Option("--retire/--no-retire", help="Mark grasps that fail as retired in the records of their twins."),
    ] = True,
    formats: Annotated[
        str,
        option_values.EPISODE_FORMATS.option(
            "--format", help="Formats to write beside the batches: lerobot, maniskill, or both separated by a comma."
        ),
    ] = "lerobot,maniskill",
    json: Json = False,
    **run: Any,
) -> None:
    """Plan and execute episodes of a skill, and keep those that succeed; rerun the command to resume."""
    from manitwin.episodes.settings import TrajectoriesConfig

    settings = options.read_settings(TrajectoriesConfig, run, {"robot": robot, "skill": skill, "others": others})
    from manitwin.api import make_episodes
    from manitwin.cli.documents import trajectories_document
    from manitwin.cli.progress import RunDisplay

    with RunDisplay("batches", out) as watched:
        report = make_episodes(
            source, out, count, config=settings, twins=twins, formats=formats.split(","), retire=retire,
            **options.executor_settings(run), **watched.callbacks,
        )  # fmt: skip
    for remark in report.run.remarks:
        err_console.print(remark)
    if report.totals is None:
        _print_unfinished(report.run, out)
    else:
        for line in report.lines:
            out_console.print(line)
        if retire:
            _print_retired(report.retired, report.newly_retired)
        out_console.print(f"manitwin stats {out} shows details")
    if json:
        print_document(trajectories_document(report, str(out), read_causes(str(out))))
    if report.totals is None:
        raise typer.Exit(4)


def _print_unfinished(report: RunReport, out: Path) -> None:
    if report.stopped:
        print_error(f"stopped: {report.stopped}")
    print_causes(str(out))
    if report.open:
        err_console.print(f"manitwin status {out} shows details; rerun the same command to resume")


def _print_retired(found: list[Retirement], fresh: int) -> None:
    out_console.print(f"{len(found)} grasps fail end to end; {fresh} of them were retired now")
    for each in found:
        what = ", ".join(f"{n} {outcome}" for outcome, n in each.outcomes.items())
        out_console.print(f"  {each.twin_id} {each.grasp_id}: {each.failed} of {each.executed} ({what})")
