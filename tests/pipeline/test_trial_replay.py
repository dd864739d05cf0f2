"""A twin's grasp that is tried again: as its record says, or not at all."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from grasped_twins import write_brick
from manitwin.errors import UsageError
from manitwin.pipeline.trial_replay import replay_trial
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.store import RECORD, write_twin_record


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return tmp_path / twin_name(write_brick(tmp_path, 0))


def change(folder: Path, how: Callable[[dict[str, Any]], None]) -> None:
    record = json.loads((folder / RECORD).read_bytes())
    how(record)
    del record["revision"], record["files"]
    write_twin_record(folder, record)


def test_a_grasp_that_held_holds_again_with_what_the_record_says(folder: Path) -> None:
    replayed = replay_trial(Twin(folder), "panda", "panda-0000")
    assert replayed.recording.result.outcome == replayed.recorded_outcome == "held" and replayed.engine == "sapien"
    first = pq.read_table(folder / "grasps.parquet")["position_m"][0].as_py()
    assert replayed.gripper_to_object[:3, 3].tolist() == pytest.approx(first)

    change(folder, lambda record: record["physical"]["mass_kg"].update(value=30.0, high=40.0))
    heavy = replay_trial(Twin(folder), "panda", "panda-0000")
    assert (heavy.recording.result.outcome, heavy.recorded_outcome) == ("drops", "held")


def test_what_the_first_engine_holds_and_the_confirming_one_refused_is_played_in_that_one(folder: Path) -> None:
    table = pq.read_table(folder / "grasps.parquet")
    outcomes = ["slips", *table["outcome"].to_pylist()[1:]]
    place = table.schema.get_field_index("outcome")
    pq.write_table(table.set_column(place, table.schema.field(place), [outcomes]), folder / "grasps.parquet")
    change(folder, lambda record: record["grasps"]["trial"].update(confirmed_by=None))
    assert replay_trial(Twin(folder), "panda", "panda-0000").engine == "sapien", "none had to confirm it"
    change(folder, lambda record: record["grasps"]["trial"].update(confirmed_by="mujoco"))
    assert replay_trial(Twin(folder), "panda", "panda-0000").engine == "mujoco"
    assert replay_trial(Twin(folder), "panda", "panda-0001").engine == "sapien"


@pytest.mark.parametrize(
    ("gripper", "grasp", "said"),
    [
        ("panda", "panda-9999", "no grasp of this name"),
        ("wsg50_110", "panda-0000", "no grasps for a gripper of this name"),
        ("../panda.toml", "panda-0000", "no grasps for a gripper of this name"),
    ],
)
def test_what_is_not_there_is_said(folder: Path, gripper: str, grasp: str, said: str) -> None:
    with pytest.raises(UsageError, match=said):
        replay_trial(Twin(folder), gripper, grasp)


@pytest.mark.parametrize(
    ("how", "said"),
    [
        (lambda grasps: grasps.update(gripper_sha256="0" * 64), "differs from the one of the trial"),
        (lambda grasps: grasps.update(gripper="mine"), "is not shipped with the package"),
        (lambda grasps: grasps["trial"].update(engine="other"), "engine other"),
        (lambda grasps: grasps["trial"].update(timestep_s=-1.0), r"grasps\.trial\.timestep_s"),
    ],
)
def test_a_trial_that_cannot_be_repeated_is_said(
    folder: Path, how: Callable[[dict[str, Any]], None], said: str
) -> None:
    change(folder, lambda record: how(record["grasps"]))
    with pytest.raises(UsageError, match=said):
        replay_trial(Twin(folder), Twin(folder).record.grasps.gripper, "panda-0000")  # type: ignore[union-attr]
