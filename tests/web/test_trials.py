"""Grasp trials for pages: what is drawn of one, and the process that tries them."""

from __future__ import annotations

import json
import os
import shutil
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from access_requests import asked

from manitwin.errors import TwinError, UsageError
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.web import trial_player
from manitwin.web.application import application
from manitwin.web.served_files import TwinFolders
from manitwin.web.trial_document import trial_document
from manitwin.web.trial_player import TrialPlayer
from rigid_boxes import as_a_whole

Viewed = tuple[Path, list[str]]


@pytest.fixture
def twin(viewed: Viewed) -> Twin:
    return Twin(viewed[0] / twin_name(viewed[1][1]))


def rows(values: list[float]) -> np.ndarray:
    return np.array(values).reshape(-1, 7)


def test_document_has_hand_object_and_boxes_at_each_state(twin: Twin, monkeypatch: pytest.MonkeyPatch) -> None:
    as_a_whole(monkeypatch)  # else the hand does not stop at the end of the lift
    told = trial_document(twin, "panda", "panda-0000")
    count = len(told["time_s"])
    assert (told["outcome"], told["recorded_outcome"]) == ("held", "held")
    assert [each["label"] for each in told["phases"]] == ["open", "close", "lift", "hold", "slide"]
    assert told["phases"][0]["first"] == 0 and told["phases"][-1]["first"] < count
    hand, thing = rows(told["hand"]), rows(told["object"])
    assert hand.shape == thing.shape == (count, 7)
    assert thing[0] == pytest.approx([0, 0, 0, 1, 0, 0, 0], abs=2e-3), "it begins in the object frame"
    lifted = told["phases"][3]["first"] - 1
    assert hand[lifted, 2] - hand[0, 2] == pytest.approx(0.2, abs=1e-4)
    assert thing[lifted, 2] == pytest.approx(0.2, abs=5e-3), "and goes up with the hand"
    moving = [rows(box["poses"]) for box in told["boxes"] if len(box["poses"]) > 7]
    assert len(moving) >= 2 and min(box[:, 0].min() for box in moving) < 0 < max(box[:, 0].max() for box in moving)
    across = max(box[-1, 0] for box in moving) - max(box[0, 0] for box in moving)
    assert across < -0.015, "the finger at +X closes from 80 to 40 mm"


def test_page_gives_a_trial_and_says_what_cannot_be_played(viewed: Viewed) -> None:
    with TrialPlayer() as player:
        app = application(None, TwinFolders(str(viewed[0] / twin_name(viewed[1][1]))), "one", player)

        def get(query: str) -> tuple[int, str]:
            messages = asked(app, f"/twin/{viewed[1][1]}/trial.json?{query}")
            return messages[0]["status"], b"".join(each.get("body", b"") for each in messages[1:]).decode()

        status, body = get("gripper=panda&grasp=panda-0000")
        assert status == 200 and json.loads(body)["grasp_id"] == "panda-0000"
        assert get("gripper=panda&grasp=panda-0000")[1] == body
        assert get("gripper=panda&grasp=no")[0] == 404 and "no grasp of this name" in get("gripper=panda&grasp=no")[1]
        assert get("")[0] == 404


def test_a_process_that_ends_or_hangs_costs_its_trial_and_nothing_else(
    twin: Twin, monkeypatch: pytest.MonkeyPatch
) -> None:
    with TrialPlayer() as player:
        first = player.play(twin, "panda", "panda-0000")
        ended: dict[int, Any] = dict(player._pool._processes)  # type: ignore[union-attr]
        for number in ended:
            os.kill(number, signal.SIGKILL)
        with pytest.raises(TwinError, match="ended its process"):
            player.play(twin, "panda", "panda-0001")
        assert player.play(twin, "panda", "panda-0000") is first, "what was played is kept"
        assert json.loads(player.play(twin, "panda", "panda-0001"))["outcome"] == "held"
        monkeypatch.setattr(trial_player, "LONGEST_S", 0.0)
        with pytest.raises(TwinError, match="more than 0 s"):
            player.play(twin, "panda", "panda-0002")
        with pytest.raises(UsageError):
            monkeypatch.undo()
            player.play(twin, "panda", "no")


def test_an_altered_twin_is_said_and_ends_no_process(viewed: Viewed, tmp_path: Path) -> None:
    folder = Path(shutil.copytree(viewed[0] / twin_name(viewed[1][1]), tmp_path / "twin"))
    (folder / "collision" / "hull_00.obj").rename(tmp_path / "hull.obj")
    (folder / "collision" / "hull_00.obj").write_text("v nonsense\n")
    with TrialPlayer() as player:
        with pytest.raises(TwinError, match="not a readable hull"):
            player.play(Twin(folder), "panda", "panda-0000")
        (tmp_path / "hull.obj").replace(folder / "collision" / "hull_00.obj")
        table = pq.read_table(folder / "grasps.parquet")
        place = table.schema.get_field_index("quaternion_wxyz")
        flat = pa.array([[0.0] * 4] * len(table), table.schema.field(place).type)
        pq.write_table(table.set_column(place, table.schema.field(place), flat), folder / "grasps.parquet")
        with pytest.raises(TwinError, match=r"cannot be run \(ValueError"):
            player.play(Twin(folder), "panda", "panda-0000")
        assert len(player._pool._processes) == 1  # type: ignore[union-attr]
