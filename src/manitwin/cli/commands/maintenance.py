"""``manitwin check``, ``retry`` and ``index``: put right what ledger, folders and tables of a data set say."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import choices, options
from manitwin.cli.console import err_console, note_old_layout, out_console, print_error

if TYPE_CHECKING:
    from manitwin.twin.dataset_root import DatasetRoot


def check(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what is wrong, repair nothing.")] = False,
) -> None:
    """Prove that ledger, folders and tables of a data set agree, and put right what does not."""
    from manitwin.dataset.check import disagreements
    from manitwin.engine.ledger.ledger import Ledger, read_ledger
    from manitwin.engine.ledger.location import local_ledger
    from manitwin.pipeline.settings import stored_config
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    if root.flat:
        _check_flat(root)
        return
    path = local_ledger(root)
    with read_ledger(path):
        pass  # a data set without a ledger is said to be none, and not given one
    ledger = Ledger(path)
    left = repaired = 0
    try:
        for found in list(disagreements(ledger, root, stored_config(root).run.keep_work)):
            if found.repair is None or dry_run:
                left += 1
                err_console.print(found.what, markup=False)
            else:
                found.repair()
                repaired += 1
                out_console.print(f"{found.what}: put right", markup=False)
        counts = ledger.counts()
    finally:
        ledger.close()
    states = ", ".join(f"{count} {state}" for state, count in counts.items())
    verdict = "ledger and folders agree" if not left else f"{left} things are wrong"
    again = f"; {repaired} put right, manitwin build -o {dataset} does what is open again" if repaired else ""
    out_console.print(f"{states}: {verdict}{again}", markup=False)
    raise typer.Exit(4 if left else 0)


def _check_flat(root: DatasetRoot) -> None:
    """Check the twins of a folder of the old layout, which has no ledger to agree with."""
    from manitwin.dataset.check import damaged_twins

    note_old_layout(root)
    damaged = list(damaged_twins(root))
    for line in damaged:
        err_console.print(line, markup=False)
    verdict = f"{len(damaged)} are damaged" if damaged else "all their files are there"
    out_console.print(f"{len(list(root.twin_ids()))} twins: {verdict}", markup=False)
    raise typer.Exit(4 if damaged else 0)


def retry(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    state: Annotated[str, choices.ENDED_STATES.option(help="failed or rejected.")] = "failed",
    stage: Annotated[str | None, typer.Option(help="Only items that ended in this stage.")] = None,
    reason: Annotated[str | None, typer.Option(help="Only items that ended for this reason.")] = None,
) -> None:
    """Open failed or rejected items again, their attempts forgotten; the next run takes them up."""
    from manitwin.engine.ledger.ledger import Ledger, read_ledger
    from manitwin.engine.ledger.location import local_ledger
    from manitwin.errors import UsageError, choose_from
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    path = local_ledger(root)
    with read_ledger(path) as reader:
        stages = [row[0] for row in reader.execute("SELECT DISTINCT stage FROM stages")]
        if stage is not None and stage not in stages:
            raise UsageError(choose_from("stage", stage, stages))
        rows = reader.execute(
            "SELECT i.number, i.twin_id FROM items i WHERE i.state = ?1 AND (?2 IS NULL OR i.reason = ?2) AND (?3 IS NULL"
            " OR EXISTS (SELECT 1 FROM stages s WHERE s.number = i.number AND s.stage = ?3 AND s.state = ?1))",
            (state, reason, stage),
        ).fetchall()
    ledger = Ledger(path)
    try:
        if state == "rejected":  # its folder says that it has ended, and would end it again
            for _, twin_id in rows:
                root.remove(root.twin_name(twin_id))
        count = ledger.reopen(number for number, _ in rows)
    finally:
        ledger.close()
    out_console.print(f"{count} items are open again; manitwin build -o {dataset} takes them up", markup=False)


def index(
    dataset: Annotated[
        str,
        options.existing("A data set: a folder or URL.", "DATASET", "the folder or URL of a data set"),
    ],
    jobs: options.Jobs = None,
) -> None:
    """Write the index of a data set again, from its twins alone; the old one serves until the new one is whole."""
    from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from manitwin.api import write_index
    from manitwin.twin.dataset_root import DatasetRoot

    note_old_layout(DatasetRoot(dataset))
    columns = (TextColumn("reading"), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=err_console, transient=True) as progress:
        task = progress.add_task("reading", total=None)
        written = write_index(
            dataset,
            jobs=jobs,
            on_start=lambda twins: progress.update(task, total=twins),
            on_read=lambda twins: progress.advance(task, twins),
        )
    for line in written.unreadable:
        print_error(f"left out: {line}")
    accepted, rejected, grasps = (written.rows(table) for table in ("twins", "rejections", "grasps"))
    out_console.print(f"{accepted} accepted, {rejected} rejected, {grasps} grasps indexed in {dataset}", markup=False)
    raise typer.Exit(4 if written.unreadable else 0)
