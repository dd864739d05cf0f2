"""The parts of an asset as it is loaded, and along the way that its joints let them go, in each format that has joints."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from made_cabinet import cabinet_urdf, write_cabinet

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.finding import Finding
from manitwin.assets.audit.linkage.overlaps import find_overlaps
from manitwin.assets.audit.linkage.read import read_linkage
from manitwin.assets.audit.linkage.sweeps import sweep_joints
from manitwin.assets.audit.rules import RULES

PARTS = [rule for rule in RULES if rule.code in ("RUN009", "RUN010")]


def found(path: Path, *engines: str) -> list[Finding]:
    return list(audit_path(path, PARTS, engines=engines or ("mujoco",)).findings)


def urdf(folder: Path, *parts: tuple[str, str, str]) -> Path:
    """Two boxes of 0.2 m and more, each hung from the first by a joint: name, joint and origin."""
    shape = '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
    links = "".join(f'<link name="{name}">{shape}</link>' for name in ("base", *(name for name, _, _ in parts)))
    joints = "".join(
        f'<joint name="to_{name}" type="{kind}"><parent link="base"/><child link="{name}"/><origin xyz="{xyz}"/>'
        '<axis xyz="0 0 1"/><limit lower="0" upper="0.1" effort="1" velocity="1"/></joint>'
        for name, kind, xyz in parts
    )
    path = folder / "boxes.urdf"
    path.write_text(f'<robot name="boxes">{links}{joints}</robot>')
    return path


def mjcf(folder: Path, inside: str, after: str = "") -> Path:
    path = folder / "scene.xml"
    path.write_text(f"<mujoco><worldbody>{inside}</worldbody>{after}</mujoco>")
    return path


def test_parts_that_no_joint_joins_are_as_deep_in_each_other_as_boxes_are(tmp_path: Path) -> None:
    path = urdf(tmp_path, ("left", "prismatic", "0.3 0 0"), ("right", "prismatic", "0.45 0 0"))
    linkage = read_linkage(path, "urdf")
    assert linkage is not None
    (overlap,) = find_overlaps(linkage)
    assert {overlap.one, overlap.other} == {"left", "right"} and overlap.depth_m == pytest.approx(0.05, abs=1e-4)
    (finding,) = found(path)
    assert finding.code == "RUN009" and "50 mm" in finding.message
    assert found(path, "pybullet") == [], "which lets links of a URDF pass through each other"


def test_parts_that_fixed_joints_join_are_one_and_overlap_as_they_like(tmp_path: Path) -> None:
    path = urdf(tmp_path, ("left", "fixed", "0.3 0 0"), ("right", "fixed", "0.45 0 0"))
    linkage = read_linkage(path, "urdf")
    assert linkage is not None and len(linkage.parts) == 1
    assert found(path) == []


def test_a_part_inside_what_holds_it_is_told_where_the_joint_moves_it_out(tmp_path: Path) -> None:
    path = urdf(tmp_path, ("plug", "prismatic", "0.05 0.05 0.05"))
    path.write_text(path.read_text().replace('upper="0.1"', 'upper="0.2"'))
    (finding,) = found(path)
    assert finding.code == "RUN009" and "which joint 'to_plug' moves it out of" in finding.message


def test_without_engines_parts_are_not_looked_at(tmp_path: Path) -> None:
    path = urdf(tmp_path, ("left", "prismatic", "0.3 0 0"), ("right", "prismatic", "0.45 0 0"))
    assert audit_path(path, PARTS).findings == ()


def test_a_joint_starts_at_the_limit_that_is_nearest_to_zero(tmp_path: Path) -> None:
    path = urdf(tmp_path, ("left", "prismatic", "0.3 0 0"))
    path.write_text(path.read_text().replace('lower="0" upper="0.1"', 'lower="0.04" upper="0.1"'))
    linkage = read_linkage(path, "urdf")
    assert linkage is not None and linkage.joints[0].start == 0.04
    assert linkage.parts[1].shapes[0][:, 2].min() == pytest.approx(-0.06)


def test_a_cabinet_on_a_base_that_stands_fast_is_as_sound(tmp_path: Path) -> None:
    path = tmp_path / "cabinet.urdf"
    path.write_text(cabinet_urdf(fixed=True))
    assert found(path) == []


def test_a_drawer_that_slides_the_wrong_way_goes_through_the_back(tmp_path: Path) -> None:
    path = write_cabinet(tmp_path)
    path.write_text(path.read_text().replace('<axis xyz="0.0 -1.0 0.0"/>', '<axis xyz="0 1 0"/>'))
    linkage = read_linkage(path, "urdf")
    assert linkage is not None
    shares = {entry.joint.name: entry.crossing for entry in sweep_joints(linkage)}
    assert shares["slide"] > 0.5 and shares["hinge"] < 0.1 and "press" not in shares, "a button is pressed"
    (finding,) = found(path)
    assert finding.code == "RUN010" and "drives" in finding.message and "'drawer' through 'cabinet'" in finding.message


def test_a_wheel_that_turns_in_its_fork_passes_through_nothing(tmp_path: Path) -> None:
    wheel = (
        '<collision><origin rpy="1.5708 0 0"/><geometry><cylinder radius="0.1" length="0.04"/></geometry></collision>'
    )
    fork = '<collision><origin xyz="0 0 0.06"/><geometry><box size="0.06 0.06 0.1"/></geometry></collision>'
    path = tmp_path / "caster.urdf"
    path.write_text(
        f'<robot name="r"><link name="fork">{fork}</link><link name="wheel">{wheel}</link><joint name="turn"'
        ' type="continuous"><parent link="fork"/><child link="wheel"/><axis xyz="0 1 0"/></joint></robot>'
    )
    assert found(path) == []


BALL = '<body name="{}" pos="{}"><freejoint/><geom name="{}" size="0.05" {}/></body>'


def test_overlaps_of_mjcf_are_mujocos_own_with_the_ground(tmp_path: Path) -> None:
    ground = '<geom type="plane" size="1 1 0.1"/>'
    one, other = BALL.format("one", "0 0 0.03", "a", ""), BALL.format("other", "0.5 0 0.06", "b", "")
    (finding,) = found(mjcf(tmp_path, ground + one + other))
    assert finding.code == "RUN009" and "'one' lies 20 mm in the ground" in finding.message
    assert "other" not in finding.message


def test_what_an_mjcf_excludes_or_masks_does_not_overlap(tmp_path: Path) -> None:
    one, other = BALL.format("one", "0 0 0", "a", "{}"), BALL.format("other", "0.06 0 0", "b", "{}")
    plain = (one + other).replace("{}", "")
    masked = (one + other).replace("{}", 'contype="2" conaffinity="4"')
    assert [each.code for each in found(mjcf(tmp_path, plain))] == ["RUN009"]
    assert found(mjcf(tmp_path, masked)) == []
    assert found(mjcf(tmp_path, plain, '<contact><exclude body1="one" body2="other"/></contact>')) == []


def test_a_keyframe_that_starts_apart_is_taken_for_the_start(tmp_path: Path) -> None:
    plain = BALL.format("one", "0 0 0", "a", "") + BALL.format("other", "0.06 0 0", "b", "")
    apart = '<keyframe><key qpos="0 0 0 1 0 0 0 1 0 0 1 0 0 0"/></keyframe>'
    assert found(mjcf(tmp_path, plain, apart)) == []


def test_a_door_of_an_mjcf_is_swept_about_its_hinge(tmp_path: Path) -> None:
    def scene(range_: str) -> str:
        door = f'<body name="door" pos="0.3 0 0"><joint name="hinge" pos="-0.2 0 0" axis="0 0 1" range="{range_}"/>'
        wall = '<geom type="box" size="0.02 0.2 0.2" pos="0.25 0.3 0"/>'
        return f'<body name="frame">{wall}{door}<geom type="box" size="0.2 0.005 0.2"/></body></body>'

    (finding,) = found(mjcf(tmp_path, scene("0 170")))
    assert finding.code == "RUN010" and "joint 'hinge'" in finding.message
    assert found(mjcf(tmp_path, scene("-170 0"))) == []


@pytest.mark.parametrize(("said", "codes"), [("false", []), ("true", ["RUN009"])])
def test_links_of_sdf_collide_where_it_says_so(tmp_path: Path, said: str, codes: list[str]) -> None:
    shape = "<collision name='c'><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision>"
    links = "".join(
        f"<link name='{name}'><pose>{x} 0 0 0 0 0</pose>{shape}</link>"
        for name, x in (("a", 0), ("b", 0.3), ("c", 0.45))
    )
    joints = "".join(
        f"<joint name='to_{end}' type='prismatic'><parent>a</parent><child>{end}</child><axis><xyz>0 0 1</xyz>"
        "<limit><lower>0</lower><upper>0.1</upper></limit></axis></joint>"
        for end in "bc"
    )
    path = tmp_path / "model.sdf"
    path.write_text(
        f"<sdf version='1.7'><model name='m'><self_collide>{said}</self_collide>{links}{joints}</model></sdf>"
    )
    assert [each.code for each in found(path)] == codes


def test_the_axis_of_an_sdf_joint_is_in_the_childs_frame(tmp_path: Path) -> None:
    shape = "<collision name='c'><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision>"
    turned = "<pose>0.3 0 0 0 0 1.5707963267948966</pose>"
    path = tmp_path / "model.sdf"
    path.write_text(
        f"<sdf version='1.7'><model name='m'><link name='a'>{shape}</link><link name='b'>{turned}{shape}</link><joint name='j'"
        " type='revolute'><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint></model></sdf>"
    )
    linkage = read_linkage(path, "sdf")
    assert linkage is not None
    assert np.allclose(linkage.joints[0].axis, [0, 1, 0], atol=1e-9) and np.allclose(
        linkage.joints[0].point, [0.3, 0, 0]
    )
