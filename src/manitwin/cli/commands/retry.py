"""``manitwin retry``: open ended items again."""

from __future__ import annotations

from typing import Annotated

import typer

from manitwin.cli import choices
from manitwin.cli.console import out_console


def retry(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    state: Annotated[str, choices.ENDED_STATES.option(help="failed or rejected.")] = "failed",
    stage: Annotated[str | None, typer.Option(help="Only items that ended in this stage.")] = None,
    reason: Annotated[str | None, typer.Option(help="Only items that ended for this reason.")] = None,
) -> None:
    """Open failed or rejected items again, their attempts forgotten; the next run takes them up."""
    from manitwin.engine.ledger.ledger import Ledger, read_ledger
    from manitwin.errors import UsageError, choose_from
    from manitwin.pipeline.dataset_run import local_ledger
    from manitwin.twin.dataset_root import DatasetRoot, twin_name

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
                root.remove(twin_name(twin_id))
        count = ledger.reopen(number for number, _ in rows)
    finally:
        ledger.close()
    out_console.print(f"{count} items are open again; manitwin run -o {dataset} takes them up", markup=False)
