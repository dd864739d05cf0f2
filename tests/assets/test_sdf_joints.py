"""Links and joints of SDF models, as the specification has them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from manitwin.assets.articulation import Articulation
from manitwin.assets.asset import Asset
from manitwin.assets.read import read_asset

MASS = "<inertial><mass>{}</mass></inertial>"
BOX = "<visual name='v'><geometry><box><size>0.1 0.2 0.3</size></box></geometry></visual>"
QUARTER = 1.5707963267948966
KNOB = BOX.replace("'v'", "'knob'")
BODY = f"<link name='body'>{MASS.format(2)}{BOX}</link>"
DOOR = f"<link name='door'><pose>0.5 0 0 0 0 {QUARTER}</pose>{MASS.format(1)}{BOX}{KNOB}</link>"
ENDS = "<parent>body</parent><child>door</child>"
LIMIT = "<limit><lower>0</lower><upper>1.2</upper><effort>-1</effort><velocity>3</velocity></limit>"
DYNAMICS = "<dynamics><damping>0.4</damping><friction>0.1</friction></dynamics>"


def hinge(axis: str = f"<xyz>1 0 0</xyz>{LIMIT}{DYNAMICS}", *, kind: str = "revolute", ends: str = ENDS) -> str:
    return f"<joint name='hinge' type='{kind}'><pose>0 0.1 0 0 0 0</pose>{ends}<axis>{axis}</axis></joint>"


def read(folder: Path, inside: str, version: str = "1.9") -> Asset:
    (folder / "model.sdf").write_text(f"<sdf version='{version}'><model name='cupboard'>{inside}</model></sdf>")
    return read_asset(folder / "model.sdf", joints="keep")


def whole(asset: Asset) -> Articulation:
    assert asset.articulation is not None, asset.remarks
    return asset.articulation


def test_a_door_keeps_its_hinge_limits_and_mass(tmp_path: Path) -> None:
    asset = read(tmp_path, BODY + DOOR + hinge())
    found = whole(asset)
    (joint,) = found.joints
    assert [(link.name, link.inertial.mass_kg) for link in found.links] == [("body", 2), ("door", 1)]
    assert found.link_of_visual == (0, 1, 1) and len(asset.visual) == 3 and asset.inertial.mass_kg == 3
    assert (joint.kind, joint.parent, joint.child, joint.lower, joint.upper) == ("revolute", 0, 1, 0, 1.2)
    assert (joint.damping, joint.friction, joint.effort, joint.velocity) == (0.4, 0.1, None, 3)
    np.testing.assert_allclose(joint.origin_m, [0.4, 0, 0], atol=1e-12)  # in the door's frame, which is turned
    np.testing.assert_allclose(joint.axis, [0, 1, 0], atol=1e-12)


@pytest.mark.parametrize(
    ("axis", "version", "said"),
    [
        (f"<xyz expressed_in='__model__'>1 0 0</xyz>{LIMIT}", "1.9", [1, 0, 0]),
        (f"<xyz expressed_in='door'>0 2 0</xyz>{LIMIT}", "1.9", [-1, 0, 0]),
        (f"<xyz>1 0 0</xyz><use_parent_model_frame>true</use_parent_model_frame>{LIMIT}", "1.6", [1, 0, 0]),
        (f"<xyz>1 0 0</xyz>{LIMIT}", "1.4", [1, 0, 0]),
        (f"<xyz>1 0 0</xyz>{LIMIT}", "1.5", [0, 1, 0]),
        (LIMIT, "1.9", [0, 0, 1]),
    ],
)
def test_the_axis_is_in_the_frame_that_the_version_and_the_file_say(
    tmp_path: Path, axis: str, version: str, said: list[float]
) -> None:
    (joint,) = whole(read(tmp_path, BODY + DOOR + hinge(axis), version)).joints
    np.testing.assert_allclose(joint.axis, said, atol=1e-12)


@pytest.mark.parametrize("limit", ["", "<limit><lower>-1e16</lower><upper>1e16</upper></limit>"])
def test_a_hinge_without_limits_turns_on_and_on(tmp_path: Path, limit: str) -> None:
    (joint,) = whole(read(tmp_path, BODY + DOOR + hinge(f"<xyz>0 0 1</xyz>{limit}"))).joints
    assert (joint.kind, joint.lower, joint.upper) == ("continuous", None, None)


def test_a_joint_from_the_childs_side_turns_about_the_opposite_axis(tmp_path: Path) -> None:
    handle = "<link name='handle'>" + BOX.replace("0.3", "0.01") + "</link>"
    base = "<joint name='base' type='prismatic'><parent>handle</parent><child>door</child><axis><xyz>0 0 1</xyz></axis></joint>"
    forward = whole(read(tmp_path, BODY + DOOR + handle + hinge() + base))
    (slide,) = [joint for joint in forward.joints if joint.name == "base"]
    assert forward.links[slide.parent].name == "door" and forward.links[slide.child].name == "handle"
    np.testing.assert_allclose(slide.axis, [0, 0, -1], atol=1e-12)


@pytest.mark.parametrize(
    ("joint", "why"),
    [
        (hinge(kind="ball"), "'hinge' is ball, which twins do not have: it is locked as the file stands"),
        (hinge("<xyz>0 0 0</xyz>"), "its axis has no direction"),
        (hinge("<xyz>0 0 1</xyz><limit><lower>1</lower><upper>1</upper></limit>"), "its limits leave it no way"),
        (hinge("<xyz>0 0 1</xyz><limit><lower>0.2</lower><upper>1</upper></limit>"), "stands outside of its limits"),
        (
            hinge("<xyz>0 0 1</xyz><mimic joint='other'><multiplier>1</multiplier></mimic>"),
            "copies another one (mimic)",
        ),
    ],
)
def test_what_a_twin_cannot_have_is_locked_and_said(tmp_path: Path, joint: str, why: str) -> None:
    asset = read(tmp_path, BODY + DOOR + joint)
    assert asset.articulation is None and len(asset.visual) == 3 and asset.inertial.mass_kg == 3
    assert any(why in remark for remark in asset.remarks), asset.remarks


def test_a_joint_that_closes_a_loop_is_left_out(tmp_path: Path) -> None:
    asset = read(tmp_path, BODY + DOOR + hinge() + hinge().replace("'hinge'", "'second'"))
    assert [joint.name for joint in whole(asset).joints] == ["hinge"]
    assert any("joint second (revolute) closes a loop and was left out" in remark for remark in asset.remarks)


def test_what_stands_fast_does_not_move(tmp_path: Path) -> None:
    asset = read(tmp_path, "<static>true</static>" + BODY + DOOR + hinge())
    assert asset.articulation is None and len(asset.visual) == 3


def test_a_rigid_part_alone_is_read_where_joints_are_not_asked_for(tmp_path: Path) -> None:
    read(tmp_path, BODY + DOOR + hinge())
    asset = read_asset(tmp_path / "model.sdf")
    assert len(asset.visual) == 1 and any("was left out" in remark for remark in asset.remarks)
