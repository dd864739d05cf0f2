"""Every stage that begins is told to end, also where a worker dies in it."""

from __future__ import annotations

import multiprocessing
import queue
import threading
from pathlib import Path

import pytest
import trimesh

from manitwin.config import BuildConfig
from manitwin.engine.events import StageEnded, StageEvent, StageStarted
from manitwin.engine.task import Task
from manitwin.errors import BadReply, Unavailable
from manitwin.pipeline import build_item as module
from manitwin.pipeline.build_item import build_item
from manitwin.pipeline.item import Item
from manitwin.pipeline.whole_items import _CutOff, _listen, build_all


@pytest.fixture
def box(tmp_path: Path) -> Item:
    path = tmp_path / "box.glb"
    trimesh.creation.box((0.04, 0.05, 0.06)).export(path)
    return Item(file=str(path), text=None)


@pytest.mark.parametrize(
    ("error", "state", "traced"),
    [
        (Unavailable("the service is down"), "waiting", False),
        (OSError(28, "No space left on device"), "waiting", True),
        (BadReply("it sent no mesh"), "failed", False),
        (RuntimeError("a defect"), "failed", True),
    ],
)
def test_a_stage_that_raises_is_told_to_have_ended(
    tmp_path: Path, box: Item, monkeypatch: pytest.MonkeyPatch, error: Exception, state: str, traced: bool
) -> None:
    def refuse(*given: object) -> None:
        raise error

    monkeypatch.setattr(module, "run_stage", refuse)
    events: list[StageEvent] = []
    result = build_item(box, tmp_path / "out", BuildConfig(), events.append)
    begun, ended = events
    assert result.status == "unfinished"
    assert isinstance(begun, StageStarted) and isinstance(ended, StageEnded) and ended.stage == begun.stage
    assert ended.state == state and str(error) in ended.detail and bool(ended.trace) is traced
    assert ended.task.item_id == result.twin_id


def test_a_worker_that_dies_ends_its_stage(tmp_path: Path, box: Item) -> None:
    events: list[StageEvent] = []

    def kill(event: StageEvent) -> None:
        events.append(event)
        if isinstance(event, StageStarted):
            for child in multiprocessing.active_children():
                child.kill()

    (result,) = build_all([box], tmp_path / "out", BuildConfig(), jobs=1, on_stage=kill)
    last = events[-1]
    assert result.status == "unfinished" and "died" in result.detail
    assert isinstance(last, StageEnded) and last.state == "failed" and "died" in last.detail
    assert last.stage == [event for event in events if isinstance(event, StageStarted)][-1].stage


def test_what_was_said_before_the_end_is_heard(box: Item) -> None:
    events: queue.Queue[object] = queue.Queue()
    heard: list[StageEvent] = []
    events.put(StageStarted(Task(0, box), "views"))
    events.put(_CutOff(box, "failed", "it died"))
    events.put(_CutOff(box, "failed", "nothing was under way"))
    stop = threading.Event()
    stop.set()
    _listen(events, heard.append, stop)
    assert heard == [StageStarted(Task(0, box), "views"), StageEnded(Task(0, box), "views", "failed", detail="it died")]
