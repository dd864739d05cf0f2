"""Which bodies of an MJCF file are the object, and which stand fast or are left out."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from written_mjcf import mjcf, wedge

from manitwin.assets.joints import Joints
from manitwin.assets.read import read_asset
from manitwin.errors import AssetError


def test_replicated_bodies_are_written_out_and_the_first_is_read(tmp_path: Path) -> None:
    body = '<body name="b"><freejoint/><geom size="0.02"/></body>'
    asset = read_asset(mjcf(tmp_path, f'<replicate count="3" offset="0.1 0 0">{body}</replicate>'))
    assert len(asset.collision) == 1 and len(asset.remarks) == 2
    many = read_asset(mjcf(tmp_path, f'<replicate count="400" offset="0.1 0 0">{body}</replicate>'))
    assert len(many.remarks) == 1 and "398 more bodies" in many.remarks[0]
    nested = f'<replicate count="1000"><replicate count="1000">{body}</replicate></replicate>'
    with pytest.raises(AssetError, match="no single object"):
        read_asset(mjcf(tmp_path, nested))


def test_shapes_of_the_world_stand_fast_and_planes_alone_are_sheets(tmp_path: Path) -> None:
    table = read_asset(mjcf(tmp_path, '<geom type="plane" size="0 0 1"/><geom type="box" size="0.3 0.2 0.1"/>'))
    assert table.static and np.allclose(np.ptp(table.visual[0].vertices, axis=0), [0.6, 0.4, 0.2])
    ground = read_asset(mjcf(tmp_path, '<geom type="plane" size="2 0 1"/>'))
    assert ground.static and np.allclose(ground.visual[0].bounds, [[-2, -0.5, -1e-3], [2, 0.5, 0]])
    moving = read_asset(mjcf(tmp_path, '<geom type="plane" size="2 2 1"/><body name="ball"><geom size="0.02"/></body>'))
    assert moving.name == "ball" and not moving.static


def test_what_a_free_joint_lets_go_is_the_object_and_what_has_no_joint_beside_it_stands_fast(tmp_path: Path) -> None:
    table = '<body name="table"><geom type="box" size="0.3 0.3 0.1"/></body>'
    ball = '<body name="ball"><freejoint/><geom size="0.02"/></body>'
    assert read_asset(mjcf(tmp_path, table + ball)).name == "ball"
    door = '<body name="door"><joint/><geom type="box" size="0.3 0.3 0.01"/></body>'
    cabinet = read_asset(mjcf(tmp_path, table.replace("</body>", f"{door}</body>")))
    assert cabinet.name == "table" and cabinet.static
    assert read_asset(mjcf(tmp_path, table + table.replace("table", "shelf") + door)).name == "door"
    assert not read_asset(mjcf(tmp_path, table)).static  # a program that loads it adds the joint
    assert read_asset(mjcf(tmp_path, table + table.replace("table", "shelf"))).static  # and to scenery none


@pytest.mark.parametrize("joints", ["part", "lock", "keep"])
def test_where_nothing_is_free_what_has_joints_is_the_object_and_not_the_table(tmp_path: Path, joints: Joints) -> None:
    table = '<body name="table"><geom type="box" size="0.3 0.3 0.1"/></body>'
    knob = '<body name="knob"><joint/><geom type="box" size="0.05 0.01 0.01" mass="0.1"/></body>'
    faucet = f'<body name="faucet"><geom type="cylinder" size="0.02 0.1"/>{knob}</body>'
    asset = read_asset(mjcf(tmp_path, table + faucet + "<body><geom size='0.1'/></body>"), joints=joints)
    assert asset.name == "faucet" and len(asset.visual) == (1 if joints == "part" else 2)
    assert "body 'table' is static and was left out: one rigid object is read" in asset.remarks
    assert "an unnamed body is static and was left out: one rigid object is read" in asset.remarks
    assert ("body 'knob' has joints and was left out: one rigid object is read" in asset.remarks) == (joints == "part")
    ball = '<body name="ball"><freejoint/><geom size="0.02"/></body>'
    free = read_asset(mjcf(tmp_path, table + faucet + ball + ball.replace("ball", "other")), joints=joints)
    assert free.name == "ball" and any("'other' moves by itself" in remark for remark in free.remarks)


def test_meshes_of_bodies_that_are_left_out_are_not_read(tmp_path: Path) -> None:
    wedge().export(tmp_path / "wedge.stl")
    (tmp_path / "broken.stl").write_bytes(b"solid nothing")
    meshes = '<asset><mesh file="wedge.stl" scale=".01 .01 .01"/>' + "".join(
        f'<mesh name="m{n}" file="broken.stl"/>' for n in range(4)
    )
    links = "".join(f'<body><joint axis="0 0 1"/><geom type="mesh" mesh="m{n}"/></body>' for n in range(4))
    body = f'<body name="foot"><geom type="mesh" mesh="wedge" density="500"/>{links}</body>'
    path = mjcf(tmp_path, body, f"{meshes}</asset>")
    asset = read_asset(path)
    assert np.allclose(np.ptp(asset.visual[0].vertices, axis=0), np.ptp(wedge().vertices, axis=0) / 100)
    assert asset.inertial.mass_kg == pytest.approx(500 * wedge().volume / 1e6, rel=1e-5)
    assert asset.partial and len(asset.remarks) == 2
    broken = mjcf(tmp_path, body.replace('mesh="wedge"', 'mesh="m0"'), f"{meshes}</asset>")
    with pytest.raises(AssetError, match=r"broken\.stl"):
        read_asset(broken)


def test_a_plane_of_a_body_stands_fast_though_no_joint_is_in_the_file(tmp_path: Path) -> None:
    assert read_asset(mjcf(tmp_path, '<body name="floor"><geom type="plane" size="1 1 1"/></body>')).static


def test_a_file_of_composites_alone_says_what_they_are(tmp_path: Path) -> None:
    rope = '<body><composite type="cable" count="9 1 1" size="1"><geom type="capsule" size="0.01"/></composite></body>'
    with pytest.raises(AssetError, match="those of <composite>, which bends"):
        read_asset(mjcf(tmp_path, rope))
    beside = read_asset(mjcf(tmp_path, f'{rope}<body name="ball"><freejoint/><geom size="0.1"/></body>'))
    assert beside.name == "ball" and any("<composite> is no rigid body" in remark for remark in beside.remarks)
