"""The file of a hand of one's own: joints that follow others, openings that are measured, and what users get wrong."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.errors import ManiTwinError, UsageError
from manitwin.geometry.poses import transform
from manitwin.physics.sapien.fingers import ArticulatedTrial
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.fingertip_gaps import Fingertips
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from rigid_boxes import FROM_ABOVE, box
from small_hand import COUPLED, TOML, urdf, write_hand

FOLLOWS = '<mimic joint="{leader}" multiplier="0.5" offset="-0.1"/>'


def load(path: str) -> MultiFingerGripper:
    hand = load_gripper(path)
    assert isinstance(hand, MultiFingerGripper)
    return hand


def refusal(folder: Path, old: str, new: str, description: str | None = None) -> str:
    assert old in TOML
    with pytest.raises(UsageError) as error:
        load_gripper(write_hand(folder, TOML.replace(old, new), description))
    assert "hand.toml" in str(error.value)
    return str(error.value)


def test_gap_of_upright_fingers_is_that_of_their_boxes(tmp_path: Path) -> None:
    hand = load(write_hand(tmp_path))
    gaps_m = Fingertips(hand).gaps_m(np.zeros(6))
    assert gaps_m == pytest.approx([0.060, 0.060], abs=1e-9)  # 72 mm between the axes, less a half of 6 mm each


def test_openings_between_open_and_closed_are_measured(tmp_path: Path) -> None:
    hand = load(write_hand(tmp_path))
    (posture,) = hand.postures
    assert posture.openings_m[-1] == pytest.approx(0.060, abs=1e-9)
    assert (np.diff(posture.openings_m) > 0).all()
    assert hand.opening_m == pytest.approx(0.060 - 2 * 0.008, abs=1e-9)
    tips = Fingertips(hand)
    for opening_m in (0.01, 0.025, 0.05):
        joints = posture.joints_at(np.array(opening_m))
        assert tips.gaps_m(joints).min() == pytest.approx(opening_m, abs=0.002)
    assert posture.openings_m[0] < 0, "a squeeze leads past where they meet"
    assert posture.joints_rad[0] == pytest.approx((0.6, 0.3, 0.6, 0.3, 0.6, 0.3))


def test_joints_that_follow_need_not_be_named_and_stay_within_their_limits(tmp_path: Path) -> None:
    hand = load(write_hand(tmp_path, COUPLED, urdf(FOLLOWS)))
    assert set(hand.joints) == {f"{finger}_{n}" for finger in ("thumb", "index", "middle") for n in (1, 2)}
    (posture,) = hand.postures
    joints = dict(zip(hand.joints, posture.joints_rad[0], strict=True))
    assert joints["index_2"] == pytest.approx(0.5 * 0.6 - 0.1)
    joints = dict(zip(hand.joints, posture.joints_rad[-1], strict=True))
    assert joints["index_2"] == 0, "where the leader is at 0, the follower would be at -0.1, beyond its limit"


def test_hand_whose_joints_follow_holds_a_box(tmp_path: Path) -> None:
    hand = load(write_hand(tmp_path, COUPLED, urdf(FOLLOWS)))
    settings = TrialSettings(force_n=hand.force_n, finger_friction=hand.finger_friction)
    joints = hand.postures[0].joints_at(np.array([0.056, -0.03]))
    pose = transform(FROM_ABOVE, -FROM_ABOVE[:, 2] * 0.08)
    (result,) = ArticulatedTrial().run(box([0.04, 0.05, 0.05], 0.06), hand, pose[None], settings, joints[None])
    assert result.outcome == "held"


def test_position_that_contradicts_a_mimic_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"'thumb_2' at 0\.3, its <mimic> puts it at 0\.2"):
        load_gripper(write_hand(tmp_path, description=urdf(FOLLOWS)))


def test_followers_in_a_circle_and_without_a_leader_are_refused(tmp_path: Path) -> None:
    with pytest.raises(ManiTwinError, match="mimics itself"):
        load_gripper(write_hand(tmp_path, COUPLED, urdf(FOLLOWS).replace('joint="thumb_1"', 'joint="thumb_2"')))
    with pytest.raises(ManiTwinError, match=r"hand\.urdf: unknown joint 'thumb_9'; did you mean"):
        load_gripper(
            write_hand(tmp_path, COUPLED, urdf(FOLLOWS).replace('mimic joint="thumb_1"', 'mimic joint="thumb_9"'))
        )


def test_xacro_in_place_of_a_urdf_is_told_how_to_expand_it(tmp_path: Path) -> None:
    macro = '<xacro:property name="w" value="0.1"/><link'
    source = urdf().replace(
        '<robot name="small_hand"><link', f'<robot name="h" xmlns:xacro="http://www.ros.org/wiki/xacro">{macro}', 1
    )
    with pytest.raises(
        ManiTwinError, match=r"hand\.urdf: <xacro:property> is a xacro file.*run 'xacro FILE > FILE\.urdf'"
    ):
        load_gripper(write_hand(tmp_path, description=source))
    expanded = urdf().replace("<robot ", '<robot xmlns:xacro="http://www.ros.org/wiki/xacro" ')
    assert load(write_hand(tmp_path, description=expanded)).name == "small_hand"


def test_changed_mesh_of_a_link_is_another_gripper(tmp_path: Path) -> None:
    with_mesh = urdf().replace('<box size="0.09 0.05 0.02"/>', '<mesh filename="palm.stl"/>')
    digests = []
    for height_m in (0.01, 0.02):
        trimesh.creation.box((0.09, 0.05, height_m)).export(tmp_path / "palm.stl")
        digests.append(load(write_hand(tmp_path, description=with_mesh)).sha256)
    assert digests[0] != digests[1]


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"thumb_1", "thumb_2", "index_1"', '"thump_1", "thumb_2", "index_1"', "unknown joint 'thump_1'; did you mean 'thumb_1'"),
        ('["thumb_1_link", "thumb_2_link"]', '["thumb_1_link", "thumb_tip"]', "unknown link 'thumb_tip'"),
        ('"index_1_link", "index_2_link"', '"index_1_link", "thumb_2_link"', "thumb_2_link is listed twice"),
        ("closed_rad = [0.6, 0.3,", "closed_rad = [0.6, 1.3,", "joint 'thumb_2' is at 1.3, its limits in the URDF are 0 to 1.2"),
        ("closed_rad = [0.6,", "closed_rad = [34,", "joint 'thumb_1' is at 34"),
        ("closed_rad = [0.6, 0.3, 0.6, 0.3, 0.6, 0.3]", "closed_rad = [0.6, 0.3]", "give 6 joint positions"),
        ("open_rad = ", "openings_m = ", "give openings_m with joints_rad"),
        ("clearance_m = 0.008", "clearance_m = 0.03", "opens 0.06 m"),
        ("press_nm = 0.6", "press_nm = 1.6", "above torque_limit_nm = 0.9"),
        ("force_n = 8.0", "force_n = -8.0", "force_n: is -8, it must be above 0"),
        ("tip_depth_m = 0.085", "tip_depth_m = 85", "tip_depth_m: is 85"),
        ("depth_m = [0.06, 0.085]", "depth_m = [0.085, 0.06]", "depth_m: descends"),
        ("depth_m = [0.06, 0.085]", "depth_m = [0.06, 0.11]", "depth_m ends at 0.11, thumb and fingers reach to 0.098 along +Z"),
        ("quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]", "quaternion_wxyz = [1.0, 1.0, 0.0, 0.0]", "quaternion wxyz of length 1"),
        ("quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]", "quaternion_wxyz = [0.0, 0.0, 0.0, 1.0]", "the thumb belongs on -X"),
        ("quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]", "quaternion_wxyz = [0.0, 0.0, 1.0, 0.0]", "-X"),
        ("quaternion_wxyz = [1.0, 0.0, 0.0, 0.0]", "quaternion_wxyz = [0.0, 1.0, 0.0, 0.0]", "+Z points out of the palm"),
        ('grasp_types = ["pinch",', 'grasp_types = ["pich",', "grasp_types"),
        ("speed_rad_s = 2.0", "sped_rad_s = 2.0", "not a key of this kind; these are missing: speed_rad_s"),
    ],
)  # fmt: skip
def test_what_is_wrong_is_named(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert said in refusal(tmp_path, old, new)


def test_thumb_that_closes_the_other_way_is_refused(tmp_path: Path) -> None:
    away = (
        urdf()
        .replace('<axis xyz="0 -1 0"/>', '<axis xyz="0 1 0"/>')
        .replace('axis xyz="0 1 0"', 'axis xyz="0 -1 0"', 1)
    )
    assert "do not come nearer as it closes" in refusal(
        tmp_path, "force_n = 8.0", "force_n = 9.0", away.replace("1.2", "1.3")
    )


def test_openings_that_the_links_do_not_have_are_refused(tmp_path: Path) -> None:
    rows = "joints_rad = [[0.6, 0.3, 0.6, 0.3, 0.6, 0.3], [0, 0, 0, 0, 0, 0]]"
    ends = TOML[TOML.index("closed_rad") :]
    assert load(
        write_hand(tmp_path, TOML.replace(ends, f"openings_m = [-0.02, 0.06]\n{rows}\n"))
    ).opening_m == pytest.approx(0.044)
    said = refusal(tmp_path, ends, f"openings_m = [-0.02, 0.12]\n{rows}\n")
    assert "said to be 0.12 m, thumb and fingers of the URDF are then 0.06 m apart along X" in said


def test_joint_of_the_palm_may_not_move_within_a_posture(tmp_path: Path) -> None:
    assert "belongs to no finger" in refusal(tmp_path, '["middle_1_link", "middle_2_link"]', '["middle_2_link"]')


def test_finger_without_shapes_and_finger_without_joints_are_refused(tmp_path: Path) -> None:
    whole = urdf()
    shape = whole[whole.index('<link name="thumb_1_link">') : whole.index('<joint name="thumb_1"')]
    bare = whole.replace(shape, '<link name="thumb_1_link"/>')
    said = refusal(tmp_path, '["thumb_1_link", "thumb_2_link"]', '["thumb_1_link"]', bare)
    assert "finger 0 (thumb_1_link) has no <collision>" in said
    still = urdf().replace('name="thumb_1" type="revolute"', 'name="thumb_1" type="fixed"')
    still = still.replace('name="thumb_2" type="revolute"', 'name="thumb_2" type="fixed"')
    toml = TOML.replace('"thumb_1", "thumb_2", ', "").replace("[0.6, 0.3, 0.6, 0.3, 0.6, 0.3]", "[0.6, 0.3, 0.6, 0.3]")
    toml = toml.replace("[0.0, 0.0, 0.0, 0.0, 0.0, 0.0]", "[0.0, 0.0, 0.0, 0.0]")
    with pytest.raises(UsageError, match="none of the joints that hold thumb_1_link, thumb_2_link moves"):
        load_gripper(write_hand(tmp_path, toml, still))
