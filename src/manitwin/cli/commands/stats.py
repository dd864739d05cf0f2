"""``manitwin stats``: the tables and figures of a data set as one page."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from manitwin.cli import options
from manitwin.cli.console import out_console, print_layout_notice


def stats(
    dataset: Annotated[
        str,
        options.existing_path_argument(
            "A data set (a folder or URL), or a folder of episodes.",
            "DATASET|EPISODES",
            "the folder or URL of a data set",
        ),
    ],
    out: Annotated[Path | None, options.output_folder("The folder to write into; default: DATASET/statistics.")] = None,
) -> None:
    """Write the statistics of a data set or of episodes: a page, its figures, and every number with its SQL query."""
    from manitwin.api import write_statistics
    from manitwin.twin.dataset_root import DatasetRoot

    print_layout_notice(DatasetRoot(dataset))
    written = write_statistics(dataset, out)
    if written.text:
        out_console.print(written.text, paragraph=True)
        out_console.print(written.page)
    else:
        out_console.print(f"{written.summary}: {written.page}")
