"""MJCF files that include or attach others."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from written_mjcf import mjcf, wedge

from manitwin.assets.read import read_asset
from manitwin.errors import AssetError


def test_include_is_put_in_and_another_body_is_left_out(tmp_path: Path) -> None:
    (tmp_path / "body.xml").write_text(
        '<mujoco><worldbody><body name="a"><geom size="0.1"/></body></worldbody></mujoco>'
    )
    path = tmp_path / "scene.xml"
    path.write_text(
        '<mujoco><include file="body.xml"/><worldbody><body name="b"><geom size="0.1"/></body></worldbody></mujoco>'
    )
    asset = read_asset(path)
    assert asset.name == "a" and any("'b'" in remark for remark in asset.remarks)


def test_a_mesh_of_an_included_document_is_beside_the_main_one_or_beside_itself(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "a.xml").write_text('<mujoco><asset><mesh name="b" file="../parts/b.stl"/></asset></mujoco>')
    before, geom = '<include file="parts/a.xml"/>', '<body><freejoint/><geom type="mesh" mesh="b" mass="1"/></body>'
    trimesh.creation.box([1, 1, 1]).export(tmp_path / "parts" / "b.stl")
    for folder, size in (("parts", 1.0), ("", 2.0)):
        trimesh.creation.box([size] * 3).export(tmp_path / folder / "c.stl")
        path = mjcf(tmp_path, geom, before)
        (tmp_path / "parts" / "a.xml").write_text('<mujoco><asset><mesh name="b" file="c.stl"/></asset></mujoco>')
        theirs = mujoco.MjModel.from_xml_path(str(path))
        asset = read_asset(path)
        assert asset.lenient == () and np.allclose(asset.visual[0].extents, size)
        assert np.isclose(np.ptp(theirs.mesh_vert[:, 0]), size)


def test_attached_models_are_read_where_mujoco_puts_them(tmp_path: Path) -> None:
    (tmp_path / "parts" / "meshes").mkdir(parents=True)
    wedge().export(tmp_path / "parts" / "meshes" / "wedge.stl")
    (tmp_path / "parts" / "handle.xml").write_text(
        '<mujoco model="handle"><compiler meshdir="meshes" angle="radian"/>'
        '<asset><mesh file="wedge.stl" scale=".01 .01 .01"/></asset>'
        '<worldbody><body name="grip" euler="0.5 0 0"><geom type="mesh" mesh="wedge" density="300"/></body></worldbody></mujoco>'
    )
    before = '<asset><model name="handle" file="parts/handle.xml"/></asset>'
    attach = '<frame pos="0 0 0.2" euler="0 90 0"><attach model="handle" body="grip" prefix="left_"/></frame>'
    path = mjcf(
        tmp_path, f'<body name="door"><freejoint/><geom type="box" size=".1 .2 .3" mass="2"/>{attach}</body>', before
    )
    asset = read_asset(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert asset.inertial.mass_kg == pytest.approx(model.body_subtreemass[1])
    assert np.allclose(asset.inertial.center_of_mass_m, data.subtree_com[1], atol=1e-9)
    in_world = model.mesh_vert @ data.geom_xmat[1].reshape(3, 3).T + data.geom_xpos[1]
    assert np.allclose(asset.collision[1].vertices.min(0), in_world.min(0), atol=1e-6)
    assert tmp_path / "parts" / "handle.xml" in asset.files


def test_replicated_and_own_attachments_are_written_out(tmp_path: Path) -> None:
    (tmp_path / "peg.xml").write_text(
        '<mujoco model="peg"><worldbody><body name="peg"><freejoint/><geom size=".02"/></body></worldbody></mujoco>'
    )
    before = '<asset><model file="peg.xml"/></asset>'
    row = '<replicate count="3" offset=".1 0 0"><attach model="peg" body="peg" prefix="a_"/></replicate>'
    assert any("2 more bodies" in r or "a_peg" in r for r in read_asset(mjcf(tmp_path, row, before)).remarks)
    part = '<frame name="part"><geom name="g" size=".1"/></frame>'
    again = '<frame pos="1 0 0"><attach frame="part" prefix="again_"/></frame>'
    assert len(read_asset(mjcf(tmp_path, f'<body name="x">{part}{again}</body>')).collision) == 2


@pytest.mark.parametrize(
    ("child", "cause"),
    [
        (None, "is not there"),
        ('<mujoco><asset><model name="o" file="object.xml"/></asset><worldbody/></mujoco>', "attaches itself"),
        ("<robot/>", "not <mujoco>"),
        ('<mujoco><worldbody><body name="other"/></worldbody></mujoco>', "could not find"),
    ],
)
def test_what_cannot_be_attached_is_said(tmp_path: Path, child: str | None, cause: str) -> None:
    if child is not None:
        (tmp_path / "child.xml").write_text(child)
    before = '<asset><model name="c" file="child.xml"/></asset>'
    path = mjcf(tmp_path, '<body><geom size=".1"/><attach model="c" body="peg" prefix="a_"/></body>', before)
    with pytest.raises(AssetError, match=cause):
        read_asset(path)


def test_attachments_that_multiply_are_refused_before_they_are_written_out(tmp_path: Path) -> None:
    for number in range(8):
        inner = "<geom size='1'/>" if number == 0 else (
            "".join(f'<attach model="m" prefix="{i}_"/>' for i in range(10))
        )  # fmt: skip
        asset = "" if number == 0 else f'<asset><model name="m" file="m{number - 1}.xml"/></asset>'
        (tmp_path / f"m{number}.xml").write_text(f"<mujoco>{asset}<worldbody><body>{inner}</body></worldbody></mujoco>")
    with pytest.raises(AssetError, match="elements"):
        read_asset(tmp_path / "m7.xml")
