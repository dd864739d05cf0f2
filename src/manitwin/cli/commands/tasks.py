"""``manitwin tasks``: goals in scenes, checked by planning and said in words."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from manitwin.cli import option_values, options
from manitwin.cli.causes import print_causes, read_causes
from manitwin.cli.console import err_console, out_console, print_error
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from manitwin.episodes.tasks.tasks_run import TaskTotals

SHOWN_REASONS = 6


@options.with_options(options.RUN, before="json")
def tasks(
    scenes: Annotated[
        str,
        options.existing_path_argument("Scenes of `manitwin layout`.", "SCENES", "a folder that manitwin layout wrote"),
    ],
    out: Annotated[Path, options.output_folder("The folder to write tasks into.")],
    per_scene: Annotated[int | None, typer.Option(help="Maximum number of tasks per scene.", min=1, max=1000)] = None,
    robot: Annotated[
        str | None, option_values.ROBOTS.option(help="Robot that executes the tasks: a name, or a TOML file.")
    ] = None,
    vlm: Annotated[
        str | None,
        option_values.PROPOSERS.option(
            help="Model that proposes further tasks: openai:MODEL@URL, anthropic:MODEL, replay:FILE, or none.",
            metavar="SPEC",
        ),
    ] = None,
    bddl: Annotated[
        bool, typer.Option("--bddl", help="Also write the tasks that BDDL can express to OUT/bddl.")
    ] = False,
    twins: options.Twins = None,
    json: Json = False,
    **run: Any,
) -> None:
    """Find tasks in scenes, check each by planning, and write them with instructions; rerun the command to resume."""
    from manitwin.episodes.settings import TasksConfig

    settings = options.read_settings(TasksConfig, run, {"robot": robot, "per_scene": per_scene, "vlm": vlm})
    from manitwin.api import make_tasks
    from manitwin.cli.documents import tasks_document
    from manitwin.cli.progress import RunDisplay

    with RunDisplay("scenes", out) as watched:
        report = make_tasks(
            scenes, out, config=settings, twins=twins, bddl=bddl, **options.executor_settings(run), **watched.callbacks
        )
    for remark in report.run.remarks:
        err_console.print(remark)
    if report.run.stopped:
        print_error(f"stopped: {report.run.stopped}")
    print_causes(str(out))
    if report.totals is not None:
        _print_totals(report.totals, out)
        if report.bddl is not None:
            written, left_out = report.bddl
            out_console.print(f"{written} tasks in {out}/bddl; BDDL cannot say {left_out} others (left_out.json)")
    if json:
        print_document(tasks_document(report, str(out), read_causes(str(out))))
    if report.totals is None:
        raise typer.Exit(4)


def _print_totals(totals: TaskTotals, out: Path) -> None:
    out_console.print(
        f"{totals.tasks} tasks of {len(totals.kinds)} kinds in {totals.scenes} scenes, {totals.of_two_literals} of two"
        f" literals; {totals.candidates} candidates of one literal and {totals.candidates_of_two_literals} of two,"
        f" {totals.plannable} of {totals.checked} that were checked can be planned"
    )
    singles = {kind: counts for kind, counts in totals.by_kind.items() if "+" not in kind}
    for kind, counts in sorted(singles.items(), key=lambda item: (-item[1]["candidates"], item[0])):
        out_console.print(
            f"  {kind}: {counts['candidates']} candidates, {counts['plannable']} of {counts['checked']} planned"
        )
    if totals.dropped:
        most = list(totals.dropped.items())
        more = f", and {len(most) - SHOWN_REASONS} more reasons" if len(most) > SHOWN_REASONS else ""
        told = ", ".join(f"{count} {reason}" for reason, count in most[:SHOWN_REASONS])
        out_console.print(f"dropped: {told}{more}; tasks_report.json lists all")
    out_console.print(f"manitwin trajectories {out} -o EPISODES executes them")
