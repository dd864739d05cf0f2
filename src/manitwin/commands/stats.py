"""``manitwin stats``: the tables and figures of a data set as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.commands.console import out_console


def stats(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The folder to write into; default: DATASET/statistics.")
    ] = None,
) -> None:
    """Write a data set's statistics: a page to read, its figures, and its numbers with the SQL that gives each."""
    from manitwin.dataset_root import DatasetRoot
    from manitwin.statistics.of_dataset import write_statistics

    written = write_statistics(DatasetRoot(dataset), out)
    out_console.print(f"{written.summary}: {written.page}", markup=False)
