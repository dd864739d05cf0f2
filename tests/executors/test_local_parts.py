"""What a long stage says of itself reaches whoever watches the run."""

from __future__ import annotations

from pathlib import Path

from manitwin.config import RunConfig
from manitwin.dataset_root import DatasetRoot
from manitwin.dataset_run import drive
from manitwin.engine.events import StageAdvanced, StageEnded, StageEvent, StageStarted
from manitwin.engine.rehearsal import RehearsalRecipe
from manitwin.stages.stage import Item
from manitwin.stages.stage_parts import StagePart, heard_by, tell_part


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
    assert of_b[1:-1] and set(of_b[1:-1]) == {StageAdvanced(item, "b", StagePart(1, 2, "things"))}


def test_parts_are_heard_only_where_somebody_listens() -> None:
    heard: list[StagePart] = []
    tell_part(1, 3, "frames")
    with heard_by(heard.append):
        tell_part(2, 3, "frames")
    tell_part(3, 3, "frames")
    assert heard == [StagePart(2, 3, "frames")]
