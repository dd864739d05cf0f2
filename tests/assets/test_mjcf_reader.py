from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.rules import RULES
from manitwin.assets.joints import Joints
from manitwin.assets.read import read_asset
from manitwin.errors import AssetError
from manitwin.formats.meshes.textures import material_of


def mjcf(folder: Path, worldbody: str, before: str = "", name: str = "object.xml") -> Path:
    """Write an MJCF file."""
    path = folder / name
    path.write_text(f"<mujoco>{before}<worldbody>{worldbody}</worldbody></mujoco>")
    return path


def wedge() -> trimesh.Trimesh:
    """A solid without symmetry, off its origin."""
    return trimesh.convex.convex_hull(np.array([[5, 0, 0], [8, 0, 0], [5, 2, 0], [5, 0, 1.0], [6, 1, 1]]))


def test_mesh_stands_where_mujoco_puts_it(tmp_path: Path) -> None:
    wedge().export(tmp_path / "wedge.stl")
    asset_xml = (
        '<asset><mesh file="wedge.stl" scale="0.01 0.02 -0.01" refpos="0.1 0.2 0.3" refquat="0.6 0.8 0 0"/></asset>'
    )
    geom = '<geom type="mesh" mesh="wedge" pos="0.1 0 0" euler="30 40 50"/>'
    path = mjcf(tmp_path, f'<body pos="1 2 3"><body pos="0 0 0.5" euler="0 90 0">{geom}</body></body>', asset_xml)
    shape = read_asset(path).collision[0]
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    in_world = model.mesh_vert @ data.geom_xmat[0].reshape(3, 3).T + data.geom_xpos[0]
    expected = in_world - [1, 2, 3]  # the asset's axes are those of its first body
    for vertices in (shape.vertices, read_asset(path).visual[0].vertices):
        assert np.allclose(vertices.min(0), expected.min(0), atol=1e-6)
        assert np.allclose(vertices.max(0), expected.max(0), atol=1e-6)
    assert trimesh.Trimesh(shape.vertices, shape.faces).volume > 0  # mirrored, and wound outwards all the same


def test_inertial_is_what_the_file_says(tmp_path: Path) -> None:
    inertial = '<inertial pos="0.01 0 0.02" mass="0.3" fullinertia="2e-3 3e-3 4e-3 1e-4 2e-4 3e-4"/>'
    asset = read_asset(mjcf(tmp_path, f'<body><freejoint/>{inertial}<geom size="0.05"/></body>'))
    assert asset.inertial.mass_kg == pytest.approx(0.3)
    assert np.allclose(asset.inertial.center_of_mass_m, [0.01, 0, 0.02])
    tensor = [[2e-3, 1e-4, 2e-4], [1e-4, 3e-3, 3e-4], [2e-4, 3e-4, 4e-3]]  # MJCF order: xx yy zz xy xz yz
    assert np.allclose(asset.inertial.inertia_kg_m2, tensor, rtol=1e-9)


def test_mass_of_mujocos_own_density_is_not_declared(tmp_path: Path) -> None:
    asset = read_asset(mjcf(tmp_path, '<body><freejoint/><geom size="0.05"/></body>'))
    assert asset.inertial.mass_kg is None and asset.contact.friction_static is None


def test_mass_of_a_written_density_is_declared_and_said(tmp_path: Path) -> None:
    default = '<default><geom density="100" friction="0.8 0.01 0.001"/></default>'
    asset = read_asset(mjcf(tmp_path, '<body><freejoint/><geom size="0.05"/></body>', default))
    mass_kg = 100 * 4 / 3 * np.pi * 0.05**3
    assert asset.inertial.mass_kg == pytest.approx(mass_kg)
    assert np.allclose(asset.inertial.center_of_mass_m, 0, atol=1e-12)
    assert np.allclose(asset.inertial.inertia_kg_m2, 0.4 * mass_kg * 0.05**2 * np.eye(3), rtol=1e-9)
    assert asset.contact.friction_static == asset.contact.friction_dynamic == 0.8
    assert any("density" in remark for remark in asset.remarks)


def test_what_does_not_collide_is_visual(tmp_path: Path) -> None:
    geoms = (
        '<geom name="seen" type="box" size="0.1 0.1 0.1" contype="0" conaffinity="0" group="2"/>'
        '<geom name="hit" type="box" size="0.05 0.1 0.2" group="3"/><geom type="plane" size="1 1 1"/>'
    )
    asset = read_asset(mjcf(tmp_path, f"<body>{geoms}</body>"))
    assert [part.metadata["name"] for part in asset.visual] == ["seen"]
    assert [shape.name for shape in asset.collision] == ["hit"]
    assert np.allclose(np.ptp(asset.collision[0].vertices, axis=0), [0.1, 0.2, 0.4])
    assert any("planes" in remark for remark in asset.remarks)


def test_texture_of_the_material_is_on_the_mesh(tmp_path: Path) -> None:
    folder = tmp_path / "assets"
    folder.mkdir()
    (folder / "q.obj").write_text(
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nvt 0 0\nvt 1 0\nvt 0 1\nf 1/1 3/3 2/2\nf 1/1 2/2 4/3\nf 2/1 3/2 4/3\nf 1/1 4/2 3/3\n"
    )
    Image.new("RGB", (4, 4), (10, 200, 30)).save(folder / "paint.png")
    before = (
        '<compiler assetdir="assets"/><asset><texture name="t" type="2d" file="paint.png"/>'
        '<material name="m" texture="t"/><mesh name="q" file="q.obj"/></asset>'
    )
    asset = read_asset(mjcf(tmp_path, '<body><geom type="mesh" mesh="q" material="m"/></body>', before))
    texture = material_of(asset.visual[0]).baseColorTexture
    assert texture is not None and texture.getpixel((0, 0)) == (10, 200, 30)
    assert asset.visual[0].visual.uv is not None
    assert {file.name for file in asset.files} == {"q.obj", "paint.png", "object.xml"}


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


def test_mesh_that_is_not_there_is_missing(tmp_path: Path) -> None:
    asset_xml = '<asset><mesh name="m" file="../../gone.stl"/></asset>'
    geoms = '<geom type="mesh" mesh="m"/><geom size="0.1"/>'
    asset = read_asset(mjcf(tmp_path, f"<body>{geoms}</body>", asset_xml))
    assert asset.missing_files == ("../../gone.stl",) and len(asset.collision) == 1


@pytest.mark.parametrize(
    ("worldbody", "before"),
    [
        ('<body><geom size="nan"/></body>', ""),
        ('<body><geom size="1e300"/></body>', ""),
        ('<body><geom size="-1"/></body>', ""),
        ('<body><replicate count="1000000000"><geom size="1"/></replicate></body>', ""),
        ('<body><geom size="1"/></body>', '<include file="../other.xml"/>'),
        ('<body><geom size="1"/></body>', '<include file="object.xml"/>'),
        ('<body><geom type="mesh" mesh="none"/></body>', ""),
        ('<body><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 9"/><geom size="1"/></body>', ""),
        ("<body/>", ""),
    ],
)
def test_broken_mjcf_is_an_error_in_one_line(tmp_path: Path, worldbody: str, before: str) -> None:
    with pytest.raises(AssetError, match=r"object\.xml") as caught:
        read_asset(mjcf(tmp_path, worldbody, before))
    assert "\n" not in str(caught.value)


def test_entities_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.xml"
    path.write_text('<!DOCTYPE mujoco [<!ENTITY a "b">]><mujoco model="&a;"/>')
    with pytest.raises(AssetError, match="document type"):
        read_asset(path, "mjcf")


def test_what_programs_mend_before_mujoco_sees_it_is_read_and_said(tmp_path: Path) -> None:
    wedge().export(tmp_path / "wedge.stl")
    mesh = '<mesh name="w" file="wedge.stl" scale="0.01 0.01 0.01"/>'
    body = (
        '<body><joint damping="1e11"/><geom type="mesh" mesh="w" material="nowhere"/>'
        "<body><freejoint/><site/></body></body>".replace("<freejoint/>", '<joint type="slide"/>')
    )
    asset = read_asset(mjcf(tmp_path, body, f"<asset>{mesh}{mesh}</asset>"))
    assert len(asset.visual) == 1
    said = " ".join(asset.remarks)
    for words in ("written twice", "'nowhere' is nowhere written", "moves and has no mass"):
        assert words in said


def test_an_object_whose_meshes_are_not_there_lacks_files_and_is_no_broken_one(tmp_path: Path) -> None:
    body = '<body><freejoint/><geom type="mesh" mesh="w"/></body>'
    asset = read_asset(mjcf(tmp_path, body, '<asset><mesh name="w" file="gone.stl"/></asset>'))
    assert asset.missing_files == ("gone.stl",) and asset.visual == () and asset.inertial.mass_kg is None
    known = '<geom size="0.1" density="50"/>'
    for name, mass in (("gone.stl", None), ("gone.png", 50 * 4 / 3 * np.pi * 0.1**3)):
        kind = f'<mesh name="w" file="{name}"/>' if mass is None else f'<texture type="2d" name="w" file="{name}"/>'
        half = '<geom type="mesh" mesh="w"/>' if mass is None else ""
        found = read_asset(mjcf(tmp_path, f"<body><freejoint/>{known}{half}</body>", f"<asset>{kind}</asset>"))
        assert found.inertial.mass_kg == (None if mass is None else pytest.approx(mass))


def test_a_mass_of_geoms_in_several_bodies_is_combined_as_mujoco_has_it(tmp_path: Path) -> None:
    bodies = (
        '<body pos="1 0 0"><freejoint/><geom size="0.05" mass="0.2" pos="0.1 0 0"/>'
        '<body pos="0 0 0.3" euler="0 0 30"><geom type="box" size="0.1 0.05 0.02" mass="0.4"/></body></body>'
    )
    path = mjcf(tmp_path, bodies)
    inertial = read_asset(path).inertial
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert inertial.mass_kg == pytest.approx(float(model.body_subtreemass[1]))
    assert np.allclose(inertial.center_of_mass_m, data.subtree_com[1] - [1, 0, 0], atol=1e-9)
    spinning = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, spinning)
    about_origin = spinning[3:, 3:]  # of the free joint's turn, about the body's own origin
    c = inertial.center_of_mass_m
    moved = inertial.mass_kg * (c @ c * np.eye(3) - np.outer(c, c))
    assert np.allclose(inertial.inertia_kg_m2 + moved, about_origin, rtol=1e-6, atol=1e-9)


def test_a_mass_of_all_together_is_declared(tmp_path: Path) -> None:
    two = "".join(f'<body name="b{n}" pos="{n} 0 0"><joint/><geom size="0.1"/></body>' for n in range(2))
    assert read_asset(mjcf(tmp_path, two)).inertial.mass_kg is None
    whole = read_asset(mjcf(tmp_path, two, '<compiler settotalmass="14"/>'))
    assert whole.inertial.mass_kg == pytest.approx(7) and whole.inertial.computed


def test_a_mass_that_a_part_declares_is_declared(tmp_path: Path) -> None:
    pole = '<body pos="0 0 1"><geom type="box" size="0.05 0.05 0.05"/></body>'
    inertial = '<inertial pos="0 0 0" mass="10" diaginertia="1 1 1"/>'
    asset = read_asset(mjcf(tmp_path, f'<body><freejoint/>{inertial}<geom size="0.1"/>{pole}</body>'))
    assert asset.inertial.mass_kg == pytest.approx(11) and asset.inertial.computed
    assert any("a part of its mass is declared" in remark for remark in asset.remarks)


def test_replicated_bodies_are_written_out_and_the_first_is_read(tmp_path: Path) -> None:
    body = '<body name="b"><freejoint/><geom size="0.02"/></body>'
    asset = read_asset(mjcf(tmp_path, f'<replicate count="3" offset="0.1 0 0">{body}</replicate>'))
    assert len(asset.collision) == 1 and len(asset.remarks) == 2
    many = read_asset(mjcf(tmp_path, f'<replicate count="400" offset="0.1 0 0">{body}</replicate>'))
    assert len(many.remarks) == 1 and "398 more bodies" in many.remarks[0]
    nested = f'<replicate count="1000"><replicate count="1000">{body}</replicate></replicate>'
    with pytest.raises(AssetError, match="no single object"):
        read_asset(mjcf(tmp_path, nested))


def test_height_fields_soft_bodies_and_plugins_are_left_out_and_said(tmp_path: Path) -> None:
    before = (
        '<extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>'
        '<default><default class="ground"><geom type="hfield" hfield="hill"/></default></default>'
        '<asset><hfield name="hill" file="hill.png" size="1 1 1 1"/>'
        '<mesh name="torus"><plugin instance="t"/></mesh></asset>'
    )
    body = (
        '<geom class="ground"/><flexcomp name="cloth" type="grid" count="3 3 1" dim="2"/>'
        '<body name="thing"><freejoint/><geom size="0.02"/><geom type="sdf" mesh="torus"><plugin instance="t"/></geom></body>'
    )
    asset = read_asset(mjcf(tmp_path, body, before))
    assert asset.name == "thing" and len(asset.collision) == 1
    said = " ".join(asset.remarks)
    for words in ("height fields were left out", "<flexcomp> is no rigid body", "a plug-in computes"):
        assert words in said


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


def test_shapes_of_one_group_are_seen_alike_and_a_computed_inertia_is_not_judged(tmp_path: Path) -> None:
    legs = '<geom type="box" size="0.02 0.02 0.3" pos="0.3 0 -0.3" contype="0" conaffinity="0" density="100"/>'
    top = '<geom type="box" size="0.4 0.4 0.02" density="100"/>'
    table = read_asset(mjcf(tmp_path, f"<body>{legs}{top}</body>"))
    assert len(table.visual) == 2 and len(table.collision) == 1 and table.inertial.computed
    apart = read_asset(
        mjcf(tmp_path, f"<body>{legs.replace('contype', 'group=' + chr(34) + '1' + chr(34) + ' contype')}{top}</body>")
    )
    assert len(apart.visual) == 1  # the other group is collision alone
    bob = (
        '<geom type="capsule" size="0.01" fromto="0 0 0 0 0 -0.5" mass="0"/><geom size="0.05" pos="0 0 -0.5" mass="1"/>'
    )
    pendulum = mjcf(tmp_path, f"<body><joint/>{bob}</body>")
    assert "INE005" not in {finding.code for finding in audit_path(pendulum, RULES).findings}


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


def test_a_mesh_of_points_alone_is_their_hull_with_mujocos_mass(tmp_path: Path) -> None:
    points = np.random.default_rng(2).normal(size=(40, 3)) * [0.02, 0.03, 0.05]
    (tmp_path / "cloud.obj").write_text("".join(f"v {x} {y} {z}\n" for x, y, z in points))
    path = mjcf(
        tmp_path,
        '<body><freejoint/><geom type="mesh" mesh="cloud" density="700"/></body>',
        '<asset><mesh file="cloud.obj"/></asset>',
    )
    asset = read_asset(path)
    model = mujoco.MjModel.from_xml_path(str(path))
    assert asset.inertial.mass_kg == pytest.approx(model.body_mass[1], rel=1e-6)
    assert trimesh.Trimesh(asset.collision[0].vertices, asset.collision[0].faces).is_watertight
    assert any("40 points" in remark for remark in asset.remarks)
    (tmp_path / "cloud.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 1 1 0\n")
    with pytest.raises(AssetError, match="no volume"):
        read_asset(path)


def test_soft_bodies_alone_are_their_shape_at_rest_and_not_judged_as_rigid(tmp_path: Path) -> None:
    flex = (
        '<flexcomp name="sponge" type="grid" count="4 4 4" spacing=".02 .02 .02" dim="3" dof="radial" radius=".001" mass="1">'
        '<edge equality="true"/></flexcomp>'
    )
    path = mjcf(tmp_path, f'<body name="held" pos="0 0 1"><freejoint/>{flex}</body>')
    asset = read_asset(path)
    assert asset.soft and asset.name == "sponge" and not asset.collision
    assert np.allclose(np.ptp(asset.visual[0].vertices, axis=0), 0.06, atol=1e-6)
    found = {finding.code for finding in audit_path(path, RULES).findings}
    assert not found & {"COL001", "MAS001", "INE001", "FRI001"}
    wedge().export(tmp_path / "cloth.obj")
    cloth = '<flexcomp name="cloth" type="mesh" file="cloth.obj" dim="2" scale=".01 .01 .01" radius=".001"/>'
    seen = read_asset(mjcf(tmp_path, cloth)).visual[0].vertices
    assert np.allclose(seen.min(0), wedge().vertices.min(0) / 100, atol=1e-6)


def test_a_height_field_alone_is_its_surface(tmp_path: Path) -> None:
    heights = np.zeros((3, 4), np.uint8)
    heights[0, 3] = 255  # the upper right corner of the picture: +x, +y
    Image.fromarray(heights).save(tmp_path / "hill.png")
    before = '<asset><hfield name="hill" file="hill.png" size="2 1 .5 .1"/></asset>'
    asset = read_asset(mjcf(tmp_path, '<geom type="hfield" hfield="hill"/>', before))
    assert asset.static
    top = asset.visual[0].vertices[asset.visual[0].vertices[:, 2].argmax()]
    assert np.allclose(top, [2, 1, 0.5])


@pytest.mark.parametrize(
    ("made", "geom", "what"),
    [
        (
            'hfield name="a" nrow="100000" ncol="100000" size="1 1 1 1"',
            'type="hfield" hfield="a"',
            "height field of 1e+10",
        ),
        ('mesh name="a" builtin="cone" params="100000000 1"', 'type="mesh" mesh="a"', "built-in mesh of 1e+08"),
        ('mesh name="a" builtin="plate" params="50000 50000"', 'type="mesh" mesh="a"', "built-in mesh of 2.5e+09"),
        ('mesh name="a" builtin="supersphere" params="60000 1 1"', 'type="mesh" mesh="a"', "built-in mesh of 3.6e+09"),
    ],
)
def test_surfaces_of_too_many_points_are_refused_before_any_is_made(
    tmp_path: Path, made: str, geom: str, what: str
) -> None:
    with pytest.raises(AssetError, match=re.escape(f"a {what} points, more than 1000000")):
        read_asset(mjcf(tmp_path, f"<geom {geom}/>", f"<asset><{made}/></asset>"))


def test_lights_with_pictures_do_not_matter(tmp_path: Path) -> None:
    light = '<light type="image" texture="sky"/>'
    assert read_asset(mjcf(tmp_path, f'{light}<body><geom size=".1"/></body>')).collision


def test_soft_strings_are_rods_and_files_of_gmsh_are_read(tmp_path: Path) -> None:
    string = (
        '<flexcomp name="rope" type="grid" count="5 1 1" spacing=".1 1 1" dim="1" radius=".004" mass="1">'
        '<edge equality="true"/></flexcomp>'
    )
    rope = read_asset(mjcf(tmp_path, f'<body name="b">{string}</body>')).visual[0]
    assert np.allclose(np.ptp(rope.vertices, axis=0), [0.4, 0.008, 0.008], atol=1.5e-3)
    nodes = "1 0 0 0\n2 1 0 0\n3 0 1 0\n4 0 0 1"
    (tmp_path / "tetra.msh").write_text(
        f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n{nodes}\n$EndNodes\n"
        "$Elements\n1\n1 4 2 0 1 1 2 3 4\n$EndElements\n"
    )
    tetra = '<flexcomp name="t" type="gmsh" file="tetra.msh" dim="3" scale=".1 .1 .1" radius=".001"/>'
    asset = read_asset(mjcf(tmp_path, f'<body name="b">{tetra}</body>'))
    assert asset.soft and len(asset.visual[0].faces) == 4
    assert np.allclose(np.ptp(asset.visual[0].vertices, axis=0), 0.1)
    (tmp_path / "tetra.msh").write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n4\n")
    with pytest.raises(AssetError, match="MuJoCo cannot read"):
        read_asset(mjcf(tmp_path, f'<body name="b">{tetra}</body>'))


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


def test_shape_only_is_the_same_shape_with_textures_that_have_a_size(tmp_path: Path) -> None:
    Image.new("RGB", (64, 32)).save(tmp_path / "skin.png")
    wedge().export(tmp_path / "wedge.stl")
    before = (
        '<asset><texture name="t" type="2d" file="skin.png"/><material name="m" texture="t"/>'
        '<mesh file="wedge.stl"/></asset>'
    )
    path = mjcf(tmp_path, '<body><geom type="mesh" mesh="wedge" material="m"/></body>', before)
    whole, shape = read_asset(path), read_asset(path, shape_only=True)
    assert material_of(shape.visual[0]).baseColorTexture.size == (64, 32)
    assert np.allclose(np.sort(whole.visual[0].triangles, axis=None), np.sort(shape.visual[0].triangles, axis=None))


DIALECTS = {
    "is called 'heavy'": (
        '<default class="heavy"><geom density="50"/><default class="light"><geom density="5"/></default></default>'
        '<default class="second"><geom size="0.2"/></default>',
        '<body><freejoint/><geom size="0.1" class="heavy"/><geom class="second"/><geom size="0.1" class="light"/></body>',
        4 / 3 * np.pi * (50 * 0.1**3 + 50 * 0.2**3 + 5 * 0.1**3),
    ),
    "the attribute 'group'": (
        '<default><default class="c" group="1"><geom size="0.1" mass="2"/></default></default>',
        '<body childclass="c"><freejoint/><geom/><site rgba="0.1 0.2 red 1"/></body>',
        2.0,
    ),
    "the type 'fixed'": (
        "",
        '<body><freejoint/><geom size="0.1" mass="1"/>'
        '<body pos="0 0 1"><joint type="fixed"/><geom size="0.1" mass="2"/></body></body>',
        3.0,
    ),
    "has fullinertia and quat": (
        "",
        '<body><freejoint/><geom size="0.1"/>'
        '<inertial pos="0 0 0" mass="2" quat="0.7 0.7 0 0" fullinertia="1 1 1 0 0 0"/></body>',
        2.0,
    ),
    "<region> is none of MJCF": (
        "",
        '<body><freejoint/><region size="1"/><geom size="0.1" mass="1" shine="2"/><region/></body>',
        1.0,
    ),
    "the attribute 'shine' of <geom>": (
        "",
        '<body><freejoint/><geom size="0.1" mass="1" shine="2" glow="3"/></body>',
        1.0,
    ),
    "the class 'gone' is nowhere": (
        "",
        '<body name="b" childclass="gone"><freejoint/><geom class="gone" size="0.1" mass="1"/></body>',
        1.0,
    ),
    "the world has an <inertial>": (
        "",
        '<inertial pos="0 0 0" mass="5" diaginertia="1 1 1"/><body><freejoint/><geom size="0.1" mass="1"/></body>',
        1.0,
    ),
    "a plane has no size": (
        "",
        '<geom type="plane"/><body><freejoint/><geom size="0.1" mass="1"/></body>',
        1.0,
    ),
    "an <inertial> has no pos": (
        "",
        '<body><freejoint/><inertial mass="2" diaginertia="1 1 1"/><geom size="0.1"/></body>',
        2.0,
    ),
    "the material 'paint' is nowhere": (
        '<default><geom material="paint"/></default>',
        '<body><freejoint/><geom size="0.1" mass="1"/></body>',
        1.0,
    ),
    "are called 'g'": (
        "",
        '<body name="b"><freejoint/><geom name="g" size="0.1" mass="1"/><geom name="g" size="0.2" mass="2"/></body>',
        3.0,
    ),
    "'m' is written twice": (
        '<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/><mesh name="m" vertex="0 0 0 9 0 0 0 9 0 0 0 9"/></asset>',
        '<body><freejoint/><geom type="mesh" mesh="m" density="6"/></body>',
        1.0,
    ),
}  # fmt: skip


@pytest.mark.parametrize("said", DIALECTS)
def test_what_mujoco_of_today_refuses_is_read_as_older_ones_and_others_do(tmp_path: Path, said: str) -> None:
    before, worldbody, mass_kg = DIALECTS[said]
    path = mjcf(tmp_path, worldbody, before)
    with pytest.raises(ValueError):
        mujoco.MjModel.from_xml_path(str(path))
    asset = read_asset(path)
    assert asset.inertial.mass_kg == pytest.approx(mass_kg)
    assert any(said in sentence for sentence in asset.lenient) and set(asset.lenient) <= set(asset.remarks)
    found = [finding for finding in audit_path(path, RULES).findings if finding.code == "FIL009"]
    assert any(said in finding.message for finding in found) and all(f.severity == "warning" for f in found)


def test_global_coordinates_are_those_of_the_world(tmp_path: Path) -> None:
    compiler = '<compiler coordinate="global"/>'
    inner = '<body><joint pos="0 0 1.05" axis="0 1 0"/><geom type="capsule" fromto="0 0 1 0 0 0.6" size="0.05"/></body>'
    for place in ("", 'pos="0 0 1.25"'):
        body = f'<body {place}><freejoint/><geom type="box" pos="0.3 0 1.25" size="0.1 0.2 0.3"/>{inner}</body>'
        asset = read_asset(mjcf(tmp_path, body.replace('type="box" ', 'type="box" mass="1" '), compiler))
        stands = [0.3, 0, 1.25] if not place else [0.3, 0, 0]  # in the axes of its body
        assert np.allclose(np.mean(asset.visual[0].bounds, axis=0), stands)
        assert any("global" in sentence for sentence in asset.lenient)
    turned = '<body pos="0 0 1" euler="0 0 90"><geom size="0.1"/></body>'
    with pytest.raises(AssetError, match="global coordinates"):
        read_asset(mjcf(tmp_path, turned, compiler))


def test_shapes_of_plugins_alone_are_said_to_be_code(tmp_path: Path) -> None:
    before = '<extension><plugin plugin="mujoco.sdf.torus"><instance name="t"/></plugin></extension>'
    body = '<body><geom type="sdf"><plugin instance="t"/></geom></body>'
    with pytest.raises(AssetError, match="a plug-in computes: it is code"):
        read_asset(mjcf(tmp_path, body, before))


def test_a_plane_of_a_body_stands_fast_though_no_joint_is_in_the_file(tmp_path: Path) -> None:
    assert read_asset(mjcf(tmp_path, '<body name="floor"><geom type="plane" size="1 1 1"/></body>')).static


def test_a_file_of_composites_alone_says_what_they_are(tmp_path: Path) -> None:
    rope = '<body><composite type="cable" count="9 1 1" size="1"><geom type="capsule" size="0.01"/></composite></body>'
    with pytest.raises(AssetError, match="those of <composite>, which bends"):
        read_asset(mjcf(tmp_path, rope))
    beside = read_asset(mjcf(tmp_path, f'{rope}<body name="ball"><freejoint/><geom size="0.1"/></body>'))
    assert beside.name == "ball" and any("<composite> is no rigid body" in remark for remark in beside.remarks)


def test_a_body_at_a_place_that_mujoco_does_not_know_is_not_left_out(tmp_path: Path) -> None:
    with pytest.raises(AssetError, match="unrecognized element"):
        read_asset(mjcf(tmp_path, '<body><geom size="0.1"><body><geom size="0.2"/></body></geom></body>'))
    many = " ".join(f'a{n}="1"' for n in range(20))
    with pytest.raises(AssetError, match="knows fewer than"):
        read_asset(mjcf(tmp_path, f'<body><geom size="0.1" {many}/></body>'))
