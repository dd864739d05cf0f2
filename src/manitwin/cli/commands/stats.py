"""``manitwin stats``: the tables and figures of a data set as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from manitwin.cli import choices
from manitwin.cli.console import note_old_layout, out_console


def stats(
    dataset: Annotated[
        str,
        typer.Argument(
            help="A data set (a folder or URL), or a folder of episodes.",
            metavar="DATASET|EPISODES",
            callback=choices.must_exist("the folder or URL of a data set"),
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            "-o",
            help="The folder to write into; default: DATASET/statistics.",
            callback=choices.folder_to_write,
        ),
    ] = None,
) -> None:
    """Write the statistics of a data set, or of episodes: a page, its figures, and its numbers with the SQL of each."""
    from manitwin.dataset.statistics.report import write_dataset_report
    from manitwin.episodes.attempts import ATTEMPTS
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    note_old_layout(root)
    if root.local is not None and root.exists(ATTEMPTS):
        from manitwin.episodes.statistics.report import episode_statistics

        report = episode_statistics(root.local)
        out_console.print(report.text(), markup=False, soft_wrap=True)
        out_console.print(str(report.write(out or root.local / "statistics")), markup=False)
        return
    written = write_dataset_report(root, out)
    out_console.print(f"{written.summary}: {written.page}", markup=False)
