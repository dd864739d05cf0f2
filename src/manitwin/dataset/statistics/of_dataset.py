"""The statistics of a data set, written where they belong."""

from __future__ import annotations

import tempfile
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from manitwin.dataset.index.near_duplicates import near_duplicates
from manitwin.dataset.index.query import Index
from manitwin.dataset.statistics.report import REPORT, write_report
from manitwin.dataset.statistics.tables import Tables
from manitwin.twin.dataset_root import DatasetRoot

FOLDER = "statistics"
"""Where the report is in a data set."""


@dataclass(frozen=True)
class Written:
    """Where the page is, and its first sentence."""

    page: str
    summary: str


def write_statistics(root: DatasetRoot, out: Path | None = None) -> Written:
    """Write ``report.html``, ``statistics.json`` and ``figures/`` to a folder, by default the data set's own.

    Raises UsageError where the data set has no index.
    """
    tables = Tables.of_index(root)
    duplicates = near_duplicates(Index(root))
    title = f"Statistics of {PurePosixPath(root.path).name or root.url}"
    if out is None and root.local is None:
        with tempfile.TemporaryDirectory() as scratch:
            fresh = Path(scratch) / FOLDER
            summary = write_report(tables, fresh, title=title, duplicates=duplicates)
            root.put_folder(fresh, FOLDER)
        return Written(f"{root.url.rstrip('/')}/{FOLDER}/{REPORT}", summary)
    folder = out or Path(root.full(FOLDER))
    summary = write_report(tables, folder, title=title, duplicates=duplicates)
    return Written(str(folder / REPORT), summary)
