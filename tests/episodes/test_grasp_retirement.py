"""Grasps that fail end to end are found, and retired in their twins' records."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pyarrow.parquet as pq
import pytest
from synthetic_episodes import attempt

from grasped_twins import write_brick
from manitwin.dataset.review.store import REVIEWS, ReviewStore
from manitwin.dataset.review.verdicts import Review
from manitwin.episodes.retirement import find_retirements, retire_grasps
from manitwin.episodes.target_grasps import usable_grasps
from manitwin.errors import UsageError
from manitwin.robots.grippers.gripper import load_gripper, require_kind
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.dataset_root import twin_name
from manitwin.twin.loaded_twin import TwinSource
from manitwin.twin.store import read_record

KEPT = replace(attempt(0), outcome="kept", twin_id="t", grasp_id="g", transferred=False)


def test_a_grasp_is_retired_by_its_share_of_failures() -> None:
    dropped = replace(KEPT, outcome="dropped")
    assert [r.grasp_id for r in find_retirements([dropped], failed_share=1 / 3)] == ["g"]
    assert find_retirements([dropped, KEPT, KEPT], failed_share=1 / 3) == []
    (found,) = find_retirements([dropped, KEPT, replace(KEPT, outcome="toppled")], failed_share=1 / 3)
    assert (found.executed, found.failed, found.outcomes) == (3, 2, {"dropped": 1, "toppled": 1})


def test_what_is_not_the_grasps_fault_does_not_count() -> None:
    innocent = [replace(KEPT, outcome=outcome) for outcome in ("no_plan", "no_room", "unsettled", "disturbed")]
    borrowed = replace(KEPT, outcome="dropped", transferred=True)
    assert find_retirements([*innocent, borrowed], failed_share=0.0) == []


def test_of_a_handover_the_first_hand_answers_for_what_it_drops_alone() -> None:
    handed = [replace(KEPT, skill="handover", outcome=outcome) for outcome in ("goal_missed", "replan_failed", "kept")]
    assert not find_retirements(handed, failed_share=0.1)
    (found,) = find_retirements([*handed, replace(KEPT, skill="handover", outcome="dropped")], failed_share=0.2)
    assert (found.executed, found.failed) == (4, 1)


def test_a_retired_grasp_is_marked_and_used_no_more(tmp_path: Path) -> None:
    identity = write_brick(tmp_path, 0)
    folder, twins = tmp_path / twin_name(identity), TwinSource(tmp_path)
    before = read_record(folder, verify=True)
    found = find_retirements(
        [replace(KEPT, outcome="dropped", twin_id=identity, grasp_id="panda-0002")], failed_share=0.5
    )
    assert retire_grasps(twins, found) == 1
    after = read_record(folder, verify=True)
    assert after.revision != before.revision
    assert after.model_copy(update={"revision": "", "files": {}}) == before.model_copy(
        update={"revision": "", "files": {}}
    )
    table = pq.read_table(folder / "grasps.parquet").to_pylist()
    assert [row["grasp_id"] for row in table if row["retired"]] == ["panda-0002"]
    twin = twins.twin(identity)
    every = twin.grasps(retired=True)
    assert "panda-0002" not in twin.grasps().columns["grasp_id"] and len(twin.grasps()) == len(every) - 1
    assert "panda-0002" not in twin.grasps(verified_only=False).columns["grasp_id"]
    assert [every.columns["grasp_id"][at] for at, gone in enumerate(every.columns["retired"]) if gone] == ["panda-0002"]
    gripper = require_kind(load_gripper("panda"), ParallelGripper)
    assert "panda-0002" not in {each.grasp.grasp_id for each in usable_grasps(twins.twin(identity), gripper)}
    assert retire_grasps(twins, found) == 0
    assert read_record(folder).revision == after.revision


def test_grasps_of_a_gripper_that_was_never_tried_are_refused_by_name(tmp_path: Path) -> None:
    twin = TwinSource(tmp_path).twin(write_brick(tmp_path, 0))
    assert len(twin.grasps(gripper="panda")) == len(twin.grasps()) == 6
    with pytest.raises(UsageError, match="unknown gripper 'pandas'; did you mean 'panda'"):
        twin.grasps(gripper="pandas")


def test_what_people_said_of_a_twin_stands_when_a_grasp_is_retired(tmp_path: Path) -> None:
    identity = write_brick(tmp_path, 0)
    folder, twins = tmp_path / twin_name(identity), TwinSource(tmp_path)
    said = Review.model_validate(
        {
            "annotator": "ada",
            "twin_id": identity,
            "revision": read_record(folder).revision,
            "answers": {"category": "yes"},
        }
    )
    with ReviewStore(tmp_path / REVIEWS) as store:
        store.add([said], ["1"])
    dropped = replace(KEPT, outcome="dropped", twin_id=identity, grasp_id="panda-0002")
    assert retire_grasps(twins, find_retirements([dropped], failed_share=0.5)) == 1
    with ReviewStore(tmp_path / REVIEWS) as store:
        (stored,) = store.standing()
    assert stored.review.revision == read_record(folder).revision != said.revision
