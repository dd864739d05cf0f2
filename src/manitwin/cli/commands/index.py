"""``manitwin index``: write the tables of a data set again from its folders."""

from __future__ import annotations

from typing import Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import err_console, out_console, print_error


def index(
    dataset: Annotated[
        str,
        typer.Argument(
            help="A data set: a folder or URL.",
            metavar="DATASET",
            callback=choices.must_exist("the folder or URL of a data set"),
        ),
    ],
    jobs: options.Jobs = None,
) -> None:
    """Write the index of a data set again, from its twins alone; the old one serves until the new one is whole."""
    import os

    from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from manitwin.dataset.index.rebuild import rebuild
    from manitwin.errors import UsageError
    from manitwin.twin.dataset_root import TWINS, DatasetRoot

    root = DatasetRoot(dataset)
    if not root.exists(TWINS):
        raise UsageError(
            f"{dataset}: no data set ({TWINS}/ is missing); give the folder or URL that manitwin run wrote"
        )
    columns = (TextColumn("reading"), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err_console, transient=True) as progress:
        task = progress.add_task("reading", total=None)
        written = rebuild(
            root,
            jobs=jobs or os.cpu_count() or 1,
            on_start=lambda twins: progress.update(task, total=twins),
            on_read=lambda twins: progress.advance(task, twins),
        )
    for line in written.unreadable:
        print_error(f"left out: {line}")
    accepted, rejected, grasps = (written.rows(table) for table in ("twins", "rejections", "grasps"))
    out_console.print(f"{accepted} accepted, {rejected} rejected, {grasps} grasps indexed in {dataset}", markup=False)
    raise typer.Exit(4 if written.unreadable else 0)
