"""The end of a command whose items were not all accepted: why, and what to do about it."""

from __future__ import annotations

from typing import TYPE_CHECKING

from manitwin.cli.console import out_console, print_error

if TYPE_CHECKING:
    from manitwin.api import BuildReport
    from manitwin.cli.causes import Cause


def print_causes(place: str) -> None:
    """Print the most frequent causes that the ledger below a folder or URL tells of, with their remedies."""
    _print(causes_of(place), f"manitwin retry {place} and the same command again", f"manitwin status {place}")


def print_causes_of_build(report: BuildReport) -> None:
    """Print the most frequent causes of a build's report, with their remedies."""
    causes = causes_of_build(report)
    # in the one line above, which --quiet leaves out unless nothing was made
    said = len(report.results) == 1 and (not out_console.quiet or report.results[0].status == "unfinished")
    _print(causes, "the same command again", "in the lines above", skip=1 if said else 0)


def _print(causes: list[Cause], again: str, others: str, skip: int = 0) -> None:
    from manitwin.cli.causes import cause_lines

    for line in cause_lines(causes, again=again, others=others)[skip:]:
        print_error(line.strip() if skip else line)


def causes_of_build(report: BuildReport) -> list[Cause]:
    """Return why inputs of a build were not accepted, the most frequent cause first."""
    from manitwin.cli.causes import group_causes
    from manitwin.engine.ledger.unaccepted import Unaccepted

    return group_causes(
        Unaccepted(
            result.item.title,
            result.status,
            result.reason,
            f"{result.error}: {result.detail}" if result.error else result.detail,
        )
        for result in report.results
        if result.status != "accepted"
    )


def causes_of(place: str) -> list[Cause]:
    """Return why the items below a folder or URL were not accepted, the most frequent cause first."""
    from manitwin.cli.causes import group_causes
    from manitwin.engine.ledger.ledger import read_ledger
    from manitwin.engine.ledger.unaccepted import read_unaccepted
    from manitwin.pipeline.dataset_run import local_ledger
    from manitwin.twin.dataset_root import DatasetRoot

    with read_ledger(local_ledger(DatasetRoot(place))) as ledger:
        return group_causes(read_unaccepted(ledger))
