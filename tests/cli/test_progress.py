"""What is said of a run while it works: numbers, stages at work, and the time left once it can be known."""

from __future__ import annotations

import io
import re
import threading

from rich.console import Console

from manitwin.cli.progress import RunProgress, ShownProgress, WaitNotices, duration
from manitwin.engine.events import ItemEnded, StageAdvanced, StageEnded, StageStarted
from manitwin.engine.stage import StagePart
from manitwin.engine.task import Task
from manitwin.pipeline.item import Item


class Clock:
    def __init__(self) -> None:
        self.now_s = 0.0

    def __call__(self) -> float:
        return self.now_s


def task(number: int) -> Task[Item]:
    return Task(number, Item(file=None, text=f"thing {number}"), f"{number:04d}")


def ended(number: int, state: str = "accepted", found: bool = False) -> ItemEnded:
    return ItemEnded(task(number), state, "", found)  # type: ignore[arg-type]


def test_line_counts_what_ended_and_names_the_stages_at_work() -> None:
    progress = RunProgress("batches", Clock())
    assert progress.line() == "preparing"
    progress.start(10, 8)
    for number in (1, 2, 3):
        progress.stage(StageStarted(task(number), "films"))
    progress.stage(StageEnded(task(3), "films", "done", 1.0))
    progress.item_ended(ended(3, "rejected"))
    progress.stage(StageStarted(task(4), "assemble"))
    assert progress.line() == "3 of 10 batches; 1 rejected; under way: 2 films, 1 assemble"


def test_what_is_prepared_is_said_until_the_run_begins() -> None:
    said = iter(["", "7 files found in scans"])
    progress = RunProgress("inputs", Clock(), lambda: next(said))
    assert [progress.line(), progress.line()] == ["preparing", "preparing: 7 files found in scans"]
    progress.start(3)
    assert progress.line() == "0 of 3 inputs"


def test_time_left_is_that_of_the_rate_and_said_only_after_three_items() -> None:
    clock = Clock()
    progress = RunProgress("items", clock)
    progress.start(10)
    for number in range(3):
        assert progress.remaining_s() is None and "left" not in progress.line()
        clock.now_s += 100.0
        progress.item_ended(ended(number))
    assert progress.remaining_s() == 7 * 100.0
    assert progress.line() == "3 of 10 items; about 12 min left; 3 accepted"


def test_long_stages_count_by_what_they_have_done() -> None:
    clock = Clock()
    progress = RunProgress("batches", clock)
    progress.start(4)
    progress.stage(StageStarted(task(0), "films"))
    clock.now_s = 60.0
    progress.stage(StageAdvanced(task(0), "films", StagePart(40, 800, "frames")))
    assert progress.remaining_s() is None, "a twentieth of one item is too little to go by"
    clock.now_s = 120.0
    progress.stage(StageAdvanced(task(0), "films", StagePart(400, 800, "frames")))
    assert progress.remaining_s() == 120.0 / 0.5 * 3.5
    assert progress.line() == "0 of 4 batches; about 14 min left; under way: 1 films (400 of 800 frames)"
    progress.item_ended(ended(0))
    assert "frames" not in progress.line()


def test_what_is_heard_of_an_item_after_its_end_is_ignored() -> None:
    progress = RunProgress("items", Clock())
    progress.start(2)
    progress.stage(StageStarted(task(0), "views"))
    progress.item_ended(ended(0, "failed"))
    progress.stage(StageStarted(task(0), "views"))
    progress.stage(StageAdvanced(task(0), "views", StagePart(1, 2, "pictures")))
    assert progress.line() == "1 of 2 items; 1 failed" and progress.fractional_done == 0
    progress.stage(StageStarted(task(1), "views"))
    assert progress.line() == "1 of 2 items; 1 failed; under way: 1 views"


def test_items_that_were_there_already_do_not_make_the_others_quicker() -> None:
    clock = Clock()
    progress = RunProgress("items", clock)
    progress.start(1000)
    for number in range(900):
        progress.item_ended(ended(number, found=True))
    assert progress.remaining_s() is None
    for number in range(900, 904):
        clock.now_s += 50.0
        progress.item_ended(ended(number))
    assert progress.remaining_s() == 96 * 50.0


def test_durations_are_no_more_exact_than_they_are_worth() -> None:
    assert [duration(s) for s in (0.2, 59, 61, 3599, 3600, 12000)] == [
        "1 s",
        "59 s",
        "1 min",
        "1 h 0 min",
        "1 h 0 min",
        "3 h 20 min",
    ]


class Lines(io.StringIO):
    """A stream that tells when a line was written."""

    def __init__(self) -> None:
        super().__init__()
        self.written = threading.Event()

    def write(self, text: str) -> int:
        count = super().write(text)
        if "\n" in text:
            self.written.set()
        return count


def test_without_a_terminal_a_plain_line_with_the_time_is_printed_again_and_again() -> None:
    stream, progress = Lines(), RunProgress("items")
    err = Console(file=stream, soft_wrap=True, highlight=False)
    with ShownProgress(progress, Console(file=io.StringIO()), err, every_s=0.001):
        progress.start(5)
        progress.item_ended(ended(1))
        for _ in range(3):
            stream.written.clear()
            assert stream.written.wait(60)
    lines = stream.getvalue().splitlines()
    pattern = r"20\d\d-\d\d-\d\d \d\d:\d\d:\d\dZ (preparing|\d of 5 items.*)"
    assert all(re.fullmatch(pattern, line) for line in lines), lines
    assert lines[-1].endswith("1 of 5 items; 1 accepted")


def test_on_a_terminal_one_line_is_kept_up_to_date_and_taken_away_at_the_end() -> None:
    stream, progress = io.StringIO(), RunProgress("items")
    err = Console(file=stream, force_terminal=True, width=100, _environ={"TERM": "xterm"})
    with ShownProgress(progress, Console(file=io.StringIO()), err) as shown:
        progress.start(4)
        progress.item_ended(ended(1, "rejected"))
        assert shown._live is not None
        shown._live.refresh()
        err.print("a remark")
    text = stream.getvalue()
    assert "1 of 4 items; 1 rejected" in text and "a remark" in text
    assert text.rstrip().endswith("\x1b[2K") or "\x1b[1A\x1b[2K" in text, "the line is erased"


def test_a_terminal_that_cannot_take_a_line_back_gets_plain_lines() -> None:
    err = Console(file=io.StringIO(), force_terminal=True, _environ={"TERM": "dumb"})
    with ShownProgress(RunProgress(), Console(file=io.StringIO()), err) as shown:
        assert shown._live is None and shown._lines is not None


def test_nothing_is_shown_on_a_quiet_console() -> None:
    stream = io.StringIO()
    with ShownProgress(RunProgress(), Console(file=stream), Console(file=stream, quiet=True), every_s=0.0) as shown:
        assert shown._live is None and shown._lines is None
    assert stream.getvalue() == ""


def test_what_waits_for_a_service_that_is_down_is_told_again_with_the_time_that_is_left() -> None:
    clock, out = Clock(), io.StringIO()
    waits = WaitNotices(Console(file=out, width=1000), clock)
    down = "vlm at http://host does not answer; run again later"
    for at_s in range(0, 1801, 60):
        clock.now_s = float(at_s)
        for number, stage in enumerate(("gate", "points")):
            waits.stage(StageEnded(task(number), stage, "waiting", detail=down, given_up_in_s=1800.0 - at_s))
    lines = out.getvalue().splitlines()
    assert [line.partition(":")[0] for line in lines] == ["gate waits", "points waits", *["gate still waits"] * 14]
    assert lines[0].startswith("gate waits: vlm at http://host does not answer; retried for another 30 min")
    assert lines[-1].count("retried for another 2 min (run.patience_s)") == 1 and "Ctrl-C stops" in lines[-1]
    assert "later" not in out.getvalue()


def test_what_is_only_tried_again_or_given_up_is_told_once() -> None:
    clock, out = Clock(), io.StringIO()
    waits = WaitNotices(Console(file=out, width=1000), clock)
    for _ in range(5):
        waits.stage(StageEnded(task(1), "generate", "waiting", detail="asks to wait"))
        waits.stage(StageEnded(task(1), "gate", "waiting", detail="down; run again later", given_up_in_s=0.0))
        waits.stage(StageEnded(task(1), "mesh", "done"))
        clock.now_s += 1000
    assert out.getvalue() == "generate waits: asks to wait\ngate waits: down; run again later\n"
