"""What moves by joints is taken whole where they are locked: its shape, mass, centre and inertia as MuJoCo has all of it."""

from __future__ import annotations

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest
from typer.testing import CliRunner

from manitwin.assets.asset import Asset
from manitwin.assets.read import read_asset
from manitwin.cli.main import app
from manitwin.errors import AssetError

INERTIA = '<inertia ixx="0.002" iyy="0.003" izz="0.004" ixy="0" ixz="0" iyz="0"/>'
URDF = f"""<robot name="box with a lid">
<link name="box"><inertial><mass value="0.5"/>{INERTIA}</inertial>
<visual><geometry><box size="0.2 0.1 0.1"/></geometry></visual>
<collision><geometry><box size="0.2 0.1 0.1"/></geometry></collision></link>
<link name="lid"><inertial><origin xyz="0.1 0 0"/><mass value="0.25"/>{INERTIA}</inertial>
<visual><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.1 0.02"/></geometry></visual>
<collision><origin xyz="0.1 0 0"/><geometry><box size="0.2 0.1 0.02"/></geometry></collision></link>
<joint name="hinge" type="revolute"><parent link="box"/><child link="lid"/><origin xyz="-0.1 0 0.06" rpy="0 -1.57079632679 0"/>
<axis xyz="0 1 0"/><limit lower="0" upper="1.57" effort="1" velocity="1"/></joint>
</robot>"""
SDF = """<sdf version="1.9"><model name="box with a lid">
<link name="box"><inertial><mass>0.5</mass></inertial>
<visual name="v"><geometry><box><size>0.2 0.1 0.1</size></box></geometry></visual></link>
<link name="lid"><pose>0 0 0.06 0 0 0</pose><inertial><mass>0.25</mass></inertial>
<visual name="v"><geometry><box><size>0.2 0.1 0.02</size></box></geometry></visual></link>
<joint name="hinge" type="revolute"><parent>box</parent><child>lid</child><axis><xyz>0 1 0</xyz></axis></joint>
</model></sdf>"""


def written(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def bounds(asset: Asset) -> np.ndarray:
    corners = np.concatenate([part.vertices for part in asset.visual])
    return np.array([corners.min(0), corners.max(0)])


def test_a_urdf_is_one_body_as_mujoco_has_it_at_zero(tmp_path: Path) -> None:
    path = written(tmp_path, "box.urdf", URDF)
    assert len(read_asset(path).visual) == 1 and read_asset(path).partial
    whole = read_asset(path, joints="lock")
    assert len(whole.visual) == len(whole.collision) == 2 and not whole.partial
    assert whole.remarks == ("joints were locked as the file stands, so that it is one rigid body: hinge",)
    assert np.allclose(bounds(whole), [[-0.11, -0.05, -0.05], [0.1, 0.05, 0.26]], atol=1e-9), "the lid stands open"
    root = mujoco.MjSpec.from_file(str(path))
    root.bodies[1].add_freejoint()
    model = root.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert whole.inertial.mass_kg == pytest.approx(0.75)
    center = whole.inertial.center_of_mass_m
    assert center is not None and np.allclose(center, data.subtree_com[0] - data.xpos[1], atol=1e-6)


def test_an_mjcf_is_one_body_but_for_what_is_free(tmp_path: Path) -> None:
    shape = '<geom name="l" type="box" size="0.1 0.05 0.01" mass="0.25"/>'
    lid = f'<body name="lid" pos="0 0 0.1"><joint name="hinge"/>{shape}</body>'
    box = f'<body name="box"><freejoint/><geom name="b" type="box" size="0.1 0.05 0.05" mass="0.5"/>{lid}</body>'
    other = '<body name="ball" pos="1 0 0"><freejoint/><geom size="0.1" mass="9"/></body>'
    path = written(tmp_path, "box.xml", f"<mujoco><worldbody>{box}{other}</worldbody></mujoco>")
    whole = read_asset(path, joints="lock")
    assert len(whole.collision) == 2 and whole.inertial.mass_kg == pytest.approx(0.75)
    assert np.allclose(whole.inertial.center_of_mass_m, [0, 0, 0.1 / 3])
    assert any("locked" in remark and "hinge" in remark for remark in whole.remarks)
    assert any("'ball' moves by itself" in remark for remark in whole.remarks)


def test_an_sdf_is_one_body(tmp_path: Path) -> None:
    path = written(tmp_path, "model.sdf", SDF)
    whole = read_asset(path, joints="lock")
    assert len(whole.visual) == 2 and whole.inertial.mass_kg == pytest.approx(0.75)
    assert np.allclose(bounds(whole)[:, 2], [-0.05, 0.07]) and any("hinge" in remark for remark in whole.remarks)
    assert len(read_asset(path).visual) == 1


def test_joints_of_formats_without_any_are_not_locked(tmp_path: Path) -> None:
    path = written(tmp_path, "thing.urdf", '<robot name="r"><link name="l"><extra_info/></link></robot>')
    with pytest.raises(AssetError, match="urdf, mjcf, sdf, usd; embodiedgen is read as it stands"):
        read_asset(path, joints="lock")


def test_import_takes_the_whole_and_says_so(tmp_path: Path) -> None:
    path = written(tmp_path, "box.urdf", URDF)
    done = CliRunner().invoke(app, ["import", str(path), "-o", str(tmp_path / "in"), "--lock-joints"])
    assert done.exit_code == 0 and "joints were locked" in " ".join(done.output.split())
    (record,) = (tmp_path / "in").glob("*/import.json")
    assert json.loads(record.read_text())["mass_kg"] == pytest.approx(0.75)
