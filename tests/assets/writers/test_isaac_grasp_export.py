"""isaac_grasp read by PyYAML, as its readers do: types, frames and the two forms."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

from known_twins import TWINS, brick, tray
from manitwin.assets.writers import isaac_grasp
from manitwin.assets.writers.exporter import TwinContent
from manitwin.assets.writers.grasp_rows import grasp_rows
from manitwin.errors import ExportError
from manitwin.geometry.poses import rotation_from_quaternion_wxyz


def loaded(twin: TwinContent) -> dict[str, Any]:
    exported = isaac_grasp.export(twin)
    content: dict[str, Any] = yaml.safe_load(exported.files[exported.main])
    return content


def floats(value: Any) -> bool:
    if isinstance(value, dict):
        return all(floats(item) for item in value.values())
    return all(map(floats, value)) if isinstance(value, list) else isinstance(value, float)


@pytest.mark.parametrize("make", TWINS)
def test_poses_are_those_of_the_pandas_hand(make: Any) -> None:
    twin = make()
    rows = grasp_rows(twin, "panda", controls=True)
    grasps = loaded(twin)["grasps"]
    assert set(grasps) == set(rows.ids)
    for name, pose in zip(rows.ids, rows.gripper_to_object, strict=True):
        orientation = grasps[name]["orientation"]
        hand = rotation_from_quaternion_wxyz(np.array([orientation["w"], *orientation["xyz"]]))
        assert np.allclose(grasps[name]["position"], pose[:3, 3])
        assert np.allclose(hand[:, 2], pose[:3, 2])
        assert np.isclose(abs(hand[:, 1] @ pose[:3, 0]), 1)  # panda_hand closes along Y
        assert np.isclose(np.linalg.det(hand), 1)


def test_header_has_what_grasp_sim_asks_for() -> None:
    content = loaded(brick())
    assert content["format"] == "isaac_grasp"
    assert content["format_version"] == 1.0 and isinstance(content["format_version"], float)  # as Isaac Sim has it
    assert content["object_frame_link"] == f"/World/{brick().name}"
    assert content["object_file"] in isaac_grasp.export(brick()).files
    assert content["object_scale"] == 1.0
    assert content["gripper_file"] == "bots/franka_panda.usd"
    assert content["gripper_frame_link"] == "panda_hand"
    assert content["finger_colliders"] == ["panda_leftfinger", "panda_rightfinger"]
    assert (content["open_limit"], content["approach_axis"], content["bite_body_idx"]) == ("upper", 2, 1)
    assert np.allclose(content["bite_point"], [0, 0.04, 0.1034])


def test_joints_are_half_the_width_closed_and_half_the_opening_before() -> None:
    grasp = loaded(brick())["grasps"]["panda-0000"]
    assert grasp["cspace_position"] == {"panda_finger_joint1": 0.015, "panda_finger_joint2": 0.015}
    assert grasp["pregrasp_cspace_position"] == {"panda_finger_joint1": 0.04, "panda_finger_joint2": 0.04}
    assert np.allclose(grasp["bite_point"], [0, 0.015, 0.1034])


def test_failed_grasps_have_no_confidence_and_held_ones_some() -> None:
    twin = brick()
    twin.grasps["robustness"] = [0.0, 0.5, 1.0] + [None] * (len(twin.grasps["score"]) - 3)
    grasps = loaded(twin)["grasps"]
    assert [grasps[f"panda-{i:04d}"]["confidence"] for i in range(4)] == [0.001, 0.5, 1.0, twin.grasps["score"][3]]
    assert [grasp["confidence"] for grasp in grasps.values()].count(0.0) == 1
    assert next(iter(grasps.values()))["confidence"] > 0


def test_small_numbers_stay_numbers() -> None:
    twin = brick()
    twin.grasps["position_m"][0] = [1e-05, -2e-17, 1.5e-06]
    grasps = loaded(twin)["grasps"]
    assert grasps["panda-0000"]["position"] == [1e-05, -2e-17, 1.5e-06]
    assert all(floats(grasp) for grasp in grasps.values())


def test_unknown_gripper_gets_the_short_form() -> None:
    twin = brick()
    twin.grasps["gripper"] = ["mine"] * len(twin.grasps["gripper"])
    content = loaded(twin)
    assert "gripper_file" not in content
    assert set(content["grasps"]["panda-0000"]) == {"confidence", "position", "orientation"}
    assert any("--gripper_file" in line for line in isaac_grasp.export(twin).cannot_say)


def test_words_of_the_source_cannot_break_the_file() -> None:
    twin = brick()
    source = twin.record.source.model_copy(update={"attribution": "Ada\ngrasps: {}\n"})
    object.__setattr__(twin, "record", twin.record.model_copy(update={"source": source}))
    assert len(loaded(twin)["grasps"]) == len(twin.grasps["grasp_id"])


def test_twin_without_parallel_grasps_is_refused() -> None:
    twin = brick()
    twin.grasps["width_m"] = [0.0] * len(twin.grasps["width_m"])
    with pytest.raises(ExportError, match="parallel gripper"):
        isaac_grasp.export(twin)


def test_same_twin_gives_the_same_bytes() -> None:
    assert isaac_grasp.export(tray()) == isaac_grasp.export(tray())


def test_that_graspgen_takes_another_frame_is_said() -> None:
    assert any("closes along Y" in line and "graspgen" in line for line in isaac_grasp.export(brick()).cannot_say)
