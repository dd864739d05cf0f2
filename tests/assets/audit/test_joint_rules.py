"""What is wrong with joints is found in each format, and what may be meant is not."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from pxr import Usd, UsdGeom, UsdPhysics

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.rules import RULES

SHAPE = (
    '<inertial><mass value="1"/><inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>'
    '<collision><geometry><box size="0.2 0.2 0.2"/></geometry></collision>'
)
SDF_SHAPE = "<collision name='c'><geometry><box><size>0.2 0.2 0.2</size></box></geometry></collision>"


def joint_findings(path: Path) -> dict[str, str]:
    return {f.code: f.message for f in audit_path(path, RULES).findings if f.code.startswith("JNT")}


def urdf(folder: Path, inside: str, kind: str = "revolute") -> Path:
    path = folder / "lid.urdf"
    joint = f'<joint name="hinge" type="{kind}"><parent link="box"/><child link="lid"/>{inside}</joint>'
    path.write_text(f'<robot name="r"><link name="box">{SHAPE}</link><link name="lid">{SHAPE}</link>{joint}</robot>')
    return path


LIMIT = '<limit lower="0" upper="1.5" effort="1" velocity="1"/>'


@pytest.mark.parametrize(
    ("inside", "kind", "code", "says"),
    [
        (f'<axis xyz="0 0 0"/>{LIMIT}', "revolute", "JNT001", "'hinge' has the axis 0 0 0"),
        (f'<axis xyz="0 up 1"/>{LIMIT}', "prismatic", "JNT001", "nan"),
        ('<limit lower="1.5" upper="0"/>', "revolute", "JNT002", "are 1.5 and 0"),
        ('<limit lower="none" upper="0"/>', "prismatic", "JNT002", "nan"),
        ('<limit lower="-90" upper="90"/>', "revolute", "JNT003", "from -90 to 90 rad, which looks like degrees"),
        ('<axis xyz="0 0 1"/>', "prismatic", "JNT004", "is prismatic and has no <limit>"),
        ('<limit effort="1" velocity="1"/>', "revolute", "JNT005", "are 0: it cannot move"),
        (f'{LIMIT}<mimic joint="gone"/>', "revolute", "JNT006", "mimics 'gone', which the file does not have"),
        (f'<axis xyz="0 0 2"/>{LIMIT}', "revolute", "JNT007", "has the length 2"),
    ],
)  # fmt: skip
def test_a_wrong_joint_is_found_once(tmp_path: Path, inside: str, kind: str, code: str, says: str) -> None:
    found = joint_findings(urdf(tmp_path, inside, kind))
    assert set(found) == {code} and says in found[code]


@pytest.mark.parametrize(
    ("inside", "kind"),
    [
        (LIMIT, "revolute"),
        ('<axis xyz="0 0 0"/>', "fixed"),
        ('<axis xyz="0 1 0"/>', "continuous"),
        ('<limit effort="1" velocity="1"/>', "continuous"),
        ('<limit lower="-62.831853" upper="62.831853"/>', "revolute"),
        ('<limit lower="-12.5" upper="12.5"/>', "revolute"),
        ('<limit lower="0" upper="90"/>', "prismatic"),
        (f'<axis xyz="0.577 0.577 0.577"/>{LIMIT}', "revolute"),
        ("", "floating"),
    ],
)
def test_a_joint_that_may_be_meant_is_not(tmp_path: Path, inside: str, kind: str) -> None:
    assert joint_findings(urdf(tmp_path, inside, kind)) == {}


def test_many_joints_are_one_finding_of_a_cause(tmp_path: Path) -> None:
    links = "".join(f'<link name="l{n}">{SHAPE}</link>' for n in range(7))
    joints = "".join(
        f'<joint name="j{n}" type="revolute"><parent link="l{n}"/><child link="l{n + 1}"/></joint>' for n in range(6)
    )
    path = tmp_path / "arm.urdf"
    path.write_text(f'<robot name="r">{links}{joints}</robot>')
    (found,) = [f for f in audit_path(path, RULES).findings if f.code == "JNT004"]
    assert found.message.endswith("; and 3 more") and found.values == {"joints": [f"j{n}" for n in range(6)]}


@pytest.mark.parametrize(
    ("range_", "compiler", "found"),
    [
        ("-1.5708 1.5708", "", True),
        ("0 3.14159", "", True),
        ("-1.5708 1.5708", '<compiler angle="radian"/>', False),
        ("-90 90", "", False),
        ("-3 3", "", False),
        ("-90 90", '<compiler angle="radian"/>', True),
    ],
)
def test_mjcf_has_degrees_unless_it_says_radian(tmp_path: Path, range_: str, compiler: str, found: bool) -> None:
    path = tmp_path / "lid.xml"
    lid = f'<body><joint name="hinge" limited="true" range="{range_}"/><geom size="0.1" mass="1"/></body>'
    path.write_text(
        f'<mujoco>{compiler}<worldbody><body><freejoint/><geom size="0.1" mass="1"/>{lid}</body></worldbody></mujoco>'
    )
    assert ("JNT003" in joint_findings(path)) == found


@pytest.mark.parametrize(
    ("lower", "upper", "axis", "code"),
    [
        (0.0, 90.0, "X", None),
        (-1000.0, 1000.0, "X", None),
        (0.0, 1.5707964, "X", "JNT003"),
        (90.0, 0.0, "X", "JNT002"),
        (math.nan, 90.0, "X", "JNT002"),
        (30.0, 30.0, "X", "JNT005"),
        (0.0, 90.0, "W", "JNT001"),
    ],
)
def test_joints_of_usd_have_degrees(tmp_path: Path, lower: float, upper: float, axis: str, code: str | None) -> None:
    stage = Usd.Stage.CreateNew(str(tmp_path / "box.usda"))
    stage.SetDefaultPrim(UsdGeom.Xform.Define(stage, "/box").GetPrim())
    for name in ("body", "lid"):
        UsdPhysics.RigidBodyAPI.Apply(UsdGeom.Cube.Define(stage, f"/box/{name}").GetPrim())
    joint = UsdPhysics.RevoluteJoint.Define(stage, "/box/hinge")
    joint.CreateBody0Rel().SetTargets(["/box/body"])
    joint.CreateBody1Rel().SetTargets(["/box/lid"])
    joint.CreateLowerLimitAttr(lower)
    joint.CreateUpperLimitAttr(upper)
    joint.CreateAxisAttr(axis)
    stage.Save()
    assert set(joint_findings(tmp_path / "box.usda")) == ({code} if code else set())


@pytest.mark.parametrize(
    ("axis", "code"),
    [
        ("<xyz>0 0 0</xyz>", "JNT001"),
        ("<xyz>0 0 1</xyz><limit><lower>2</lower><upper>1</upper></limit>", "JNT002"),
        ("<xyz>0 0 1</xyz><limit><lower>-1e16</lower><upper>1e16</upper></limit>", None),
        ("<xyz>0 0 1</xyz>", None),
    ],
)
def test_joints_of_sdf_are_held_against_the_same_rules(tmp_path: Path, axis: str, code: str | None) -> None:
    path = tmp_path / "model.sdf"
    joint = f"<joint name='j' type='revolute'><parent>a</parent><child>b</child><axis>{axis}</axis></joint>"
    links = "".join(f"<link name='{name}'>{SDF_SHAPE}</link>" for name in "ab")
    path.write_text(f"<sdf version='1.6'><model name='m'>{links}{joint}</model></sdf>")
    assert set(joint_findings(path)) == ({code} if code else set())
