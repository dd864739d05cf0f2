from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.meshes.obj import plain_triangles, read_obj
from manitwin.formats.meshes.read import read_mesh
from manitwin.formats.meshes.source import MeshLimits, MeshSource
from manitwin.geometry.hulls.reduction import hull_to_obj

CUBE = """v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
v 0 0 1
v 1 0 1
v 1 1 1
v 0 1 1
"""
CUBE_FACES = "f 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n"
TRIANGLE = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 0 1\n"


def test_quads_become_a_closed_cube_of_unit_volume(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(CUBE + CUBE_FACES)
    (part,) = read_mesh(tmp_path / "a.obj").parts
    assert len(part.faces) == 12
    assert part.volume == pytest.approx(1.0)


def test_hexagon_is_cut_into_four_triangles_of_its_area(tmp_path: Path) -> None:
    angles = np.arange(6) * np.pi / 3
    lines = [f"v {np.cos(a)} {np.sin(a)} 0" for a in angles]
    (tmp_path / "a.obj").write_text("\n".join(lines) + "\nf 1 2 3 4 5 6\n")
    (part,) = read_mesh(tmp_path / "a.obj").parts
    assert len(part.faces) == 4
    assert part.area == pytest.approx(1.5 * np.sqrt(3))


def test_negative_indices_count_back_from_their_own_line(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n"
    (tmp_path / "a.obj").write_text(text)
    (part,) = read_mesh(tmp_path / "a.obj").parts
    assert sorted(part.triangles_center[:, 0].round(3)) == pytest.approx([1 / 3, 5 + 1 / 3], abs=1e-3)


def test_texture_with_spaces_and_map_options_is_read(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4), (255, 0, 0)).save(tmp_path / "my red.png")
    (tmp_path / "my lib.mtl").write_text("newmtl m\nKd 0 0 0\nmap_Kd -s 1 1 1 my red.png\n")
    (tmp_path / "a.obj").write_text("mtllib my lib.mtl\n" + TRIANGLE + "usemtl m\nf 1/1 2/2 3/3\n")
    mesh = read_mesh(tmp_path / "a.obj")
    material = mesh.parts[0].visual.material
    assert material.baseColorTexture.getpixel((0, 0)) == (255, 0, 0)
    assert list(material.baseColorFactor) == [255, 255, 255, 255]
    assert mesh.findings == []


def test_missing_material_library_is_a_finding(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib gone.mtl\n" + TRIANGLE + "usemtl m\nf 1 2 3\n")
    assert read_mesh(tmp_path / "a.obj").findings == ["material library 'gone.mtl' is not there; carried on without it"]


@pytest.mark.parametrize(
    "name", ["../secret.png", "sub/../../secret.png", "{absolute}", "http://localhost/x.png", "link.png"]
)
def test_textures_outside_the_folder_are_never_read(tmp_path: Path, name: str) -> None:
    folder = tmp_path / "inputs"
    (folder / "sub").mkdir(parents=True)
    Image.new("RGB", (2, 2)).save(tmp_path / "secret.png")
    (folder / "link.png").symlink_to(tmp_path / "secret.png")
    name = name.format(absolute=tmp_path / "secret.png")
    (folder / "a.mtl").write_text(f"newmtl m\nmap_Kd {name}\n")
    (folder / "a.obj").write_text("mtllib a.mtl\n" + TRIANGLE + "usemtl m\nf 1/1 2/2 3/3\n")
    mesh = read_mesh(folder / "a.obj")
    assert mesh.parts[0].visual.material.baseColorTexture is None
    assert len(mesh.findings) == 1 and "outside" in mesh.findings[0]


def test_each_material_becomes_a_part(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl red\nKd 1 0 0\nnewmtl blue\nKd 0 0 1\nPm 1\nPr 0.25\n")
    faces = CUBE_FACES.splitlines()
    text = (
        "mtllib a.mtl\n" + CUBE + "usemtl red\n" + faces[0] + "\nusemtl blue\n" + faces[1] + "\nusemtl red\n" + faces[2]
    )
    (tmp_path / "a.obj").write_text(text + "\n")
    red, blue = read_mesh(tmp_path / "a.obj").parts
    assert (len(red.faces), len(blue.faces)) == (4, 2)
    assert list(red.visual.material.baseColorFactor) == [255, 0, 0, 255]
    assert (blue.visual.material.metallicFactor, blue.visual.material.roughnessFactor) == (1.0, 0.25)


def test_meshlabs_tr_one_stays_opaque(tmp_path: Path) -> None:
    (tmp_path / "a.mtl").write_text("newmtl m\nKd 1 1 1\nTr 1.0\n")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nusemtl m\n" + CUBE + CUBE_FACES)
    material = read_mesh(tmp_path / "a.obj").parts[0].visual.material
    assert material.alphaMode is None and material.baseColorFactor[3] == 255


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (TRIANGLE + "f 1 2 9\n", "unreadable"),
        (TRIANGLE + "f 1 two 3\n", "unreadable"),
        (TRIANGLE + "f 0 1 2\n", "unreadable"),
        ("v 0 0 0\nv 1 0\nv 0 1 0\nf 1 2 3\n", "unreadable"),
        (TRIANGLE, "no_faces"),
        ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "not_finite"),
        ("v 0 0 0\nv inf 0 0\nv 0 1 0\nf 1 2 3\n", "not_finite"),
    ],
)
def test_broken_text_is_refused_in_one_line_that_names_the_file(tmp_path: Path, text: str, reason: str) -> None:
    (tmp_path / "a.obj").write_text(text)
    with pytest.raises(InputError) as caught:
        read_mesh(tmp_path / "a.obj")
    assert caught.value.reason == reason
    assert caught.value.detail.startswith("a.obj: ") and "\n" not in caught.value.detail


def test_vertex_that_no_face_uses_may_be_nan(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(CUBE + "v nan nan nan\n" + CUBE_FACES)
    (part,) = read_mesh(tmp_path / "a.obj").parts
    assert np.isfinite(part.vertices).all() and part.volume == pytest.approx(1.0)


def test_limits_on_faces_and_bytes_hold(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(CUBE + CUBE_FACES)
    with pytest.raises(InputError, match="faces exceed the limit of 11"):
        read_mesh(tmp_path / "a.obj", limits=MeshLimits(max_faces=11))
    with pytest.raises(InputError, match="bytes exceed the limit"):
        read_mesh(tmp_path / "a.obj", limits=MeshLimits(max_bytes=20))


def test_texture_over_the_pixel_limit_is_left_out(tmp_path: Path) -> None:
    Image.new("RGB", (64, 64)).save(tmp_path / "t.png")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd t.png\n")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n" + TRIANGLE + "usemtl m\nf 1/1 2/2 3/3\n")
    mesh = read_mesh(tmp_path / "a.obj", limits=MeshLimits(max_texture_pixels=1000))
    assert mesh.parts[0].visual.material.baseColorTexture is None
    assert "64 x 64" in mesh.findings[0]


def test_a_hull_is_the_same_both_ways(tmp_path: Path) -> None:
    hull = trimesh.creation.icosphere(subdivisions=2, radius=0.03)
    text = hull_to_obj(np.asarray(hull.vertices)).decode()
    (tmp_path / "plain.obj").write_text(text)
    (tmp_path / "grouped.obj").write_text("g hull\n" + text)  # a word more, and the full reader takes it
    assert plain_triangles(text) is not None and plain_triangles("g hull\n" + text) is None
    short, long = (read_obj(MeshSource(tmp_path / name, MeshLimits()))[0] for name in ("plain.obj", "grouped.obj"))
    assert np.array_equal(short.vertices, long.vertices) and np.array_equal(short.faces, long.faces)


TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"


@pytest.mark.parametrize(
    "text",
    [
        "",
        TETRAHEDRON,
        TETRAHEDRON + "f 1 2 3",
        TETRAHEDRON + "f 1 2 3 4",
        TETRAHEDRON + "f 1 2\nf 3 4 1 2",
        TETRAHEDRON + "f 1 2 5\nf 2 3 4",
        TETRAHEDRON + "f -1 -2 -3\nf 1 2 3",
        TETRAHEDRON + "f 1/1 2/2 3/3\nf 2 3 4",
        TETRAHEDRON + "f 1 2 3 \\\n\nf 2 3 4",
        TETRAHEDRON.replace("0 0 1", "0 0 nan") + "f 1 2 3\nf 2 3 4",
        TETRAHEDRON.replace("v 0 0 1", "v 0 0 1 1 0 0") + "f 1 2 3\nf 2 3 4",
        TETRAHEDRON + "f 1 2 3\nf 2 3 99999999999999999999",
    ],
)
def test_anything_else_is_left_to_the_full_reader(text: str) -> None:
    assert plain_triangles(text) is None


def test_indices_of_normals_and_texture_coordinates_that_are_nowhere_are_left_out(tmp_path: Path) -> None:
    path = tmp_path / "bare.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1/1/1 2/2/2 3/3/3\n")
    mesh = read_mesh(path)
    assert len(mesh.parts) == 1 and len(mesh.parts[0].faces) == 1
    said = " ".join(mesh.findings)
    assert "name normals, of which it has none" in said and "name texture coordinates, of which it has none" in said
    path.write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//2 3//3\n")  # some: the file was cut
    with pytest.raises(InputError, match="normal 3 of 1"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("kd", "kept"), [("1 1 1", (204, 204, 204)), ("0 0 0", (204, 204, 204)), ("1 0 0", (255, 0, 0))]
)
def test_material_whose_map_is_lost_is_grey_unless_it_has_a_tint(
    tmp_path: Path, kd: str, kept: tuple[int, ...]
) -> None:
    (tmp_path / "a.mtl").write_text(f"newmtl paint\nKd {kd}\nmap_Kd gone.png\n")
    (tmp_path / "a.obj").write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl paint\nf 1 2 3\n")
    (part,) = read_mesh(tmp_path / "a.obj").parts
    assert tuple(part.visual.material.baseColorFactor[:3]) == kept
