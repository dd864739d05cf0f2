"""``manitwin check``: do the ledger and the folders agree?"""

from __future__ import annotations

from typing import Annotated

import typer

from manitwin.cli.console import err_console, out_console


def check(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    dry_run: Annotated[bool, typer.Option("--dry-run", help="Only say what is wrong, repair nothing.")] = False,
) -> None:
    """Prove that ledger, folders and tables of a data set agree, and put right what does not."""
    from manitwin.dataset.check import disagreements
    from manitwin.engine.ledger.ledger import Ledger, read_ledger
    from manitwin.pipeline.dataset_run import local_ledger, stored_config
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
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
    again = f"; {repaired} put right, manitwin run -o {dataset} does what is open again" if repaired else ""
    out_console.print(f"{states}: {verdict}{again}", markup=False)
    raise typer.Exit(4 if left else 0)
