from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from foreign_assets import given_record
from grasp_drafts import box_draft
from manitwin.config import GraspConfig
from manitwin.geometry.poses import GLTF_TO_OBJECT
from manitwin.models.graspers.surface_sampling import AntipodalGrasper
from manitwin.pipeline.grasps import GraspsStage
from manitwin.pipeline.item import Item
from manitwin.pipeline.proposals import given_proposals
from manitwin.robots.grippers.gripper import load_gripper

PANDA = load_gripper("panda")
TOP_DOWN = np.array([[1.0, 0, 0, 0], [0, -1, 0, 0], [0, 0, -1, 0], [0, 0, 0, 1]])


def grasps_of(name: str, heights_m: list[float], held: list[bool]) -> dict[str, Any]:
    """Grasps from above whose fingertips are at these heights."""
    poses = []
    for height in heights_m:
        pose = TOP_DOWN.copy()
        pose[2, 3] = height + PANDA.tip_depth_m
        poses.append(pose.tolist())
    count = len(heights_m)
    return {
        "gripper": name, "gripper_to_object": poses, "depth_m": [PANDA.tip_depth_m] * count,
        "width_m": [0.04] * count, "held": held,
    }  # fmt: skip


def test_those_said_to_hold_come_first_and_other_grippers_not_at_all() -> None:
    given = given_record(
        grasps=[grasps_of(PANDA.name, [0.01, 0.02, 0.03], [False, True, True]), grasps_of("other", [0.05], [True])]
    )
    proposals = given_proposals(given, PANDA, 2)
    assert proposals is not None and len(proposals) == 2
    assert np.allclose(proposals.gripper_to_object[:, 2, 3] - PANDA.tip_depth_m, [0.02, 0.03])
    assert given_proposals(given_record(), PANDA, 2) is None


def test_contact_frame_is_a_grasp_with_its_fingertips_there() -> None:
    point = {"position_m": [0.01, 0.02, 0.03], "approach": [0, 0, -1], "closing": [0, 1, 0]}
    proposals = given_proposals(given_record(grasp_points=[point]), PANDA, 10)
    assert proposals is not None
    pose = proposals.gripper_to_object[0]
    assert np.linalg.det(pose[:3, :3]) == pytest.approx(1)
    assert np.allclose(pose[:3, 0], [0, 1, 0]) and np.allclose(pose[:3, 2], [0, 0, -1])
    assert np.allclose(pose[:3, 3] + PANDA.tip_depth_m * pose[:3, 2], [0.01, 0.02, 0.03])


def test_given_grasps_join_the_proposals_under_their_own_name(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.04, 0.06, 0.1], [[0.02, 0, 0.05], [-0.02, 0, 0.05]])
    settings = GraspConfig(simulated=8, unfiltered=2)
    before, after = tmp_path / "before", tmp_path / "after"
    before.mkdir()
    after.mkdir()
    GraspsStage(settings, AntipodalGrasper(), PANDA).run(draft, before)
    # the box stands on z = 0: one grasp fits, the other lies above it
    given = given_record(grasps=[grasps_of(PANDA.name, [0.08, 0.5], [True, True])])
    (tmp_path / "import.json").write_text(given.model_dump_json())
    draft.payload = Item(file="box.glb", name="box", given=str(tmp_path / "import.json"))
    draft.fields["geometry"] = {"input_to_object": GLTF_TO_OBJECT.tolist()}
    fields = GraspsStage(settings, AntipodalGrasper(), PANDA).run(draft, after)["proposals"]
    plain, joined = np.load(before / "proposals.npz"), np.load(after / "proposals.npz")
    assert [str(who) for who in joined["proposer"]] == ["imported:robotwin", *plain["proposer"].tolist()]
    assert np.allclose(joined["gripper_to_object"][0][2, 3], 0.08 + PANDA.tip_depth_m)
    assert np.array_equal(joined["gripper_to_object"][1:], plain["gripper_to_object"])  # the others are as they were
    assert joined["width_m"][0] == pytest.approx(0.04, abs=1e-4)
    assert fields["proposed_by_filter"]["after_diversity"] == 9
