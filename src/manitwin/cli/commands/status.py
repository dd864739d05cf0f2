"""``manitwin status``: how far a data set is, and why an item ended as it did."""

from __future__ import annotations

import time
from contextlib import suppress
from datetime import timedelta
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from manitwin.cli.console import out_console
from manitwin.cli.documents import Json, print_document

if TYPE_CHECKING:
    from rich.console import RenderableType

    from manitwin.cli.causes import Cause
    from manitwin.engine.ledger.progress import ItemStory, Progress

REFRESH_S = 2.0
MOST_CAUSES = 10


def status(
    dataset: Annotated[str, typer.Argument(help="A data set: a folder or URL.", metavar="DATASET")],
    watch: Annotated[bool, typer.Option("--watch", help="Refresh every two seconds, until Ctrl-C.")] = False,
    why: Annotated[
        str | None,
        typer.Option(help="Explain one item, given its number, twin id or part of its file name.", metavar="ITEM"),
    ] = None,
    json: Json = False,
) -> None:
    """Show the progress of a data set: stages, speed, remaining work, cost, and rejections with their reasons."""
    from manitwin.errors import UsageError

    if json and watch:
        raise UsageError("--json and --watch cannot be combined; give only one")
    from manitwin.cli.causes import group_causes
    from manitwin.cli.documents import status_document, story_document
    from manitwin.engine.ledger.location import local_ledger
    from manitwin.engine.ledger.lock import is_written
    from manitwin.engine.ledger.progress import read_progress, read_story, read_unaccepted
    from manitwin.engine.ledger.reading import read_ledger
    from manitwin.pipeline.stage_order import place_in_pipeline
    from manitwin.twin.dataset_root import DatasetRoot

    path = local_ledger(DatasetRoot(dataset))
    if watch:
        _watch(path)
        return
    with read_ledger(path) as ledger:
        if why is not None:
            story = read_story(ledger, why)
            if json:
                print_document(story_document(story, dataset))
            else:
                _print_story(story)
        elif json:
            progress = read_progress(ledger, is_written(path), place_in_pipeline)
            print_document(status_document(progress, dataset, group_causes(read_unaccepted(ledger))))
        else:
            out_console.print(_view(read_progress(ledger, is_written(path), place_in_pipeline)))
            _print_causes(group_causes(read_unaccepted(ledger)), dataset)


def _watch(path: Path) -> None:
    """Show a ledger anew every two seconds, until interrupted."""
    from rich.live import Live

    from manitwin.engine.ledger.lock import is_written
    from manitwin.engine.ledger.progress import read_progress
    from manitwin.engine.ledger.reading import read_ledger
    from manitwin.pipeline.stage_order import place_in_pipeline

    def view() -> RenderableType:
        with read_ledger(path) as ledger:
            return _view(read_progress(ledger, is_written(path), place_in_pipeline))

    with (
        suppress(KeyboardInterrupt),  # how a watch is meant to end
        Live(view(), console=out_console, auto_refresh=False) as live,
    ):
        while True:
            time.sleep(REFRESH_S)
            live.update(view(), refresh=True)


def _print_causes(causes: list[Cause], dataset: str) -> None:
    """Print every cause: how many it ended, one of them, and what to do."""
    for cause in causes[:MOST_CAUSES]:
        code = f" {cause.reason}" if cause.state == "rejected" else ""
        out_console.print(f"{cause.count} {cause.state}{code}, such as item {cause.example}: {cause.message}")
        if cause.remedy:
            out_console.print(f"  remedy: {cause.remedy}")
    if len(causes) > MOST_CAUSES:
        out_console.print(f"and {len(causes) - MOST_CAUSES} more causes")
    if any(cause.state == "failed" for cause in causes):
        out_console.print(f"`manitwin retry {dataset}` reopens the failed items")
    if causes:
        out_console.print(f"`manitwin status {dataset} --why {causes[0].example}` shows all details of one item")


def _view(progress: Progress) -> RenderableType:
    from rich.console import Group
    from rich.table import Table
    from rich.text import Text

    table = Table(box=None, pad_edge=False, header_style="bold")
    table.add_column("stage")
    for title in ("done", "running", "waiting", "rejected", "failed", "s", "CPU-s", "USD"):
        table.add_column(title, justify="right")
    for stage in progress.stages:
        counts = (stage.done, stage.running, stage.waiting, stage.rejected, stage.failed)
        table.add_row(
            stage.stage, *(str(count or "") for count in counts), f"{stage.mean_seconds:.2f}",
            f"{stage.mean_cpu_seconds:.2f}", f"{stage.cost_usd:.2f}" if stage.cost_usd else "",
        )  # fmt: skip
    total = sum(progress.items.values())
    ended = total - progress.items["open"]
    lines = [
        f"{ended} of {total} items ended: "
        + (", ".join(f"{n} {state}" for state, n in progress.items.items() if n and state != "open") or "none"),
        f"last run: {progress.last_run}",
    ]
    if progress.of_another_recipe:
        lines.append(
            f"{progress.of_another_recipe} of these ended with another version of manitwin, or with other settings, than the"
            " last run had"
        )
    if progress.items_per_hour:
        left = f", {timedelta(seconds=round(progress.left_s or 0))} left" if progress.items["open"] else ""
        lines.append(f"{progress.items_per_hour:.0f} items an hour{left}")
    lines.append(f"{progress.cpu_seconds / 3600:.2f} CPU hours, {progress.cost_usd:.2f} USD")
    for title, reasons in (("rejected", progress.rejected_by_reason), ("failed", progress.failed_by_reason)):
        if reasons:
            lines.append(f"{title}: " + ", ".join(f"{count} {reason}" for reason, count in reasons.items()))
    return Group(table, Text("\n".join(lines)))


def _print_story(story: ItemStory) -> None:
    from manitwin.engine.ledger.progress import describe_payload

    lines = [
        f"item {story.number}: {describe_payload(story.item)}",
        f"twin {story.twin_id or 'unknown yet'}, {story.state}"
        + (f" ({story.reason})" if story.reason else "")
        + (f": {story.detail}" if story.detail else ""),
    ]
    for row in story.stages:
        tries = f", attempt {row.attempts}" if row.attempts > 1 else ""
        cost = f", {row.seconds:.2f} s, {row.cpu_seconds:.2f} CPU-s" if row.seconds else ""
        cost += f", {row.cost_usd:.4f} USD" if row.cost_usd else ""
        error = f": {row.error}" if row.error else ""
        lines.append(f"  {row.stage:<16} {row.state:<9} {row.key or '':<24}{cost}{tries}{error}")
    for line in lines:
        out_console.print(line)
