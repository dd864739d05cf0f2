"""SDF models as the specification has them: poses, joints, shapes, and files that stay in the folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from collada_document import DOCUMENT
from manitwin.assets.asset import Asset
from manitwin.assets.audit.check import audit_asset
from manitwin.assets.audit.rules import RULES
from manitwin.assets.licence_text import stated_licence
from manitwin.assets.read import find_assets, read_asset
from manitwin.errors import AssetError
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.textures import make_part, pbr_material

BOX = "<geometry><box><size>0.1 0.2 0.3</size></box></geometry>"


def sdf(folder: Path, inside: str, *, root: str = "", name: str = "model.sdf") -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / name).write_text(
        f'<?xml version="1.0"?><sdf version="1.9">{root}<model name="thing">{inside}</model></sdf>'
    )
    return folder / name


def link(name: str, inside: str = f'<visual name="v">{BOX}</visual>', pose: str = "") -> str:
    return f'<link name="{name}">{pose}{inside}</link>'


def read(folder: Path, inside: str, **more: str) -> Asset:
    return read_asset(sdf(folder, inside, **more))


def centre(asset: Asset, part: int = 0) -> list[float]:
    return [round(float(x), 9) for x in asset.visual[part].bounds.mean(0)]


def test_poses_of_model_link_frame_and_shape_are_joined(tmp_path: Path) -> None:
    asset = read(
        tmp_path,
        '<pose>9 9 9 0 0 0</pose><frame name="f"><pose>0 0 1 0 0 1.5707963267948966</pose></frame>'
        + link(
            "base",
            f'<visual name="v"><pose>0.5 0 0 0 0 0</pose>{BOX}</visual>'
            f'<collision name="c"><pose relative_to="__model__">0 0 2 0 0 0</pose>{BOX}</collision>',
            '<pose relative_to="f">1 0 0 0 0 0</pose>',
        ),
    )
    assert centre(asset) == [0, 1.5, 1]  # the frame turns its X to the model's Y; the model's own pose is the world's
    assert np.allclose(asset.visual[0].extents, [0.2, 0.1, 0.3])
    assert np.allclose(asset.collision[0].vertices.mean(0), [0, 0, 2])


@pytest.mark.parametrize(
    "pose",
    ['<pose degrees="true">0 0 0 90 0 0</pose>', '<pose rotation_format="quat_xyzw">0 0 0 0.5 0 0 0.5</pose>'],
)
def test_other_ways_to_write_a_rotation(tmp_path: Path, pose: str) -> None:
    assert np.allclose(read(tmp_path, link("base", pose=pose)).visual[0].extents, [0.1, 0.3, 0.2])


def test_links_on_fixed_joints_are_one_body_and_others_are_left_out(tmp_path: Path) -> None:
    inertial = "<inertial><mass>{}</mass><inertia><ixx>1e-3</ixx><iyy>1e-3</iyy><izz>1e-3</izz></inertia></inertial>"
    shape = f'<visual name="v">{BOX}</visual>'
    asset = read(
        tmp_path,
        link("base", shape + inertial.format(1.0))
        + link("lid", shape + inertial.format(3.0), "<pose>0 0 0.4 0 0 0</pose>")
        + link("door", shape)
        + '<joint name="a" type="fixed"><parent>base</parent><child>lid</child></joint>'
        + '<joint name="hinge" type="revolute"><parent>base</parent><child>door</child></joint>'
        + '<model name="inner"><link name="x"/></model><include><uri>model://other</uri></include>',
    )
    assert len(asset.visual) == 2 and asset.inertial.mass_kg == 4.0
    assert np.allclose(asset.inertial.center_of_mass_m, [0, 0, 0.3])
    assert np.allclose(asset.inertial.inertia_kg_m2, np.diag([2e-3 + 0.12, 2e-3 + 0.12, 2e-3]))
    said = " | ".join(asset.remarks)
    assert "link 'door' moves by joint hinge (revolute) and was left out" in said
    assert "the nested model 'inner' was left out" in said and "the included model 'model://other' was left out" in said


def test_inertia_is_turned_with_its_pose(tmp_path: Path) -> None:
    asset = read(
        tmp_path,
        link(
            "base",
            f'<visual name="v">{BOX}</visual><inertial><pose>0.1 0 0 0 0 1.5707963267948966</pose><mass>2</mass>'
            "<inertia><ixx>1e-3</ixx><iyy>2e-3</iyy><izz>3e-3</izz></inertia></inertial>",
        ),
    )
    assert np.allclose(asset.inertial.inertia_kg_m2, np.diag([2e-3, 1e-3, 3e-3]), atol=1e-12)
    assert np.allclose(asset.inertial.center_of_mass_m, [0.1, 0, 0])


def test_every_solid_is_read_and_what_is_none_is_named(tmp_path: Path) -> None:
    shapes = (
        "<sphere><radius>0.1</radius></sphere>", "<cylinder><radius>0.1</radius><length>0.4</length></cylinder>",
        "<capsule><radius>0.1</radius><length>0.4</length></capsule>", "<ellipsoid><radii>0.1 0.2 0.3</radii></ellipsoid>",
        "<plane><normal>1 0 0</normal><size>0.4 0.3</size></plane>", "<empty/>",
        "<polyline><point>0 0</point><point>1 0</point><point>0 1</point><height>0.7</height></polyline>",
        "<image><uri>hills.png</uri></image>",
    )  # fmt: skip
    inside = "".join(f'<visual name="v{i}"><geometry>{s}</geometry></visual>' for i, s in enumerate(shapes))
    asset = read(tmp_path, link("base", inside))
    heights = [part.extents[2] for part in asset.visual]
    assert np.allclose(heights, [0.2, 0.4, 0.6, 0.6, 0.4, 0.7], atol=2e-3)
    assert np.isclose(asset.visual[-1].volume, 0.35) and np.isclose(asset.visual[-2].extents[0], 1e-3)
    assert asset.remarks == ("'v7' is <image>, not read as a shape, and was left out",)


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        ("<plane><normal>0 0 0</normal></plane>", "length 0"),
        ("<plane><size>1 0</size></plane>", "not above zero"),
        ("<polyline><point>0 0</point><point>1 1</point><height>1</height></polyline>", "encloses no area"),
        ("<polyline><point>0 0</point><point>1 1</point><point>2 2</point><height>1</height></polyline>", "no area"),
    ],
)
def test_planes_and_polylines_that_are_none_are_refused(tmp_path: Path, shape: str, said: str) -> None:
    with pytest.raises(AssetError, match=said):
        read(tmp_path, link("base", f'<visual name="v"><geometry>{shape}</geometry></visual>'))


def test_lines_within_lines_are_holes(tmp_path: Path) -> None:
    squares = [[(-s, -s), (s, -s), (s, s), (-s, s)] for s in (1.0, 0.5)]
    lines = "".join(
        f"<polyline>{''.join(f'<point>{x} {y}</point>' for x, y in square)}<height>2</height></polyline>"
        for square in squares
    )
    (part,) = read(tmp_path, link("base", f'<visual name="v"><geometry>{lines}</geometry></visual>')).visual
    assert np.isclose(part.volume, 2 * (4 - 1))


def test_a_joint_may_have_the_name_of_a_link(tmp_path: Path) -> None:
    inside = f'<visual name="v">{BOX}</visual>'
    joint = '<joint name="base" type="fixed"><parent>world</parent><child>base</child></joint>'
    assert len(read(tmp_path, link("base", inside) + joint).visual) == 1


def test_friction_and_restitution_are_those_of_the_collisions(tmp_path: Path) -> None:
    surface = (
        "<surface><friction><ode><mu>{}</mu><mu2>{}</mu2></ode></friction>"
        "<bounce><restitution_coefficient>0.2</restitution_coefficient></bounce></surface>"
    )
    asset = read(tmp_path, link("base", f'<collision name="c">{BOX}{surface.format(0.7, 0.5)}</collision>'))
    assert (asset.contact.friction_static, asset.contact.friction_dynamic, asset.contact.restitution) == (
        0.7,
        None,
        0.2,
    )
    assert asset.remarks == ("mu 0.7 and mu2 0.5 are two directions; the first was taken",)


def mesh(uri: str, more: str = "") -> str:
    shape = f"<geometry><mesh><uri>{uri}</uri>{more}</mesh></geometry>"
    return link("base", f'<visual name="v">{shape}<material><diffuse>1 0 0 1</diffuse></material></visual>')


@pytest.mark.parametrize("uri", ["meshes/a.stl", "model://thing/meshes/a.stl", "file://meshes/a.stl"])
def test_meshes_are_found_in_the_models_folder_and_scaled(tmp_path: Path, uri: str) -> None:
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box([1, 2, 3]).export(tmp_path / "meshes" / "a.stl")
    asset = read(tmp_path, mesh(uri, "<scale>0.1 0.1 0.1</scale>"))
    assert np.allclose(asset.visual[0].extents, [0.1, 0.2, 0.3]) and asset.missing_files == ()
    assert asset.visual[0].visual.material.baseColorFactor.tolist() == [255, 0, 0, 255]  # type: ignore[union-attr]
    assert {path.name for path in asset.files} == {"model.sdf", "a.stl"}


@pytest.mark.parametrize("uri", ["../secret.stl", "model://thing/../../secret.stl", "file:///etc/passwd", "link.stl"])
def test_no_file_outside_of_the_models_folder_is_read(tmp_path: Path, uri: str) -> None:
    trimesh.creation.box([1, 2, 3]).export(tmp_path / "secret.stl")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "link.stl").symlink_to(tmp_path / "secret.stl")
    asset = read(tmp_path / "in", mesh(uri))
    assert asset.visual == () and asset.missing_files == (uri,)
    assert any("lies outside the folder above which nothing is read" in remark for remark in asset.remarks)


@pytest.mark.parametrize(
    ("inside", "message"),
    [
        ("", "has no <link>"),
        (link("a") + link("a"), "that of another"),
        (link("a", pose='<pose relative_to="b"/>') + link("b", pose='<pose relative_to="a"/>'), "goes in a circle"),
        (link("a", pose='<pose relative_to="x">0 0 0 0 0 0</pose>'), "no frame of the model"),
        (link("a", pose="<pose>0 0 nan 0 0 0</pose>"), "no number that an object can have"),
        (link("a", pose="<pose>0 0 0</pose>"), "are not 6 numbers"),
        (link("a", '<visual name="v"><geometry><box><size>1 -1 1</size></box></geometry></visual>'), "not above zero"),
        (link("a", '<visual name="v"><geometry/></visual>'), "holds 0 shapes"),
        (link("a", ""), "no link of it has a shape"),
    ],
)
def test_what_is_broken_is_said_in_one_line(tmp_path: Path, inside: str, message: str) -> None:
    with pytest.raises(AssetError, match=message) as caught:
        read(tmp_path, inside)
    assert "\n" not in str(caught.value)


def test_an_inertia_that_lacks_a_moment_is_not_read_and_said(tmp_path: Path) -> None:
    inertia = "<inertia><ixx>0.1</ixx><iyy>0.1</iyy><ixx>0.1</ixx></inertia>"  # the third was meant for izz
    asset = read(tmp_path, link("a", f'<visual name="v">{BOX}</visual><inertial><mass>2</mass>{inertia}</inertial>'))
    assert asset.inertial.mass_kg == 2 and asset.inertial.inertia_kg_m2 is None
    assert asset.lenient == ("the inertia of link 'a' lacks izz, and was not read",)


def test_a_terrain_is_the_surface_of_its_picture_of_heights(tmp_path: Path) -> None:
    Image.fromarray(np.array([[255, 0, 0], [0, 0, 0], [0, 0, 51]], np.uint8)).save(tmp_path / "hills.png")
    shape = "<geometry><heightmap><uri>hills.png</uri><size>20 10 5</size><pos>0 0 -1</pos></heightmap></geometry>"
    hills = read(tmp_path, link("a", f"<collision name='c'>{shape}</collision><visual name='v'>{shape}</visual>"))
    (part,) = hills.visual
    assert np.allclose(part.bounds, [[-10, -5, -1], [10, 5, 4]])
    highest = part.vertices[part.vertices[:, 2].argmax()]
    assert np.allclose(highest, [-10, 5, 4]), "the first row of a picture is its upper one"
    assert np.isclose(part.vertices[:, 2], 0).sum() == 1 and part.face_normals[:, 2].min() > 0
    assert hills.collision[0].as_drawn and not hills.collision[0].convex
    with pytest.raises(AssetError, match="a terrain, whose picture cannot be read"):
        (tmp_path / "hills.png").write_bytes(b"no picture")
        read(tmp_path, link("a", f"<collision name='c'>{shape}</collision>"))


def test_an_included_model_is_the_file_that_its_config_names(tmp_path: Path) -> None:
    sdf(tmp_path / "rover", link("body"), name="rover.sdf")
    (tmp_path / "rover" / "model.config").write_text("<model><name>r</name><sdf version='1.9'>rover.sdf</sdf></model>")
    found = read_asset(sdf(tmp_path / "camera", "<include><uri>model://rover</uri></include>"), root=tmp_path)
    assert len(found.visual) == 1 and {file.name for file in found.files} >= {"rover.sdf"}


def test_a_document_type_is_refused(tmp_path: Path) -> None:
    path = sdf(tmp_path, link("a"))
    path.write_text(path.read_text().replace("<sdf", '<!DOCTYPE sdf [<!ENTITY a "b">]><sdf', 1))
    with pytest.raises(AssetError, match="document type"):
        read_asset(path)


def test_licence_and_author_come_from_the_config_or_the_comments(tmp_path: Path) -> None:
    asset = read(tmp_path / "a", link("a"), root="<!-- license: MIT --><!-- attribution: Ada; Bob -->")
    assert (asset.license, asset.attribution) == ("MIT", "Ada; Bob")
    sdf(tmp_path / "b", link("a"))
    (tmp_path / "b" / "model.config").write_text(
        "<model><name>Blue_Cup</name><license>CC0-1.0</license><author><name>unknown</name></author></model>"
    )
    asset = read_asset(tmp_path / "b")
    assert (asset.format, asset.name, asset.license, asset.attribution) == ("sdf", "Blue Cup", "CC0-1.0", None)


def test_models_are_found_as_folders_and_as_single_files(tmp_path: Path) -> None:
    sdf(tmp_path / "b", link("a"))
    (tmp_path / "b" / "model.config").write_text("<model/>")
    sdf(tmp_path / "c", link("a"), name="cup.sdf")
    (tmp_path / "c" / "molecule.sdf").write_text("benzene\n  -OEChem-\n")  # the suffix is chemists' too
    assert [path.relative_to(tmp_path).as_posix() for path in find_assets(tmp_path)] == ["b", "c/cup.sdf"]


@pytest.mark.parametrize(
    ("text", "licence", "attribution"),
    [
        ("licence: CC0; attribution: X; Y", "CC0", "X; Y"),
        ("License: CC-BY-4.0.", "CC-BY-4.0", None),
        ("SPDX-License-Identifier: MIT\nCopyright: Ada", "MIT", "Ada"),
        ("license: unknown; author: none", None, None),
        ("this has no licence", None, None),
        (
            'Author :: Ada\nLicense :: Under Apache License, Version 2.0 (the "License"); you may not',
            "Apache-2.0",
            "Ada",
        ),
        ("license: the MIT licence", "MIT", None),
        ("license: MIT License or Apache 2.0", "MIT License or Apache 2.0", None),
        ("license: " + "!" * 3_000_000 + "a", None, None),
        (";" * 1_000_000 + " " * 1_000_000 + "license: MIT", None, None),
    ],
)
def test_statements_in_words(text: str, licence: str | None, attribution: str | None) -> None:
    assert stated_licence([text]) == (licence, attribution)


def test_elements_of_a_prefix_that_nobody_declares_are_skipped_and_broken_xml_is_not(tmp_path: Path) -> None:
    inside = link("a", f'<visual name="v"><drake:proximity>1</drake:proximity>{BOX}</visual>')
    assert len(read(tmp_path / "one", inside).visual) == 1
    for broken in ("<drake:proximity>", "<drake:p/>&gone;", '<drake:p a="1" a="2"/>'):
        with pytest.raises(AssetError, match="XML is broken"):
            read(tmp_path / "two", inside + broken)
    (tmp_path / "three.sdf").write_text("<drake:sdf><model/></drake:sdf>")
    with pytest.raises(AssetError, match="not <sdf>"):
        read_asset(tmp_path / "three.sdf", "sdf")


def test_hyphens_within_a_comment_and_a_model_that_is_not_there(tmp_path: Path) -> None:
    inside = "<!-- density of foil -- thin ---><!---->" + link("a")
    assert len(read(tmp_path / "one", inside).visual) == 1
    with pytest.raises(AssetError, match="XML is broken"):
        read(tmp_path / "two", inside + "<link>")
    with pytest.raises(AssetError, match=r"'model://gone' that it includes is not there; give the folder"):
        read(tmp_path / "three", "<include><uri>model://gone</uri></include>")


def test_a_model_without_a_shape_is_the_first_that_it_includes_and_that_is_there(tmp_path: Path) -> None:
    sdf(tmp_path / "base", link("body"))
    include = "<include merge='true'><uri>{}</uri></include>"
    inside = include.format("gone") + include.format("base") + link("sensor", "")
    merged = read_asset(sdf(tmp_path / "lidar", inside), root=tmp_path)
    assert len(merged.visual) == 1 and merged.missing_files == ("gone/model.sdf",)
    codes = {each.code for each in audit_asset(merged, RULES)}
    assert "FIL002" in codes and not any(code.startswith("COL") for code in codes), "what is absent may collide"
    assert any("of the models that it includes, 'base' was read" in remark for remark in merged.remarks)
    world = tmp_path / "world.sdf"
    world.write_text(f"<sdf version='1.9'><world name='w'>{include.format('model://base')}</world></sdf>")
    assert len(read_asset(world).visual) == 1


def test_all_links_of_what_stands_fast_are_read_and_many_that_move_are_counted(tmp_path: Path) -> None:
    links = "".join(link(name) for name in "abcdef")
    stairs = read(tmp_path / "one", "<static>true</static>" + links)
    assert stairs.static and len(stairs.visual) == 6 and stairs.remarks == ()
    loose = read(tmp_path / "two", links)
    assert len(loose.visual) == 1
    (said,) = loose.remarks
    assert said.startswith("link 'b' is joined to nothing fixed, and with it 4 more links were left out")


def test_friction_of_pybullets_contact_is_read(tmp_path: Path) -> None:
    contact = "<contact><lateral_friction>0.3</lateral_friction></contact>"
    assert read(tmp_path, link("a", f'{contact}<visual name="v">{BOX}</visual>')).contact.friction_static == 0.3


def test_gltf_of_a_model_is_turned_where_what_collides_says_so(tmp_path: Path) -> None:
    rod = trimesh.creation.box([0.1, 0.1, 1.0])  # along Z here, which the file has as Y
    (tmp_path / "rod.glb").write_bytes(
        write_glb([make_part(rod.vertices, rod.faces, material=pbr_material(), name="rod")])
    )
    seen = '<visual name="v"><geometry><mesh><uri>rod.glb</uri></mesh></geometry></visual>'
    for size, along in (("0.1 0.1 1.0", 2), ("0.1 1.0 0.1", 1)):
        felt = f'<collision name="c"><geometry><box><size>{size}</size></box></geometry></collision>'
        assert int(np.ptp(read(tmp_path, link("a", seen + felt)).visual[0].vertices, axis=0).argmax()) == along


def test_a_model_whose_config_is_broken_is_read_without_it_and_said(tmp_path: Path) -> None:
    inside = link("a", f'<visual name="v">{BOX}</visual>')
    (tmp_path / "model.sdf").write_text(f"<sdf version='1.6'><model name='m'>{inside}</model></sdf>")
    (tmp_path / "model.config").write_text("<model><name>thing</model>")
    asset = read_asset(tmp_path)
    assert asset.name == "m" and len(asset.lenient) == 1 and "model.config" in asset.lenient[0]


def test_material_scripts_that_are_not_there_are_named(tmp_path: Path) -> None:
    uri = "<uri>model://thing/materials/scripts</uri>"
    old = "<script>Gazebo/Old</script>"  # as before SDFormat 1.3
    scripts = [f"<script>{uri}<name>Wood/{n}</name></script>" for n in (1, 1, 2)] + [f"<script>{uri}</script>", old]
    inside = "".join(f'<visual name="v{n}">{BOX}<material>{s}</material></visual>' for n, s in enumerate(scripts))
    said = "material scripts are not there, and colours and textures of theirs are missing: 'Wood/1', 'Wood/2', "
    assert read(tmp_path, link("base", inside)).remarks == (f"{said}'model://thing/materials/scripts' and 1 more",)
    assert read(tmp_path, link("base", f'<visual name="v">{BOX}<material>{old}</material></visual>')).remarks == (
        "material scripts are not there, and colours and textures of theirs are missing: 'Gazebo/Old'",
    )


def test_the_folder_of_a_model_may_stand_behind_three_slashes(tmp_path: Path) -> None:
    trimesh.creation.box([0.1, 0.2, 0.3]).export(tmp_path / "box.stl")
    seen = '<visual name="v"><geometry><mesh><uri>model:///thing/box.stl</uri></mesh></geometry></visual>'
    (tmp_path / "thing").mkdir()
    (tmp_path / "box.stl").rename(tmp_path / "thing/box.stl")
    asset = read(tmp_path / "thing", link("a", seen))
    assert np.allclose(asset.visual[0].extents, [0.1, 0.2, 0.3]) and asset.missing_files == ()


def test_a_submesh_of_collada_is_what_a_node_of_its_name_shows(tmp_path: Path) -> None:
    geometry = DOCUMENT[DOCUMENT.index('<geometry id="g">') : DOCUMENT.index("</library_geometries>")]
    other = geometry.replace('id="g"', 'id="h" name="Rim"')
    for word in ("p", "pa", "t", "ta", "v"):
        other = other.replace(f'id="{word}"', f'id="{word}2"').replace(f'"#{word}"', f'"#{word}2"')
    extra = '<node name="Wheel"><translate>5 0 1</translate><instance_geometry url="#h"/></node>'
    document = DOCUMENT.format(texture="none.png", nodes="", extra=extra).replace(geometry, geometry + other)
    (tmp_path / "car.dae").write_text(document)
    inch = 0.0254

    def shown(name: str, center: str = "false") -> Asset:
        part = f"<submesh><name>{name}</name><center>{center}</center></submesh><scale>2 1 1</scale>"
        mesh = f"<geometry><mesh><uri>car.dae</uri>{part}</mesh></geometry>"
        return read(tmp_path, link("a", f'<visual name="v">{mesh}</visual>'))

    for name in ("Wheel", "Rim", "h"):
        (wheel,) = shown(name).visual
        assert np.allclose(wheel.bounds, inch * np.array([[10, 0, 1], [12, 1, 1]]))
    (centred,) = shown("Wheel", "true").visual
    assert np.allclose(centred.bounds, inch * np.array([[-1, -0.5, 0], [1, 0.5, 0]]))
    assert len(shown("Wing", "true").visual) == 2 and "'Wing' could not be taken alone" in shown("Wing").remarks[0]
