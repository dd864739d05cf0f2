"""Write and query the index and the statistics of a data set."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import duckdb

    from manitwin.dataset.index.rebuild import Rebuilt
    from manitwin.dataset.statistics.report import WrittenReport


def write_index(
    dataset: str | Path,
    *,
    jobs: int | None = None,
    on_start: Callable[[int], None] = lambda twins: None,
    on_read: Callable[[int], None] = lambda twins: None,
) -> Rebuilt:
    """Rebuild the index of a data set from its twins with ``jobs`` processes; the old index stays in use until the new one is
    done.

    ``on_start`` is called with the number of twins, ``on_read`` with the number of twins just read. Raises UsageError if there
    is no data set, and TwinError if a process dies; the old index is then unchanged.
    """
    from manitwin.dataset.index.rebuild import rebuild
    from manitwin.engine.machine_resources import available_cores
    from manitwin.twin.dataset_root import DatasetRoot

    return rebuild(DatasetRoot(dataset), jobs=jobs or available_cores(), on_start=on_start, on_read=on_read)


def write_statistics(dataset: str | Path, out: str | Path | None = None) -> WrittenReport:
    """Write the statistics of a data set, or of a folder of episodes: a page, its figures, and the numbers with their SQL
    queries.

    ``out`` None is ``statistics/`` below the data set. Raises UsageError if a data set has no index.
    """
    from manitwin.dataset.statistics.report import WrittenReport, write_dataset_report
    from manitwin.episodes.attempts import ATTEMPTS
    from manitwin.twin.dataset_root import DatasetRoot

    root = DatasetRoot(dataset)
    if root.local is None or not root.exists(ATTEMPTS):
        return write_dataset_report(root, None if out is None else Path(out))
    from manitwin.episodes.statistics.report import episode_statistics

    report = episode_statistics(root.local)
    page = report.write(Path(out or root.local / "statistics"))
    return WrittenReport(str(page), report.summary.rstrip("."), report.text())


def statistics_connection(dataset: str | Path) -> duckdb.DuckDBPyConnection:
    """Return a DuckDB connection with the index tables of a data set and the SQL macros that ``manitwin stats`` uses.

    Raises UsageError if the data set has no index.
    """
    from manitwin.dataset.statistics.query import ReportTables
    from manitwin.twin.dataset_root import DatasetRoot

    return ReportTables.of_index(DatasetRoot(dataset)).connection
