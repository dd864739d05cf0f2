"""The options that commands share: each is written once."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from manitwin.cli import choices

if TYPE_CHECKING:
    from manitwin.pipeline.dataset_run import ExecutorName

Text = Annotated[
    list[str] | None, typer.Option("--text", help="A thing to make from words alone; may be repeated.", metavar="WORDS")
]
Units = Annotated[str, choices.UNITS.option(help="Units of meshes: m, cm, mm or auto.")]
Up = Annotated[str, choices.UP.option(help="Up axis of meshes: y, z or auto.")]
License = Annotated[str | None, typer.Option(help="Licence of the inputs (SPDX).")]
Attribution = Annotated[str | None, typer.Option(help="Whom to credit for the inputs.")]
Strict = Annotated[bool, typer.Option("--strict", help="A manifest column that nobody knows is an error.")]
Jobs = Annotated[
    int | None,
    typer.Option("--jobs", "-j", help="Processes; default: one a core.", callback=choices.count_of("jobs")),
]
Seed = Annotated[int | None, typer.Option(help="Seed of everything random; default: the configuration's.")]
Executor = Annotated[
    str, choices.EXECUTORS.option(help="local, ray for a cluster, or inline: this process, for a debugger.")
]
Address = Annotated[str | None, typer.Option(help="Ray's address ('auto'); none: a cluster of this machine.")]
Config = Annotated[Path | None, typer.Option(help="A TOML file of settings.", callback=choices.settings_file)]
Grippers = Annotated[
    list[str] | None,
    choices.GRIPPERS.option("--gripper", help="A gripper to verify for; may be repeated, the first is the twin's own."),
]
Vlm = Annotated[
    str | None,
    choices.ANNOTATORS.option(
        help="Who looks: openai:MODEL@URL, anthropic:MODEL, replay:FILE, or rules.", metavar="SPEC"
    ),
]
Generator = Annotated[
    str | None,
    choices.GENERATORS.option(
        help="Who makes meshes: rodin, tripo, meshy, hunyuan3d@URL, fal:ENDPOINT, 'command:...', lift.", metavar="SPEC"
    ),
]
Grasper = Annotated[
    str | None,
    choices.GRASPERS.option(
        help="Who proposes grasps: graspgen@tcp://HOST:PORT, graspgenx@..., antipodal.", metavar="SPEC"
    ),
]
MaxCost = Annotated[
    float | None, typer.Option("--max-cost", help="USD that services may charge in all; then stop, resumable.")
]
RequireAgreement = Annotated[
    bool, typer.Option("--require-agreement", help="Verify only grasps that both engines hold.")
]
Quick = Annotated[
    bool, typer.Option("--quick", help="One engine, one trial a grasp: no second opinion, no robustness.")
]
Twins = Annotated[
    str | None,
    typer.Option(help="Where the twins are now, if no longer where they were.", metavar="DATASET"),
]
Record = Annotated[
    Path | None, typer.Option(help="Add every answer of the model to this file, for --vlm replay:FILE.", metavar="FILE")
]


def run_settings(jobs: int | None) -> dict[str, Any]:
    """Return what ``--jobs`` says of an application's run."""
    return {"index_every": 0, "keep_work": False, **({} if jobs is None else {"cpu": jobs})}


def executor_name(given: str) -> ExecutorName:
    """Return what ``Executor`` holds, which was checked as it was read, under its own type."""
    return cast("ExecutorName", given)
