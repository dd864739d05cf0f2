"""The shapes and textures of MJCF files, and files that are broken or lack others."""

from __future__ import annotations

from pathlib import Path

import mujoco
import numpy as np
import pytest
import trimesh
from PIL import Image
from written_mjcf import mjcf, wedge

from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.rules import RULES
from manitwin.assets.read import read_asset
from manitwin.errors import AssetError
from manitwin.formats.meshes.textures import material_of


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


def _base_colors(path: Path) -> list[tuple[int, ...]]:
    return [tuple(int(c) for c in material_of(part).baseColorFactor[:3]) for part in read_asset(path).visual]


def test_a_material_whose_texture_is_not_there_has_no_colour_but_its_tint(tmp_path: Path) -> None:
    before = (
        '<asset><texture name="t" type="2d" file="gone.png"/><material name="plain" texture="t"/>'
        '<material name="tinted" texture="t" rgba="1 0 0 1"/></asset>'
    )
    geoms = '<geom type="box" size="1 1 1" material="plain"/><geom type="box" size="1 1 1" material="tinted"/>'
    path = mjcf(tmp_path, f"<body>{geoms}</body>", before)
    assert read_asset(path).missing_files == ("gone.png",)
    assert _base_colors(path) == [(204, 204, 204), (255, 0, 0)], "the default grey: white is what no texture said"


def test_colours_are_those_of_a_plain_texture_and_of_the_geom_before_its_material(tmp_path: Path) -> None:
    before = (
        '<asset><texture name="t" type="cube" builtin="flat" width="8" height="8" rgb1="0 1 0"/>'
        '<material name="green" texture="t"/><material name="red" rgba="1 0 0 1"/></asset>'
    )
    geoms = (
        '<geom type="box" size="1 1 1" material="green"/><geom type="box" size="1 1 1" material="red"/>'
        '<geom type="box" size="1 1 1" material="red" rgba="0 0 1 1"/>'
    )
    path = mjcf(tmp_path, f"<body>{geoms}</body>", before)
    assert _base_colors(path) == [(0, 255, 0), (255, 0, 0), (0, 0, 255)]


def test_a_picture_on_a_shape_without_texture_coordinates_is_its_mean_colour(tmp_path: Path) -> None:
    """Unnamed textures have the name of their file; of a grid of pictures the named cells count."""
    Image.new("RGB", (4, 4), (200, 100, 0)).save(tmp_path / "wood.png")
    sides = Image.new("RGB", (40, 30), (0, 0, 0))
    sides.paste((255, 0, 0), (10, 10, 20, 20))
    sides.save(tmp_path / "sides.png")
    before = (
        '<asset><texture file="wood.png"/><material name="wooden" texture="wood"/>'
        '<texture name="s" file="sides.png" gridsize="3 4" gridlayout=".....F......"/><material name="red" texture="s"/>'
        '<texture name="c" type="cube" builtin="checker" width="8" height="8" rgb1="1 1 1" rgb2="0 0 1"/>'
        '<material name="checked" texture="c"/></asset>'
    )
    geoms = "".join(f'<geom type="box" size="1 1 1" material="{name}"/>' for name in ("wooden", "red", "checked"))
    path = mjcf(tmp_path, f"<body>{geoms}</body>", before)
    wooden, red, checked = _base_colors(path)  # which are linear
    assert np.allclose(
        wooden, [round(255 * ((c / 255 + 0.055) / 1.055) ** 2.4) if c else 0 for c in (200, 100, 0)], atol=1
    )
    assert red == (255, 0, 0) and np.allclose(checked, (128, 128, 255), atol=1)
    said = read_asset(path).remarks
    assert any("shown as their mean colour" in each for each in said) and any(
        "shown as one colour" in each for each in said
    )


def test_a_grid_of_a_billion_cells_without_a_layout_is_one_picture(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4), (0, 255, 0)).save(tmp_path / "sides.png")
    before = (
        '<asset><texture name="s" file="sides.png" gridsize="1000000000 1000000000"/>'
        '<material name="green" texture="s"/></asset>'
    )
    path = mjcf(tmp_path, '<body><geom type="box" size="1 1 1" material="green"/></body>', before)
    assert _base_colors(path) == [(0, 255, 0)]


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


def test_lights_with_pictures_do_not_matter(tmp_path: Path) -> None:
    light = '<light type="image" texture="sky"/>'
    assert read_asset(mjcf(tmp_path, f'{light}<body><geom size=".1"/></body>')).collision


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
