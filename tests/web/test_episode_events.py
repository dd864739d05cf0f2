"""What happens in an episode, as its document tells it."""

from __future__ import annotations

import json
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from asked_episodes import document, get, run_of

from drawn_episodes import GRASPED, LIFTED, RELEASED, SET_DOWN, STEPS, recording


def test_what_happens_is_found_in_the_recording_at_its_time(run: Path) -> None:
    found = {each["kind"]: each["time_s"] for each in document(run)["happenings"]}
    expected = {"grasped": GRASPED, "lifted": LIFTED, "set_down": SET_DOWN, "released": RELEASED}
    assert found == {kind: state / 20 for kind, state in expected.items()}
    phases = document(run)["phases"]
    assert phases[0]["label"] == "reach" and phases[-1]["to_s"] == STEPS / 20
    assert all(later["from_s"] - each["to_s"] == pytest.approx(0.05) for each, later in pairwise(phases))


def test_a_grip_that_is_lost_for_an_instant_is_one_grasp(tmp_path: Path) -> None:
    forces = recording().finger_forces_n.copy()
    forces[GRASPED + 3], forces[2:4] = 0, 9.0
    kinds = [each["kind"] for each in document(run_of(tmp_path, arrays={"finger_forces_n": forces}))["happenings"]]
    assert kinds.count("grasped") == kinds.count("released") == 1


def test_literals_events_granules_and_touches_are_told(tmp_path: Path) -> None:
    touched = np.zeros(STEPS + 1, bool)
    touched[12] = True
    held = np.zeros((STEPS + 1, 2), np.int16)
    held[:, 0], held[5:, 1] = 9, np.minimum(np.arange(STEPS - 4), 6)
    place = run_of(
        tmp_path,
        arrays={
            "unplanned_contact": touched,
            "active_literal": (np.arange(STEPS) >= 15).astype(np.uint8),
            "granules_in_objects": held,
            "granule_positions_m": np.full((STEPS + 1, 9, 3), 0.25, np.float32),
        },
        goal="in(object_00, object_01) and near(object_01, object_00, 0.1)",
        measured=json.dumps(
            [{"literal": "near(object_01)", "holds": False, "failure": "too_far", "measured": {"gap_m": 0.3}}]
        ),
        facts={
            "granule_radius_m": 0.004,
            "events": [
                {
                    "kind": "pressed",
                    "subject": "object_01",
                    "second": None,
                    "values": {"force_n": 6.2, "off_m": 0.0015, "time_s": 0.4},
                }
            ],
        },
    )
    told = document(place)
    said = [(each["time_s"], each["label"]) for each in told["happenings"]]
    assert (0.6, "the robot touched what it should not") in said
    assert (0.4, "pressed object_01 (box) (6.2 N, 1.5 mm off)") in said
    assert (0.75, "now: near(object_01, object_00, 0.1)") in said
    assert (0.3, "the first granule in object_01 (box)") in said and (0.55, "6 granules in object_01 (box)") in said
    assert [each["label"] for each in told["literals"]] == [
        "in(object_00, object_01)",
        "near(object_01, object_00, 0.1)",
    ]
    assert told["granules"]["count"] == 9 and set(told["granules"]["positions_m"]) == {0.25} and told["goal"] is None
    page = get(place, "/episode/0")[1]
    assert b"not true: too_far" in page and b"gap_m 0.3" in page


def test_what_is_grasped_is_what_the_literal_of_that_time_is_about(tmp_path: Path) -> None:
    place = run_of(
        tmp_path,
        arrays={"active_literal": (np.arange(STEPS) >= SET_DOWN + 1).astype(np.uint8)},
        goal="near(object_01, object_00, 0.1) and upright(object_00)",
    )
    told = [
        each["label"] for each in document(place)["happenings"] if each["kind"] in ("grasped", "lifted", "released")
    ]
    assert told == ["grasped object_01 (box)", "object_01 (box) leaves its support", "released object_01 (box)"]
