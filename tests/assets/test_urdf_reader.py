from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.assets.read import read_asset
from manitwin.errors import AssetError
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.textures import make_part, material_of, pbr_material

BOX_SHAPE = '<geometry><box size="0.1 0.2 0.4"/></geometry>'


def urdf(tmp_path: Path, body: str, name: str = "object.urdf") -> Path:
    """Write a URDF whose robot holds ``body``."""
    path = tmp_path / name
    path.write_text(f'<?xml version="1.0"?>\n<robot name="thing">{body}</robot>')
    return path


def bounds(vertices: np.ndarray) -> np.ndarray:
    return np.array([vertices.min(0), vertices.max(0)])


def test_origin_and_scale_are_applied_to_the_mesh(tmp_path: Path) -> None:
    trimesh.creation.box([1, 2, 4]).export(tmp_path / "box.obj")
    origin = f'<origin xyz="0 0 1" rpy="{np.pi / 2} 0 0"/>'
    mesh = '<geometry><mesh filename="box.obj" scale="0.1 0.1 0.2"/></geometry>'
    asset = read_asset(
        urdf(tmp_path, f'<link name="l"><visual>{origin}{mesh}</visual><collision>{origin}{mesh}</collision></link>')
    )
    expected = [[-0.05, -0.4, 0.9], [0.05, 0.4, 1.1]]  # Rx(90): y goes to z, z to -y
    assert np.allclose(bounds(asset.visual[0].vertices), expected)
    assert np.allclose(bounds(asset.collision[0].vertices), expected)
    assert asset.collision[0].convex and asset.collision[0].file == (tmp_path / "box.obj").resolve()
    assert {file.name for file in asset.files} == {"box.obj", "object.urdf"} | {
        f.name for f in tmp_path.glob("material*")
    }
    assert (asset.format, asset.name, asset.up, asset.unit_m) == ("urdf", "thing", "z", 1.0)


def test_a_mesh_without_a_material_has_the_colour_of_its_visual(tmp_path: Path) -> None:
    box = trimesh.creation.box([1, 1, 1])
    for name in ("box.stl", "bare.obj"):
        box.export(tmp_path / name)
    (tmp_path / "lost.mtl").write_text("newmtl lost\nmap_Kd gone.png\n")
    (tmp_path / "lost.obj").write_text(f"mtllib lost.mtl\nusemtl lost\n{(tmp_path / 'bare.obj').read_text()}")
    (tmp_path / "named.obj").write_text(f"mtllib gone.mtl\nusemtl wood\n{(tmp_path / 'bare.obj').read_text()}")
    (tmp_path / "own.mtl").write_text("newmtl own\nKd 1 0 0\n")
    (tmp_path / "own.obj").write_text(f"mtllib own.mtl\nusemtl own\n{(tmp_path / 'bare.obj').read_text()}")
    visuals = "".join(
        f'<visual><geometry><mesh filename="{name}"/></geometry><material name="m"><color rgba="0 0 1 1"/></material></visual>'
        for name in ("box.stl", "bare.obj", "lost.obj", "own.obj", "named.obj")
    )
    asset = read_asset(urdf(tmp_path, f'<link name="l">{visuals}</link>'))
    colors = [material_of(part).baseColorFactor[:3].tolist() for part in asset.visual]
    assert colors == [[0, 0, 255], [0, 0, 255], [204, 204, 204], [255, 0, 0], [0, 0, 255]]


def test_primitives_have_the_volume_of_what_they_say(tmp_path: Path) -> None:
    shapes = {
        '<box size="0.1 0.2 0.4"/>': 0.008,
        '<cylinder radius="0.1" length="0.5"/>': np.pi * 0.005,
        '<sphere radius="0.1"/>': 4 / 3 * np.pi * 0.001,
        '<capsule radius="0.1" length="0.2"/>': np.pi * 0.002 + 4 / 3 * np.pi * 0.001,
    }
    body = "".join(f"<collision><geometry>{shape}</geometry></collision>" for shape in shapes)
    asset = read_asset(urdf(tmp_path, f'<link name="l">{body}</link>'))
    volumes = [trimesh.Trimesh(s.vertices, s.faces).volume for s in asset.collision]
    assert np.allclose(volumes, list(shapes.values()), rtol=0.03)
    assert not asset.visual


def test_inertia_is_turned_by_its_origin(tmp_path: Path) -> None:
    rpy = np.array([0.3, -0.4, 0.5])
    inertial = (
        f'<inertial><origin xyz="0.01 0.02 0.03" rpy="{rpy[0]} {rpy[1]} {rpy[2]}"/><mass value="0.35"/>'
        '<inertia ixx="1e-3" ixy="0" ixz="0" iyy="2e-3" iyz="0" izz="2.5e-3"/></inertial>'
    )
    asset = read_asset(urdf(tmp_path, f'<link name="l">{inertial}<visual>{BOX_SHAPE}</visual></link>'))
    x, y, z = (Rotation.from_rotvec(a * np.eye(3)[i]).as_matrix() for i, a in enumerate(rpy))
    rotation = z @ y @ x  # fixed axes: the roll first
    assert asset.inertial.mass_kg == 0.35
    assert np.allclose(asset.inertial.center_of_mass_m, [0.01, 0.02, 0.03])
    assert np.allclose(asset.inertial.inertia_kg_m2, rotation @ np.diag([1e-3, 2e-3, 2.5e-3]) @ rotation.T)


def test_links_on_fixed_joints_are_one_body(tmp_path: Path) -> None:
    inertial = '<inertial><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1"/></inertial>'
    links = "".join(
        f'<link name="{name}">{inertial}<visual>{BOX_SHAPE}</visual><collision>{BOX_SHAPE}</collision></link>'
        for name in "ab"
    )
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/><origin xyz="1 0 0"/></joint>'
    asset = read_asset(urdf(tmp_path, links + joint))
    assert asset.inertial.mass_kg == 4.0
    assert np.allclose(asset.inertial.center_of_mass_m, [0.5, 0, 0])
    # two bodies of 2 kg at half a metre from their centre: 2 * 2 * 0.25 more about y and z
    assert np.allclose(asset.inertial.inertia_kg_m2, np.diag([0.2, 1.2, 1.2]))
    assert len(asset.collision) == 2 and asset.collision[1].vertices[:, 0].mean() == pytest.approx(1.0)


def test_link_behind_a_moving_joint_is_left_out_and_said(tmp_path: Path) -> None:
    links = "".join(f'<link name="{name}"><visual>{BOX_SHAPE}</visual></link>' for name in "ab")
    joint = '<joint name="hinge" type="revolute"><parent link="a"/><child link="b"/></joint>'
    asset = read_asset(urdf(tmp_path, links + joint))
    assert len(asset.visual) == 1
    assert any("'b'" in r and "hinge (revolute)" in r for r in asset.remarks)


def test_body_that_floats_in_an_empty_world_is_the_object(tmp_path: Path) -> None:
    links = f'<link name="world"/><link name="cup"><visual>{BOX_SHAPE}</visual></link>'
    joint = '<joint name="f" type="floating"><parent link="world"/><child link="cup"/><origin xyz="5 5 5"/></joint>'
    asset = read_asset(urdf(tmp_path, links + joint))
    assert len(asset.visual) == 1 and not asset.remarks
    assert np.allclose(bounds(asset.visual[0].vertices), [[-0.05, -0.1, -0.2], [0.05, 0.1, 0.2]])


@pytest.mark.parametrize(
    ("body", "static", "dynamic"),
    [
        ('<link name="l"><contact><lateral_friction value="0.7"/></contact>{}</link>', 0.7, 0.7),
        ('<link name="l">{}</link><gazebo reference="l"><mu1>0.4</mu1><mu2>0.3</mu2></gazebo>', 0.4, None),
        ('<link name="l">{}</link><gazebo reference="l"><mu1></mu1><mu2></mu2></gazebo>', None, None),
        ('<link name="l">{}</link><gazebo reference="other"><mu1>0.4</mu1></gazebo>', None, None),
    ],
)
def test_friction_is_what_pybullet_or_gazebo_would_read(
    tmp_path: Path, body: str, static: float | None, dynamic: float | None
) -> None:
    asset = read_asset(urdf(tmp_path, body.format(f"<visual>{BOX_SHAPE}</visual>")))
    assert (asset.contact.friction_static, asset.contact.friction_dynamic) == (static, dynamic)


def test_nothing_declared_is_none(tmp_path: Path) -> None:
    asset = read_asset(urdf(tmp_path, f'<link name="l"><visual>{BOX_SHAPE}</visual></link>'))
    assert asset.inertial.mass_kg is None and asset.inertial.inertia_kg_m2 is None
    assert asset.contact.friction_static is None and asset.license is None


def test_package_names_are_looked_up_in_the_package(tmp_path: Path) -> None:
    package = tmp_path / "cup_description"
    (package / "urdf").mkdir(parents=True)
    (package / "meshes").mkdir()
    (package / "package.xml").write_text("<package/>")
    trimesh.creation.box([1, 1, 1]).export(package / "meshes" / "cup.stl")
    mesh = '<geometry><mesh filename="package://cup_description/meshes/cup.stl"/></geometry>'
    path = urdf(package / "urdf", f'<link name="l"><visual>{mesh}</visual></link>')
    assert len(read_asset(path).visual) == 1
    assert len(read_asset(package).visual) == 1  # the folder as a whole is the asset


@pytest.mark.parametrize("name", ["../secret.stl", "/etc/passwd", "file:///etc/passwd", "package://../secret.stl"])
def test_mesh_outside_of_the_folder_is_missing_not_read(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "asset"
    folder.mkdir()
    trimesh.creation.box([1, 1, 1]).export(tmp_path / "secret.stl")
    mesh = f'<geometry><mesh filename="{name}"/></geometry>'
    asset = read_asset(urdf(folder, f'<link name="l"><visual>{mesh}</visual></link>'))
    assert not asset.visual and asset.missing_files == (name,)
    assert [file.name for file in asset.files] == ["object.urdf"]


def test_loop_of_links_is_missing_and_the_next_mesh_is_read(tmp_path: Path) -> None:
    (tmp_path / "loop.stl").symlink_to("loop.stl")
    trimesh.creation.box([1, 1, 1]).export(tmp_path / "mesh.stl")
    visuals = "".join(
        f'<visual><geometry><mesh filename="{name}"/></geometry></visual>' for name in ("loop.stl", "mesh.stl")
    )
    asset = read_asset(urdf(tmp_path, f'<link name="l">{visuals}</link>'))
    assert asset.missing_files == ("loop.stl",) and len(asset.visual) == 1


def test_name_of_a_link_as_long_as_a_book_leaves_the_remedy_readable(tmp_path: Path) -> None:
    with pytest.raises(AssetError) as raised:
        read_asset(urdf(tmp_path, f'<link name="{"a" * 100_000}"><visual><geometry/></visual></link>'))
    assert len(str(raised.value)) < 3100 and str(raised.value).endswith(
        "give it one of box, capsule, cylinder, mesh, sphere"
    )


def test_link_that_leads_out_of_the_folder_is_missing(tmp_path: Path) -> None:
    folder = tmp_path / "asset"
    folder.mkdir()
    trimesh.creation.box([1, 1, 1]).export(tmp_path / "secret.stl")
    (folder / "mesh.stl").symlink_to(tmp_path / "secret.stl")
    mesh = '<geometry><mesh filename="mesh.stl"/></geometry>'
    asset = read_asset(urdf(folder, f'<link name="l"><visual>{mesh}</visual></link>'))
    assert asset.missing_files == ("mesh.stl",) and not asset.visual


@pytest.mark.parametrize(
    "body",
    [
        '<link name="l"><inertial><mass value="nan"/></inertial><visual>{}</visual></link>',
        '<link name="l"><inertial><mass value="1e300"/></inertial><visual>{}</visual></link>',
        '<link name="l"><inertial><mass value="a lot"/></inertial><visual>{}</visual></link>',
        '<link name="l"><inertial><mass value="1"/><inertia ixx="1"/></inertial><visual>{}</visual></link>',
        '<link name="l"><visual><origin xyz="0 0"/>{}</visual></link>',
        '<link name="l"><visual><geometry><box size="0 0.1 0.1"/></geometry></visual></link>',
        '<link name="l"><visual><geometry><cone/></geometry></visual></link>',
        '<link name="l"><visual><geometry/></visual></link>',
        '<link name="l"><visual>{}</visual></link><joint name="j"><parent link="l"/><child link="x"/></joint>',
        '<link name="a"/><link name="b"/><joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
        '<joint name="k" type="fixed"><parent link="b"/><child link="a"/></joint>',
        '<link name="l"><visual>{}</visual>' + '<collision><geometry><box size="1 1 1"/></geometry></collision>' * 4200
        + "</link>",
        '<link name="l"/>',
        "",
    ],
)  # fmt: skip
def test_broken_urdf_is_an_error_in_one_line(tmp_path: Path, body: str) -> None:
    with pytest.raises(AssetError) as caught:
        read_asset(urdf(tmp_path, body.format(BOX_SHAPE)))
    assert "object.urdf" in str(caught.value) or "shapes" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_entities_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "x.urdf"
    path.write_text(
        '<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY a SYSTEM "file:///etc/passwd">]>'
        '<robot name="r"><link name="&a;"/></robot>'
    )
    with pytest.raises(AssetError, match=r"entity|document type"):
        read_asset(path)


def test_what_tools_add_for_themselves_and_shapes_without_size_are_left_out(tmp_path: Path) -> None:
    shapes = (
        f'<visual><geometry><box size="0.1 0.2 0.4"/><d:declare_convex xmlns:d="http://x.org"/></geometry></visual>'
        f"<visual drake:hidden='1'><geometry><sphere radius='0'/></geometry></visual><collision>{BOX_SHAPE}</collision>"
    )
    asset = read_asset(urdf(tmp_path, f'<link name="l">{shapes}</link><drake:note>mine</drake:note>'))
    assert len(asset.visual) == len(asset.collision) == 1
    assert len(asset.remarks) == 1 and "has no size" in asset.remarks[0]


def test_a_joint_to_the_world_needs_no_link_of_that_name(tmp_path: Path) -> None:
    joint = '<joint name="j" type="fixed"><origin xyz="0 0 1"/><parent link="world"/><child link="l"/></joint>'
    asset = read_asset(urdf(tmp_path, f'<link name="l"><collision>{BOX_SHAPE}</collision></link>{joint}'))
    assert np.allclose(bounds(asset.collision[0].vertices).mean(0), [0, 0, 1])


def test_a_mesh_of_a_format_that_is_not_read_costs_that_shape_alone(tmp_path: Path) -> None:
    (tmp_path / "soft.vtk").write_text("# vtk DataFile Version 3.0\n")
    body = (
        f'<link name="l"><visual>{BOX_SHAPE}</visual>'
        '<collision><geometry><mesh filename="soft.vtk"/></geometry></collision></link>'
    )
    asset = read_asset(urdf(tmp_path, body))
    assert len(asset.visual) == 1 and asset.collision == () and asset.missing_files == ()
    assert any("soft.vtk is a .vtk file, which is not read" in remark for remark in asset.remarks)


def test_commas_between_numbers_are_read_as_spaces(tmp_path: Path) -> None:
    origin = '<origin xyz="0.07, 0, -0.69"/>'
    asset = read_asset(urdf(tmp_path, f'<link name="l"><visual>{origin}{BOX_SHAPE}</visual></link>'))
    assert np.allclose(bounds(asset.visual[0].vertices).mean(0), [0.07, 0, -0.69])


def test_a_distance_field_of_isaac_gym_is_collided_with_as_it_is_drawn(tmp_path: Path) -> None:
    body = f'<link name="l"><collision>{BOX_SHAPE}<sdf resolution="256"/></collision><collision>{BOX_SHAPE}</collision></link>'
    first, second = read_asset(urdf(tmp_path, body)).collision
    assert first.as_drawn and not second.as_drawn and second.primitive
    concave = f'<link name="l"><collision concave="yes">{BOX_SHAPE}</collision></link>'  # PyBullet's
    assert read_asset(urdf(tmp_path, concave)).collision[0].as_drawn


def test_an_asset_of_which_links_were_left_out_is_partial(tmp_path: Path) -> None:
    shape = f"<collision>{BOX_SHAPE}</collision>"
    leg = '<joint name="j" type="revolute"><parent link="l"/><child link="leg"/></joint>'
    links = f'<link name="l">{shape}</link><link name="leg">{shape}</link>'
    assert read_asset(urdf(tmp_path, links + leg)).partial
    assert not read_asset(urdf(tmp_path, links + leg.replace("revolute", "fixed"))).partial


@pytest.mark.parametrize(("collision", "turned"), [("", True), ("z", False), ("y", True)])
def test_gltf_stands_as_what_collides_says_and_upright_where_nothing_does(
    tmp_path: Path, collision: str, turned: bool
) -> None:
    """A rod of 1 m that is long along Y in the glTF: Drake makes it long along Z, SAPIEN leaves it."""
    rod = trimesh.creation.box([0.1, 0.1, 1.0])  # along Z here, which the file has as Y
    (tmp_path / "rod.glb").write_bytes(
        write_glb([make_part(rod.vertices, rod.faces, material=pbr_material(), name="rod")])
    )
    long = {"": "", "z": "0.1 1.0 0.1", "y": "0.1 0.1 1.0"}[collision]
    felt = f'<collision><geometry><box size="{long}"/></geometry></collision>' if long else ""
    asset = read_asset(
        urdf(tmp_path, f'<link name="l"><visual><geometry><mesh filename="rod.glb"/></geometry></visual>{felt}</link>')
    )
    extents = np.ptp(asset.visual[0].vertices, axis=0)
    assert int(extents.argmax()) == (2 if turned else 1)
    assert any("glTF meshes were turned" in remark for remark in asset.remarks) == turned


def test_what_loaders_take_beside_the_specification_is_read_and_said(tmp_path: Path) -> None:
    trimesh.creation.box([1, 1, 1]).export(tmp_path / "cube.stl")
    shape = '<geometry><mesh filename="cube.stl" scale="1 2 3 1"/><material name="m"/></geometry>'
    joint = '<joint name="j" type="fixed"><parent link="base"/><child link="l"/><origin xyz="0 0 1"/></joint>'
    asset = read_asset(urdf(tmp_path, f'<link name="l"><visual>{shape}</visual></link>{joint}'))
    assert np.allclose(asset.visual[0].bounds, [[-0.5, -1, -0.5], [0.5, 1, 2.5]])
    said = " ".join(asset.lenient)
    for words in ("holds <material> beside its shape", "4 factors of scale", "hangs from the link 'base'"):
        assert words in said
    ball = joint.replace("fixed", "spherical").replace("base", "l").replace('child link="l"', 'child link="k"')
    box = f"<visual>{BOX_SHAPE}</visual>"
    balls = read_asset(urdf(tmp_path, f'<link name="l">{box}</link><link name="k">{box}</link>{ball}'))
    assert len(balls.visual) == 1 and balls.partial and balls.lenient == ()


def test_a_colour_of_more_than_four_numbers_is_that_of_the_first_four_and_said(tmp_path: Path) -> None:
    visual = f'<visual>{BOX_SHAPE}<material name="m"><color rgba="1 0 0 0.5 1"/></material></visual>'
    asset = read_asset(urdf(tmp_path, f'<link name="l">{visual}</link>'))
    assert material_of(asset.visual[0]).baseColorFactor.tolist() == [255, 0, 0, 128]
    assert asset.lenient == ("a colour has 5 numbers, of which the first four were taken",)


def test_the_licence_of_its_package_is_that_of_an_asset_without_one(tmp_path: Path) -> None:
    (tmp_path / "urdf").mkdir()
    says = "<license>Apache 2.0</license><license>MIT</license><author>Ada</author><maintainer>Bo</maintainer>"
    (tmp_path / "package.xml").write_text(f"<package><name>cups</name>{says}</package>")
    link = f'<link name="l"><visual>{BOX_SHAPE}</visual></link>'
    asset = read_asset(urdf(tmp_path / "urdf", link))
    assert (asset.license, asset.attribution) == ("Apache-2.0 AND MIT", "Ada")
    assert any("is that of the package cups (package.xml)" in remark for remark in asset.remarks)
    own = read_asset(urdf(tmp_path / "urdf", f"<!-- a cup\nlicense: CC0-1.0\n-->{link}"))
    assert (own.license, own.attribution) == ("CC0-1.0", None)
    assert read_asset(urdf(tmp_path / "urdf", link), root=tmp_path / "urdf").license is None, "above the root"
    (tmp_path / "package.xml").write_text("<package><license>TODO: License declaration</license></package>")
    assert read_asset(urdf(tmp_path / "urdf", link)).license is None


def test_joints_of_one_name_and_a_namespace_of_the_whole_document_are_read(tmp_path: Path) -> None:
    box = f"<visual>{BOX_SHAPE}</visual>"
    joint = '<joint name="tool" type="fixed"><parent link="l"/><child link="{}"/></joint>'
    links = "".join(f'<link name="{name}">{box}</link>' for name in "lab")
    path = urdf(tmp_path, links + joint.format("a") + joint.format("b"))
    asset = read_asset(path)
    assert len(asset.visual) == 3 and [each.name for each in asset.joints] == ["tool", "tool_2"]
    assert asset.lenient == ("two joints are called 'tool', which urdfdom refuses; both were read",)
    path.write_text(path.read_text().replace("<robot ", '<robot xmlns="http://drake.mit.edu" '))
    assert len(read_asset(path).visual) == 3


def test_a_path_from_the_root_of_all_files_may_be_meant_from_the_folder(tmp_path: Path) -> None:
    (tmp_path / "meshes").mkdir()
    trimesh.creation.box([1, 1, 1]).export(tmp_path / "meshes" / "b.stl")
    shape = '<geometry><mesh filename="/meshes/b.stl"/></geometry>'
    asset = read_asset(urdf(tmp_path, f'<link name="l"><visual>{shape}</visual></link>'))
    assert len(asset.visual) == 1 and asset.missing_files == () and "read from elsewhere" in asset.lenient[0]


def test_what_collides_is_the_object_and_not_the_mark_before_it(tmp_path: Path) -> None:
    mark, trunk = f"<visual>{BOX_SHAPE}</visual>", f"<visual>{BOX_SHAPE}</visual><collision>{BOX_SHAPE}</collision>"
    joint = '<joint name="j" type="floating"><parent link="mark"/><child link="trunk"/></joint>'
    asset = read_asset(urdf(tmp_path, f'<link name="mark">{mark}</link><link name="trunk">{trunk}</link>{joint}'))
    assert len(asset.collision) == 1 and asset.partial
    assert any("link 'mark' holds others by joints and was left out" in remark for remark in asset.remarks)


def test_a_density_of_isaac_gym_gives_the_mass_of_the_hulls(tmp_path: Path) -> None:
    box = '<collision><geometry><box size="0.1 0.2 0.3"/></geometry></collision>'
    asset = read_asset(urdf(tmp_path, f'<link name="l"><inertial><density value="500"/></inertial>{box}</link>'))
    assert asset.inertial.mass_kg == pytest.approx(3) and asset.inertial.computed
    assert np.allclose(
        np.diag(asset.inertial.inertia_kg_m2), [3 / 12 * (0.04 + 0.09), 3 / 12 * (0.01 + 0.09), 3 / 12 * 0.05]
    )


def test_what_is_soft_in_pybullet_is_said_and_left_out(tmp_path: Path) -> None:
    soft = '<deformable name="torus"><visual filename="torus.vtk"/></deformable>'
    with pytest.raises(
        AssetError, match=r"object\.urdf: its only body, <deformable> 'torus' is PyBullet's for what bends"
    ):
        read_asset(urdf(tmp_path, soft))
    asset = read_asset(urdf(tmp_path, f'{soft}<link name="l"><visual>{BOX_SHAPE}</visual></link>'))
    assert len(asset.visual) == 1 and "left out" in asset.remarks[0]


@pytest.mark.parametrize("turned", [True, False])
def test_gltf_of_an_arm_stands_as_its_links_collide_and_not_as_its_whole_reach(tmp_path: Path, turned: bool) -> None:
    """Two rods that collide as they stand, and a third, far out, whose one ball says nothing and makes the whole's box."""
    rod = trimesh.creation.box([0.1, 0.1, 1.0])  # along Z here, which the file has as Y
    (tmp_path / "rod.glb").write_bytes(
        write_glb([make_part(rod.vertices, rod.faces, material=pbr_material(), name="rod")])
    )
    seen = '<visual><geometry><mesh filename="rod.glb"/></geometry></visual>'
    felt = f'<collision><geometry><box size="{"0.1 0.1 1" if turned else "0.1 1 0.1"}"/></geometry></collision>'
    ball = '<collision><origin xyz="0 0 3"/><geometry><sphere radius="{}"/></geometry></collision>'
    far = ball.format(0.4) if not turned else ball.format(0.4).replace("0 0 3", "0 3 0")
    links = f'<link name="a">{seen}{felt}</link><link name="b">{seen}{felt}</link><link name="c">{seen}{far}</link>'
    joints = "".join(
        f'<joint name="j{n}" type="fixed"><parent link="{p}"/><child link="{n}"/><origin xyz="1 0 0"/></joint>'
        for p, n in (("a", "b"), ("b", "c"))
    )
    asset = read_asset(urdf(tmp_path, links + joints))
    assert any("glTF meshes were turned" in remark for remark in asset.remarks) == turned


@pytest.mark.parametrize("shape", ['<plane normal="0 0 1"/>', '<cdf filename="box.cdf"/>'])
def test_collision_shapes_that_pybullet_alone_knows_are_left_out_with_a_remark(tmp_path: Path, shape: str) -> None:
    seen = '<visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual>'
    felt = f"<collision><geometry>{shape}</geometry></collision>"
    (tmp_path / "box.urdf").write_text(f'<robot name="box"><link name="l">{seen}{felt}</link></robot>')
    asset = read_asset(tmp_path / "box.urdf")
    assert len(asset.visual) == 1 and not asset.collision
    assert any("which PyBullet alone knows, and was left out" in each for each in asset.lenient)
