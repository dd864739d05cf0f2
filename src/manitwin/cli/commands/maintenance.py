"""``manitwin check``, ``retry`` and ``index``: put right what ledger, folders and tables of a data set say."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli import option_values, options
from manitwin.cli.console import err_console, out_console, print_error, print_layout_notice

_AGAIN = "rerun the build command with its inputs: it finds the finished twins, and builds the rest"

if TYPE_CHECKING:
    from pathlib import Path

    from manitwin.twin.dataset_root import DatasetRoot


def check(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only report what is wrong; repair nothing.")] = False,
    digests: Annotated[
        bool,
        typer.Option("--digests", help="Compare the digests of all files of finished twins, not only their sizes."),
    ] = False,
) -> None:
    """Check that the ledger, folders and tables of a data set agree, and repair what does not."""
    from manitwin.dataset.check import disagreements
    from manitwin.engine.ledger.ledger import Ledger
    from manitwin.engine.ledger.location import local_ledger
    from manitwin.errors import UsageError
    from manitwin.pipeline.settings import NotTwins, stored_config
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    path = local_ledger(root)
    if root.flat or not _is_ledger(path, root, dry_run):
        _check_folders(root, dry_run, digests)
        return
    left = repaired = 0
    try:
        keeps_work = stored_config(root).run.keep_work
    except NotTwins:  # by the folders of twins, all that is finished there would be opened again
        raise
    except UsageError as error:
        err_console.print(f"{error}, or remove it: the next build writes a new one")
        left, keeps_work = 1, True
    ledger = Ledger(path)
    try:
        for found in list(disagreements(ledger, root, keeps_work, digests=digests)):
            if found.repair is None or dry_run:
                left += 1
                err_console.print(found.what)
            else:
                found.repair()
                repaired += 1
                out_console.print(f"{found.what}: repaired")
        counts = ledger.counts()
    finally:
        ledger.close()
    states = ", ".join(f"{count} {state}" for state, count in counts.items())
    verdict = "the ledger and the folders agree" if not left else f"{left} problems are left"
    again = (
        f"; {repaired} repaired; manitwin build -o {dataset} builds the items that are open again" if repaired else ""
    )
    out_console.print(f"{states}: {verdict}{again}")
    raise typer.Exit(4 if left else 0)


def _is_ledger(path: Path, root: DatasetRoot, dry_run: bool) -> bool:
    """Tell whether a data set has a ledger that can be read; a damaged one is put aside. Raises UsageError without twins."""
    from manitwin.engine.ledger.integrity import LedgerDamaged, move_damaged_ledger
    from manitwin.engine.ledger.lock import hold_lock
    from manitwin.engine.ledger.reading import read_ledger

    if not os.path.lexists(path) and root.has_twins:
        out_console.print(f"{path}: no ledger; {_AGAIN}")
        return False
    try:
        with read_ledger(path) as ledger:
            ledger.execute("PRAGMA quick_check(1)").fetchone()
        return True
    except LedgerDamaged as error:
        cause = str(error).partition("; ")[0]
        if dry_run:
            err_console.print(f"{cause}; without --dry-run it is moved aside; then {_AGAIN}")
            return False
        with hold_lock(path):
            out_console.print(f"{cause}: moved aside as {move_damaged_ledger(path).name}; {_AGAIN}")
        return False


def _check_folders(root: DatasetRoot, dry_run: bool, digests: bool) -> None:
    """Check the twins of a data set without a ledger, or of the old layout, and its index where it has one."""
    from manitwin.dataset.check import damaged_twins, index_damage, rebuild_index

    print_layout_notice(root)
    damaged = list(damaged_twins(root, digests=digests))
    index = index_damage(root)
    for line in (*damaged, *([index] if index and (dry_run or damaged) else [])):
        err_console.print(line)
    if index and not dry_run and not damaged:
        rebuild_index(root)
        out_console.print(f"{index}: repaired")
    verdict = f"{len(damaged)} are damaged" if damaged else "all their files are there"
    out_console.print(f"{len(list(root.twin_ids()))} twins: {verdict}")
    raise typer.Exit(4 if damaged or (index and dry_run) else 0)


def retry(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    state: Annotated[str, option_values.ENDED_STATES.option(help="State of the items: failed or rejected.")] = "failed",
    stage: Annotated[str | None, typer.Option(help="Retry only items that ended in this stage.")] = None,
    reason: Annotated[str | None, typer.Option(help="Retry only items that ended for this reason.")] = None,
) -> None:
    """Reopen failed or rejected items and reset their attempts; the next run processes them again."""
    from manitwin.engine.ledger.ledger import Ledger
    from manitwin.engine.ledger.location import local_ledger
    from manitwin.engine.ledger.reading import read_ledger
    from manitwin.errors import UsageError, unknown_name_message
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    path = local_ledger(root)
    with read_ledger(path) as reader:
        stages = [row[0] for row in reader.execute("SELECT DISTINCT stage FROM stages")]
        if stage is not None and stage not in stages:
            raise UsageError(unknown_name_message("stage", stage, stages))
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
    out_console.print(f"{count} items are open again; manitwin build -o {dataset} builds them")


def index(
    dataset: Annotated[
        str,
        options.existing_path_argument("A data set: a folder or URL.", "DATASET", "the folder or URL of a data set"),
    ],
    jobs: options.Jobs = None,
) -> None:
    """Rebuild the index of a data set from its twins; the old index stays in use until the new one is complete."""
    from rich.progress import MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    from manitwin.api import write_index
    from manitwin.twin.dataset_root import DatasetRoot

    print_layout_notice(DatasetRoot(dataset))
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
    out_console.print(f"{accepted} accepted, {rejected} rejected, {grasps} grasps indexed in {dataset}")
    raise typer.Exit(4 if written.unreadable else 0)
