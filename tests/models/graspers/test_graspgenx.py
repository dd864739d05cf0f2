"""GraspGenX behind its server: how a gripper is described to it, and what comes back."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from test_graspgen import BAR, request_for

from manitwin.config import BuildConfig, ServicesConfig
from manitwin.errors import BadReply, Unavailable
from manitwin.models.fakes import grasp_servers as fake_module
from manitwin.models.fakes.faults import Faults
from manitwin.models.fakes.grasp_servers import FakeGraspGenX
from manitwin.models.graspers.graspgenx import GraspGenXGrasper, sweep_volume
from manitwin.models.graspers.screens import PadScreen
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.parallel import ParallelGripper

CONFIG = BuildConfig(services=ServicesConfig(timeout_s=120, retries=0))
# client-server/README.md, "Protocol Reference": what infer_object takes
FIELDS = {"action", "point_cloud", "sweep_volume_params", "planner", "num_grasps"}


def gripper(name: str) -> ParallelGripper:
    loaded = load_gripper(name)
    assert isinstance(loaded, ParallelGripper)
    return loaded


def grasper_at(fake: FakeGraspGenX) -> GraspGenXGrasper:
    return GraspGenXGrasper.from_spec(f"@{fake.url}", CONFIG)


def test_the_panda_is_described_as_in_the_released_description() -> None:
    # gripper_descriptions, x_grippers/franka_panda/config.json
    described = sweep_volume(gripper("panda"))
    assert described["extents_open"] == pytest.approx([0.08, 0.018, 0.018], abs=6e-4)
    assert described["offset_open"] == pytest.approx([0, 0, 0.1034])
    assert described["extents_mid"] == pytest.approx([0.04, 0.018, 0.018], abs=6e-4)
    assert described["offset_mid"] == pytest.approx([0, 0, 0.1034])
    assert described["fingertip_depth"] == 0.1034
    assert described["gripper_type"] == 0


def test_the_question_is_the_documented_one() -> None:
    with FakeGraspGenX(Faults({"no_grasps": 1})) as fake:
        assert len(grasper_at(fake).propose(request_for(8000))) == 0
    [infer] = fake.requests
    assert set(infer) <= FIELDS
    assert (infer["action"], infer["num_grasps"], infer["planner"]) == ("infer_object", 4000, "diffusion")
    assert infer["point_cloud"].shape == (3500, 3)
    assert infer["point_cloud"].dtype == np.float32


@pytest.mark.parametrize(
    "name",
    ["panda", *(pytest.param(name, marks=pytest.mark.slow) for name in ("robotiq_2f85", "wsg50_110"))],
)
def test_every_parallel_gripper_gets_grasps_that_pass_its_filters(name: str) -> None:
    hand = gripper(name)
    request = request_for(400, gripper=hand)
    with FakeGraspGenX() as fake:
        proposals = grasper_at(fake).propose(request)
    assert len(proposals) == 400
    assert (proposals.depth_m == hand.tip_depth_m).all()
    tips = proposals.gripper_to_object[:, :3, 3] + hand.tip_depth_m * proposals.gripper_to_object[:, :3, 2]
    assert (np.abs(tips) <= BAR.extents / 2 + 0.008).all()
    assert len(PadScreen(request)(proposals).proposals) > 20


def test_nothing_found_is_no_proposals_also_where_it_is_said_as_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    def empty(*arguments: Any) -> Any:
        raise TypeError("expected Tensor as element 0 in argument 0, but got list")

    monkeypatch.setattr(fake_module, "cloud_grasps", empty)
    with FakeGraspGenX() as fake:
        assert len(grasper_at(fake).propose(request_for())) == 0


@pytest.mark.parametrize("fault", ["server_error", "not_json", "wrong_schema"])
def test_answers_that_cannot_be_used_are_bad_replies(fault: str) -> None:
    with FakeGraspGenX(Faults({fault: 1})) as fake, pytest.raises(BadReply, match=r"^graspgenx: "):
        grasper_at(fake).propose(request_for())


def test_a_gripper_that_cannot_be_is_said_by_the_server() -> None:
    flat = replace(gripper("panda"), opening_m=0.0)
    with FakeGraspGenX() as fake, pytest.raises(BadReply, match="extents_open must be strictly positive"):
        grasper_at(fake).propose(request_for(gripper=flat))


def test_probe_says_what_is_served_and_whether_it_is_too_old(monkeypatch: pytest.MonkeyPatch) -> None:
    with FakeGraspGenX() as fake:
        assert grasper_at(fake).probe() == "serves any parallel gripper (ptv3vanilla)"
        monkeypatch.setattr(fake_module, "ACTIONS", ("health", "metadata", "infer"))
        with pytest.raises(Unavailable, match="no action infer_object; update it"):
            grasper_at(fake).probe()
