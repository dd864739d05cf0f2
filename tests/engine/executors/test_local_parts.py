"""What a long stage says of itself reaches whoever watches the run."""

from __future__ import annotations

from pathlib import Path

import pytest

from manitwin.config import RunConfig
from manitwin.engine.drive import drive
from manitwin.engine.events import Announcer, StageAdvanced, StageEnded, StageEvent, StageStarted
from manitwin.engine.executors.local import LocalExecutor
from manitwin.engine.executors.stage_progress import read_notes, write_progress_notes
from manitwin.engine.flight import Flight
from manitwin.engine.jobs import Failure, RunStage, WorkerSetup
from manitwin.engine.stage import StagePart, progress_listener, report_progress
from manitwin.engine.task import Task
from manitwin.pipeline.item import Item
from manitwin.twin.dataset_root import DatasetRoot
from rehearsal_recipe import RehearsalRecipe


def test_a_run_tells_what_part_of_a_stage_is_done_while_it_runs(tmp_path: Path) -> None:
    go_on = tmp_path / "go_on"
    events: list[StageEvent] = []

    def heard(event: StageEvent) -> None:
        events.append(event)
        if isinstance(event, StageAdvanced):
            go_on.touch()  # nothing else lets the stage end

    item = Item(file=None, text=f"parts:b:{go_on}")
    report = drive(
        RehearsalRecipe(), [item], DatasetRoot(tmp_path / "data"), RunConfig(cpu=1), configuration={}, on_stage=heard
    )
    assert report.counts["accepted"] == 1
    of_b = [event for event in events if event.stage == "b"]
    assert isinstance(of_b[0], StageStarted) and isinstance(of_b[-1], StageEnded)
    assert of_b[1:-1] and set(of_b[1:-1]) == {StageAdvanced(of_b[0].task, "b", StagePart(1, 2, "things"))}


def test_parts_of_a_worker_that_took_too_long_are_forgotten(tmp_path: Path) -> None:
    job = RunStage(Task(1, Item(file=None, text="hang:a"), "0" * 32), "text", 0, "a", "cpu", ())
    setup = WorkerSetup(str(tmp_path), RehearsalRecipe(), tmp_path, False)
    with LocalExecutor(setup, RunConfig(cpu=1, stage_timeout_s=1)) as executor:
        notes = Path(executor._stacks.name)
        (notes / "7.part").write_text('[1, 2, "things"]')  # what its worker cannot remove as it is killed
        assert read_notes(notes) == {7: StagePart(1, 2, "things")}
        executor.submit(7, job)
        while not (ended := executor.ended(1.0)):
            pass
        ((_, reply),) = ended
        assert isinstance(reply, Failure) and reply.kind == "timeout"
        assert read_notes(notes) == {}


def test_parts_count_for_the_attempt_that_says_them(tmp_path: Path) -> None:
    heard: list[StageEvent] = []
    announcer = Announcer(heard.append, lambda event: None)
    item = Item(file=None, text="thing")
    again = Flight(Task(1, item), {"input": 1})
    announcer.stages_advanced({4: StagePart(1, 2, "things"), 5: StagePart(0, 2, "things")}, {5: again, 6: None})
    assert heard == [StageAdvanced(again.task, "input", StagePart(0, 2, "things"))]


def test_a_note_that_cannot_be_written_does_not_end_the_stage(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    gone = tmp_path / "gone"
    done = []
    for ticket in (1, 2):
        with write_progress_notes(gone, ticket):
            report_progress(1, 2, "things")
            done.append(ticket)
    assert done == [1, 2]
    assert len([record for record in caplog.records if "not shown" in record.message]) == 1, "it is said once"


def test_parts_are_heard_only_where_somebody_listens() -> None:
    heard: list[StagePart] = []
    report_progress(1, 3, "frames")
    with progress_listener(heard.append):
        report_progress(2, 3, "frames")
    report_progress(3, 3, "frames")
    assert heard == [StagePart(2, 3, "frames")]
