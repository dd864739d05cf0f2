"""What a person watches while twins are built: one bar, the stages at work, one line an item."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

if TYPE_CHECKING:  # what a build needs takes two CPU-seconds to import
    from manitwin.build_item import ItemResult
    from manitwin.executors.whole_items import StageStarted
    from manitwin.stages.stage import Item

STYLES = {"accepted": "green", "rejected": "yellow", "unfinished": "red"}


def title(item: Item) -> str:
    """Return a short name of an item for a person."""
    return Path(item.file).name if item.file else f"'{(item.text or '')[:40]}'"


class BuildProgress:
    """A bar on stderr where that is a terminal; a line for every finished item on stdout."""

    def __init__(self, out: Console, err: Console):
        columns = (
            BarColumn(),
            MofNCompleteColumn(),
            TimeElapsedColumn(),
            TextColumn("{task.fields[working]}", markup=False),
        )
        self._progress = Progress(*columns, console=err, disable=not err.is_terminal)
        # on one terminal, a line must go through the bar's console, or the two overwrite each other
        self._lines = self._progress.console if out.is_terminal and err.is_terminal else out
        self._task = self._progress.add_task("", total=None, working="")
        self._counts = dict.fromkeys(STYLES, 0)
        self._stages: dict[Item, str] = {}

    def __enter__(self) -> BuildProgress:
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._progress.stop()

    def start(self, total: int) -> None:
        """Begin a build of ``total`` items."""
        self._progress.update(self._task, total=total)

    def stage(self, event: StageStarted) -> None:
        """Note that an item has entered a stage."""
        self._stages[event.item] = event.stage
        self._show()

    def result(self, result: ItemResult) -> None:
        """Print what became of an item."""
        self._stages.pop(result.item, None)
        self._counts[result.status] += 1
        where = f" -> {result.folder}" if result.folder else ""
        again = " (already there)" if result.reused else ""
        card = result.folder / "card.png" if result.folder else None
        if result.status == "accepted" and card is not None:
            where = f" -> {card}"
        line = f"{result.status:<10} {title(result.item)}: {result.detail}{again}{where}"
        self._lines.print(line, style=STYLES[result.status], markup=False)
        self._progress.advance(self._task)
        self._show()

    def _show(self) -> None:
        counts = ", ".join(f"{number} {status}" for status, number in self._counts.items() if number)
        working = ", ".join(f"{title(item)}: {stage}" for item, stage in list(self._stages.items())[:4])
        self._progress.update(self._task, working=" | ".join(filter(None, (counts, working))))
