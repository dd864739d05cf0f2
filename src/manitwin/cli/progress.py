"""Show the progress of a run: how many of how many, what became of them, the stages at work, the time left."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

from rich.console import Console
from rich.live import Live
from rich.progress_bar import ProgressBar
from rich.table import Table

from manitwin.cli.console import err_console, escape_cell_text, out_console
from manitwin.cli.run_log import open_run_log
from manitwin.engine.events import ItemEnded, StageAdvanced, StageEnded, StageEvent, StageStarted
from manitwin.engine.ledger.location import local_log
from manitwin.engine.stage import StagePart
from manitwin.engine.task import Payload
from manitwin.formats.plurals import counted
from manitwin.twin.dataset_root import DatasetRoot

if TYPE_CHECKING:
    from manitwin.engine.drive import RunOptions

LINE_EVERY_S = 30.0
"""Between two lines where nobody looks at a terminal."""
WAITS_EVERY_S = 120.0
"""Between two lines on a service that does not answer."""
RUN_LATER = "; run again later"
"""The remedy of a service's errors, which is none while the run itself asks again."""
ENOUGH, ENOUGH_OF_PARTS = 3, 0.1
"""Items must have ended before anything is said of the time that is left; long ones that say what they have done count by it."""
BAR_WIDTH = 24


class RunProgress:
    """The state of a run, from its events, which may come from several threads.

    ``what`` names the items in the plural. ``clock`` gives seconds. ``preparing`` says how far a run is that has not begun.
    """

    def __init__(
        self,
        what: str = "items",
        clock: Callable[[], float] = time.monotonic,
        preparing: Callable[[], str] = lambda: "",
    ):
        self.what, self._clock, self._preparing = what, clock, preparing
        self._lock = threading.Lock()
        self.total = self.before = 0
        self.counts: Counter[str] = Counter()
        self._found = 0
        self._under_way: dict[Payload, str] = {}
        self._ended: set[int] = set()  # hashes of the payloads: 100,000 items would take ten times the memory
        self._parts: dict[Payload, StagePart] = {}
        self._started_at: float | None = None

    @property
    def done(self) -> int:
        """The number of items that have ended, in this run or before."""
        return self.before + self.counts.total()

    @property
    def fractional_done(self) -> float:
        """The number of items that are done in parts: two at a half are one."""
        with self._lock:
            return sum(part.done / part.total for part in self._parts.values() if part.total)

    def start(self, total: int, opened: int | None = None) -> None:
        """Begin a run of ``total`` items of which ``opened`` are to be done (None: all)."""
        self.total, self.before = total, 0 if opened is None else total - opened
        self._started_at = self._clock()

    def stage(self, event: StageEvent) -> None:
        """Note that a stage of an item began or ended; of one that has ended, a worker's word may come late."""
        with self._lock:
            if hash(event.task.payload) in self._ended:
                return
            if isinstance(event, StageStarted):
                self._under_way[event.task.payload] = event.stage
            elif isinstance(event, StageAdvanced):
                self._parts[event.task.payload] = event.part
            elif isinstance(event, StageEnded):
                self._forget(event.task.payload)

    def record_ended(self, payload: Payload, state: str, found: bool = False) -> None:
        """Note what became of an item; one that was ``found`` finished says nothing of how long others take."""
        with self._lock:
            self._forget(payload)
            self._ended.add(hash(payload))
            self.counts[state] += 1
            self._found += found

    def item_ended(self, event: ItemEnded) -> None:
        """Note the event of an engine's run."""
        self.record_ended(event.task.payload, event.state, event.found)

    def remaining_s(self) -> float | None:
        """Return about how many seconds are left at the rate until now; None until three items were worked on.

        A tenth of an item is enough where items say what part of them is done.
        """
        parts = self.fractional_done
        worked = self.counts.total() - self._found + parts
        if self._started_at is None or worked < (ENOUGH_OF_PARTS if parts else ENOUGH):
            return None
        return (self._clock() - self._started_at) / worked * max(0.0, self.total - self.done - parts)

    def _forget(self, payload: Payload) -> None:
        self._under_way.pop(payload, None)
        self._parts.pop(payload, None)

    def _stages(self) -> str:
        stages = Counter(self._under_way.values())
        said = ", ".join(f"{number} {stage}" for stage, number in stages.most_common())
        done: Counter[str] = Counter()
        total: Counter[str] = Counter()
        for part in self._parts.values():
            done[part.unit] += part.done
            total[part.unit] += part.total
        parts = ", ".join(f"{done[unit]} of {total[unit]} {unit}" for unit in total)
        return f"under way: {said}" + (f" ({parts})" if parts else "") if said else ""

    def line(self) -> str:
        """Return all of it in one line."""
        if self._started_at is None:
            return ": ".join(filter(None, ("preparing", self._preparing())))
        with self._lock:
            counts = ", ".join(f"{number} {state}" for state, number in self.counts.items())
            stages = self._stages()
        left_s = self.remaining_s()
        left = f"about {duration(left_s)} left" if left_s is not None and self.done < self.total else ""
        parts = (f"{self.done} of {self.total} {self.what}", left, counts, stages)
        return "; ".join(filter(None, parts))


def duration(seconds: float) -> str:
    """Return a time for a person: no more exact than it is worth."""
    if seconds < 60:
        return f"{max(1, round(seconds))} s"
    minutes = round(seconds / 60)
    return f"{minutes} min" if minutes < 60 else f"{minutes // 60} h {minutes % 60} min"


class WaitNotices:
    """Prints which stages wait and why: each at once, and from time to time how long a service that is down is still asked."""

    def __init__(self, err: Console, clock: Callable[[], float] = time.monotonic):
        self._err, self._clock = err, clock
        self._told_at: dict[str, float] = {}

    def stage(self, event: StageEvent) -> None:
        """Print a line where an event is of a stage that waits, unless the like was printed a short while ago.

        What failed by an error that nobody expected is tried again at once, and waits for nothing.
        """
        if not isinstance(event, StageEnded) or event.state != "waiting" or event.trace:
            return
        now = self._clock()
        told = event.stage in self._told_at
        # one service has several stages waiting: a line on any of them is news of all
        if told and (not event.given_up_in_s or now - max(self._told_at.values()) < WAITS_EVERY_S):
            return
        self._told_at[event.stage] = now
        said = f"{event.stage} {'still waits' if told else 'waits'}: {event.detail}"
        if event.given_up_in_s:
            said = (
                f"{said.removesuffix(RUN_LATER)}; retried for another {duration(event.given_up_in_s)} (run.patience_s), "
                "then left to the next run. Ctrl-C stops at once; rerun the same command to resume"
            )
        self._err.print(said, markup=False)


class ShownProgress:
    """Show a run's progress on a console while the ``with`` statement lasts.

    On a terminal one line is kept up to date below all that is printed; elsewhere a line with the time (UTC) is printed every
    ``every_s`` seconds. ``out``: the console that other lines go to; on one terminal they may not overwrite each other.
    """

    def __init__(self, progress: RunProgress, out: Console, err: Console, every_s: float = LINE_EVERY_S):
        self.progress = progress
        self._err, self._every_s = err, every_s
        self._live: Live | None = None
        self._stop = threading.Event()
        self._lines: threading.Thread | None = None
        if err.quiet:
            return
        if err.is_terminal and not err.is_dumb_terminal:  # a dumb one cannot take a line back
            self._live = Live(
                console=err,
                get_renderable=self._bar,
                transient=True,
                redirect_stdout=out.is_terminal,
                redirect_stderr=True,
            )
        else:
            self._lines = threading.Thread(target=self._print_lines, name="manitwin-progress", daemon=True)

    def __enter__(self) -> Self:
        if self._live is not None:
            self._live.start()
        if self._lines is not None:
            self._lines.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._stop.set()
        if self._live is not None:
            self._live.stop()
        if self._lines is not None and self._lines.is_alive():
            self._lines.join()

    def _bar(self) -> Table:
        table = Table.grid(padding=(0, 1))
        table.add_column(width=BAR_WIDTH)
        table.add_column(no_wrap=True, overflow="ellipsis")
        total = self.progress.total or None
        table.add_row(
            ProgressBar(total, self.progress.done + self.progress.fractional_done, width=BAR_WIDTH),
            escape_cell_text(self.progress.line()),
        )
        return table

    def _print_lines(self) -> None:
        while not self._stop.wait(self._every_s):
            now = datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%SZ")
            self._err.print(f"{now} {self.progress.line()}", markup=False)


class RunDisplay(ShownProgress):
    """The progress of a run below ``place`` on the consoles of this command; its log lies there unless ``--log`` says otherwise.

    ``what`` names the items in the plural; ``preparing`` says how far the run is that has not begun.
    """

    def __init__(self, what: str, place: str | Path, preparing: Callable[[], str] = lambda: ""):
        super().__init__(RunProgress(what, preparing=preparing), out_console, err_console)
        self._place = place
        self._waits = WaitNotices(err_console)

    @property
    def callbacks(self) -> RunOptions:
        """The callbacks of a run that is shown."""
        return {"on_start": self.start, "on_stage": self.stage, "on_ended": self.progress.item_ended}

    def stage(self, event: StageEvent) -> None:
        """Note the event of a stage, and tell where it waits."""
        self.progress.stage(event)
        self._waits.stage(event)

    def start(self, total: int, opened: int) -> None:
        """Begin a run, and its log: what was refused before leaves none behind."""
        open_run_log(local_log(DatasetRoot(self._place)))
        self.progress.start(total, opened)
        out_console.print(f"{counted(total, self.progress.what)}, {opened:,} to do", markup=False)
