"""GraspGen behind its server: what is asked, what comes back, and whether it holds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from grasp_drafts import PANDA, box_draft, run_all
from manitwin.config import BuildConfig, CollisionConfig, GraspConfig, ServicesConfig, VerifyConfig
from manitwin.engine.stage import Draft
from manitwin.errors import BadReply, ConfigError, Rejected, Unavailable, UsageError
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.grasp_servers import FakeGraspGen, FakeGraspGenX
from manitwin.models.graspers.graspgen import GraspGenGrasper
from manitwin.models.graspers.graspgenx import GraspGenXGrasper
from manitwin.models.graspers.protocol import Grasper, GraspRequest
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.pipeline.collision import CollisionStage
from manitwin.pipeline.grasps import GraspsStage
from manitwin.pipeline.verify import VerifyStage
from manitwin.robots.grippers.gripper import load_gripper
from real_meshes import load_real_mesh

# grasp_gen/serving/zmq_server.py: every field that it reads
FIELDS = {
    *("action", "point_cloud", "grasp_threshold", "num_grasps", "topk_num_grasps"),
    *("min_grasps", "max_tries", "remove_outliers"),
}
CONFIG = BuildConfig(services=ServicesConfig(timeout_s=120, retries=0))
BAR = trimesh.creation.box([0.04, 0.03, 0.2])


def request_for(count: int = 60, **others: Any) -> GraspRequest:
    request = GraspRequest(
        solid=BAR,
        hulls=(np.array(BAR.vertices),),
        mass_kg=0.3,
        center_of_mass_m=np.zeros(3),
        object_friction=0.5,
        gripper=PANDA,
        focus_points_m=np.empty((0, 3)),
        max_proposals=count,
        seed=7,
    )
    return replace(request, **others)


def grasper_at(fake: FakeGraspGen) -> GraspGenGrasper:
    return GraspGenGrasper.from_spec(f"@{fake.url}", CONFIG)


def test_it_is_a_grasper_that_is_asked_once() -> None:
    grasper: Grasper = GraspGenGrasper.from_spec("", CONFIG)
    assert (grasper.name, grasper.needs, grasper.rounds) == ("graspgen", "gpu", 1)
    assert grasper.model is not None and "franka_panda" in grasper.model and "tcp" not in grasper.model


def test_the_question_is_the_documented_one_for_the_papers_4000_grasps() -> None:
    with FakeGraspGen(Faults({"no_grasps": 1})) as fake:
        grasper_at(fake).propose(request_for(8000))
    metadata, infer = fake.requests
    assert metadata == {"action": "metadata"}
    assert set(infer) <= FIELDS
    assert (infer["num_grasps"], infer["topk_num_grasps"], infer["grasp_threshold"]) == (4000, 4000, -1.0)
    assert infer["min_grasps"] <= 4000
    assert infer["point_cloud"].dtype == np.float32
    assert infer["point_cloud"].shape == (2000, 3)
    # every point lies on one of the box's faces, which get points by their area
    outside = np.abs(infer["point_cloud"]) - BAR.extents / 2
    assert np.abs(outside.max(1)).max() < 1e-7
    assert (np.abs(outside[:, 2]) < 1e-7).mean() == pytest.approx(2 * 0.04 * 0.03 / BAR.area, abs=0.02)


def test_the_cloud_depends_on_the_seed_only() -> None:
    with FakeGraspGen(Faults.parse(["no_grasps"])) as fake:
        for seed in (7, 7, 8):
            grasper_at(fake).propose(request_for(seed=seed))
    first, again, other = [r["point_cloud"].tobytes() for r in fake.requests if r["action"] == "infer"]
    assert first == again != other


def test_proposals_are_like_those_of_any_grasper() -> None:
    with FakeGraspGen() as fake:
        proposals = grasper_at(fake).propose(request_for(300))
    assert len(proposals) == 300
    assert (np.diff(proposals.score) <= 0).all()
    assert 0 <= proposals.score.min() <= proposals.score.max() <= 1
    assert (proposals.depth_m == PANDA.tip_depth_m).all()
    tips = proposals.gripper_to_object[:, :3, 3] + PANDA.tip_depth_m * proposals.gripper_to_object[:, :3, 2]
    assert (np.abs(tips) <= BAR.extents / 2 + 0.008).all()
    # where they close straight along an axis of the box, the width is the box's own
    along = np.abs(proposals.gripper_to_object[:, :3, 0])
    straight = along.max(1) > 1 - 1e-9
    assert straight.sum() > 100
    assert proposals.width_m[straight] == pytest.approx(BAR.extents[along[straight].argmax(1)], abs=1e-5)


def test_both_ways_of_finding_nothing_are_no_proposals() -> None:
    with FakeGraspGen(Faults.parse(["no_grasps"])) as fake:
        for _ in range(2):
            proposals = grasper_at(fake).propose(request_for())
            assert len(proposals) == 0
            assert proposals.gripper_to_object.shape == (0, 4, 4)


@pytest.mark.parametrize("fault", ["server_error", "not_json", "cut_answer", "wrong_schema"])
def test_answers_that_cannot_be_used_are_bad_replies(fault: str) -> None:
    with FakeGraspGen(Faults({fault: 1})) as fake:
        with pytest.raises(BadReply, match=r"^graspgen: "):
            grasper_at(fake).propose(request_for())
        assert len(grasper_at(fake).propose(request_for()))


def spoiled(fake: FakeGraspGen, monkeypatch: pytest.MonkeyPatch, **fields: Any) -> None:
    answer = fake.answer
    monkeypatch.setattr(fake, "answer", lambda r: answer(r) | (fields if r["action"] == "infer" else {}))


@pytest.mark.parametrize(
    "fields",
    [
        {"confidences": np.full(60, np.nan)},
        {"confidences": np.ones(59)},
        {"grasps": np.tile(np.eye(4), (60, 1, 1)) * 2},
        {"grasps": np.zeros((60, 7))},
        {"grasps": "many"},
        {"grasps": None},
    ],
)
def test_grasps_that_are_none_are_bad_replies(fields: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    with FakeGraspGen() as fake:
        spoiled(fake, monkeypatch, **fields)
        with pytest.raises(BadReply, match="the answer holds"):
            grasper_at(fake).propose(request_for())


def test_scores_beyond_their_range_are_clipped_and_surplus_grasps_dropped(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, 0, 3] = np.arange(5)
    with FakeGraspGen() as fake:
        spoiled(fake, monkeypatch, grasps=poses, confidences=np.array([0.2, 1.5, -0.5, 0.9, 0.3]))
        proposals = grasper_at(fake).propose(request_for(4))
    assert proposals.score.tolist() == [1, 0.9, 0.3, 0.2]
    assert proposals.gripper_to_object[:, 0, 3].tolist() == [1, 3, 4, 0]
    # nothing is between the fingers but at the last, which reaches across the box
    assert proposals.width_m == pytest.approx([PANDA.opening_m] * 3 + [0.04])


def test_a_server_of_another_hand_is_refused_before_any_work() -> None:
    with FakeGraspGen(gripper_name="robotiq_2f_140") as fake:
        with pytest.raises(Unavailable, match="serves robotiq_2f_140, not franka_panda; start it with"):
            grasper_at(fake).propose(request_for())
        with pytest.raises(Unavailable, match="robotiq_2f_140"):
            grasper_at(fake).probe()
    assert "infer" not in {request["action"] for request in fake.requests}


def test_a_gripper_without_a_model_is_a_configuration_error() -> None:
    config = BuildConfig(grippers=("robotiq_2f85",))
    with pytest.raises(ConfigError, match=r"no model for gripper robotiq_2f85, only for panda .*graspgenx"):
        GraspGenGrasper.from_spec("", config)
    with FakeGraspGen() as fake:
        with pytest.raises(UsageError, match="not a ParallelGripper"):
            grasper_at(fake).propose(request_for(gripper=load_gripper("suction")))
        with pytest.raises(ConfigError, match="no model"):
            grasper_at(fake).propose(request_for(gripper=load_gripper("wsg50_110")))
    assert not fake.requests


def test_probe_says_what_is_served() -> None:
    with FakeGraspGen() as fake:
        assert grasper_at(fake).probe() == "serves franka_panda (diffusion-discriminator)"
    assert [request["action"] for request in fake.requests] == ["health", "metadata"]


def held(draft: Draft, folder: Path, grasper: Grasper, settings: GraspConfig) -> tuple[int, int]:
    """How many of the chosen grasps hold in the trial, and how many were chosen."""
    grasps, verify = GraspsStage(settings, grasper, PANDA), VerifyStage(VerifyConfig(), SapienTrial(), PANDA)
    run_all(draft, folder, grasps, verify)
    chosen = np.load(draft.path("proposals.npz"))["proposer"] == grasper.name
    outcome = np.load(draft.path("verdicts.npz"))["outcome"]
    return int((outcome[chosen] == "held").sum()), int(chosen.sum())


def test_its_proposals_pass_the_filters_and_hold(tmp_path: Path) -> None:
    draft = box_draft(tmp_path, [0.04, 0.04, 0.25], [[0.0, 0.0, 0.25], [0.0, 0.02, 0.04], [0.02, 0, 0.12]])
    settings = GraspConfig(simulated=12, unfiltered=4, raw_per_round=1000)
    with FakeGraspGen() as fake:
        good, chosen = held(draft, tmp_path, grasper_at(fake), settings)
    assert chosen == 12
    assert good >= 10
    assert [request["action"] for request in fake.requests] == ["metadata", "infer"]


@pytest.mark.parametrize("suffix", ["", "-panda"])
def test_a_model_that_finds_nothing_leaves_the_reason(tmp_path: Path, suffix: str) -> None:
    draft = box_draft(tmp_path, [0.04, 0.04, 0.25], [[0.0, 0.0, 0.25], [0.0, 0.02, 0.04]])
    with FakeGraspGen(Faults.parse(["no_grasps"])) as fake:
        stage = GraspsStage(GraspConfig(), grasper_at(fake), PANDA, suffix)
        if suffix:
            run_all(draft, tmp_path, stage)
            reason = draft.field(f"proposals{suffix}")["none_because"]["reason"]
        else:
            with pytest.raises(Rejected) as rejected:
                run_all(draft, tmp_path, stage)
            reason = rejected.value.reason
    assert reason == "no_proposal"
    assert len(fake.requests) == 2


@pytest.mark.slow
@pytest.mark.shared_data
@pytest.mark.parametrize("name", ["mug_ycb", "cracker_box"])
@pytest.mark.parametrize(
    ("fake_class", "grasper_class"), [(FakeGraspGen, GraspGenGrasper), (FakeGraspGenX, GraspGenXGrasper)]
)
def test_grasps_of_real_objects_hold(
    shared_data: Path, tmp_path: Path, name: str, fake_class: Any, grasper_class: Any
) -> None:
    mesh = load_real_mesh(shared_data, name)
    draft = box_draft(tmp_path, [0.04, 0.04, 0.25], mesh.vertices[:: len(mesh.vertices) // 3][:3].tolist())
    np.savez(tmp_path / "solid.npz", vertices=mesh.vertices, faces=mesh.faces)
    draft.fields["physical"]["center_of_mass_m"] = mesh.center_mass.tolist()
    draft.fields["geometry"], draft.paths["canonical.npz"] = {}, tmp_path / "solid.npz"
    run_all(draft, tmp_path, CollisionStage(CollisionConfig()))
    with fake_class() as fake:
        grasper = grasper_class.from_spec(f"@{fake.url}", CONFIG)
        good, chosen = held(draft, tmp_path, grasper, GraspConfig())
    assert chosen >= 10
    assert good >= 0.7 * chosen
