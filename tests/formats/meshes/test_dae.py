from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image

from collada_document import DOCUMENT
from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh


def _write(tmp_path: Path, texture: str = "t.png", nodes: str = "", extra: str = "") -> Path:
    (tmp_path / "a.dae").write_text(DOCUMENT.format(texture=texture, nodes=nodes, extra=extra))
    return tmp_path / "a.dae"


def test_unit_up_axis_texture_and_mirroring_node_are_honoured(tmp_path: Path) -> None:
    Image.new("RGB", (2, 2), (9, 8, 7)).save(tmp_path / "t.png")
    mesh = read_mesh(_write(tmp_path))
    (part,) = mesh.parts
    assert (mesh.unit_m, mesh.up) == (0.0254, "z")
    np.testing.assert_allclose(part.bounds, [[0, 0, -3], [1, 1, -3]], atol=1e-6)
    np.testing.assert_allclose(part.face_normals, [[0, 0, -1]] * 2, atol=1e-6)
    assert part.visual.material.baseColorTexture.getpixel((0, 0)) == (9, 8, 7)


def test_texture_outside_the_folder_is_not_read(tmp_path: Path) -> None:
    (tmp_path / "inputs").mkdir()
    Image.new("RGB", (2, 2)).save(tmp_path / "secret.png")
    mesh = read_mesh(_write(tmp_path / "inputs", texture="../secret.png"))
    assert mesh.parts[0].visual.material.baseColorTexture is None
    assert "outside" in mesh.findings[0]
    assert tuple(mesh.parts[0].visual.material.baseColorFactor[:3]) == (204, 204, 204), "nothing says that it is white"


def test_document_type_with_entities_is_refused(tmp_path: Path) -> None:
    path = _write(tmp_path)
    bomb = '<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;">]>'
    path.write_text(path.read_text().replace("<COLLADA", bomb + "<COLLADA", 1))
    with pytest.raises(InputError, match="document type"):
        read_mesh(path)


def test_nodes_that_stand_for_billions_are_refused_at_once(tmp_path: Path) -> None:
    rows = [f'<node id="k{i}">' + f'<instance_node url="#k{i + 1}"/>' * 10 + "</node>" for i in range(12)]
    last = '<node id="k12"><instance_geometry url="#g"/></node>'
    path = _write(tmp_path, nodes="".join(rows) + last, extra='<node><instance_node url="#k0"/></node>')
    with pytest.raises(InputError, match="more than 20000 parts"):
        read_mesh(path)


def test_skinned_document_is_refused_as_animated(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_mesh(_write(tmp_path, extra='<node><instance_controller url="#c"/></node>'))
    assert caught.value.reason == "animated"


def test_dae_of_trimesh_keeps_its_volume(tmp_path: Path) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=2)
    sphere.export(tmp_path / "a.dae")
    assert sum(part.volume for part in read_mesh(tmp_path / "a.dae").parts) == pytest.approx(sphere.volume, rel=1e-5)


@pytest.mark.shared_data
def test_sponge_reads_as_trimesh_reads_it(shared_data: Path) -> None:
    path = shared_data / "meshes/sponge/textured.dae"
    mesh = read_mesh(path)
    assert (mesh.unit_m, mesh.up, len(mesh.parts)) == (1.0, "z", 1)
    theirs = trimesh.load_mesh(path)
    assert mesh.parts[0].area == pytest.approx(theirs.area, rel=1e-6)
    np.testing.assert_allclose(mesh.parts[0].bounds, theirs.bounds, atol=1e-6)


def test_shapes_of_broken_materials_are_read_and_grey(tmp_path: Path) -> None:
    path = _write(tmp_path)
    text = path.read_text()
    assert '<instance_material symbol="' in text
    path.write_text(re.sub(r'target="#[^"]*"', 'target="#nowhere"', text))
    mesh = read_mesh(path)
    assert len(mesh.parts) == 1 and mesh.parts[0].visual.material.baseColorTexture is None
    assert "materials in it are broken" in " ".join(mesh.findings)


def test_comments_among_the_shapes_of_a_mesh_leave_it_whole(tmp_path: Path) -> None:
    path = _write(tmp_path)
    path.write_text(path.read_text().replace("<polylist", "<!-- <polylist count='0'/> --><polylist", 1))
    assert len(read_mesh(path).parts) == 1


def test_normals_that_are_all_the_first_one_are_computed_from_the_faces_and_said(tmp_path: Path) -> None:
    ball = trimesh.creation.icosphere(subdivisions=2)
    ball.export(tmp_path / "a.dae")
    whole = read_mesh(tmp_path / "a.dae")
    assert whole.findings == []
    text = (tmp_path / "a.dae").read_text()
    broken = re.sub(r"(<p>)([^<]*)", lambda found: found[1] + re.sub(r"(\d+) \d+", r"\1 0", found[2]), text)
    (tmp_path / "a.dae").write_text(broken)
    mesh = read_mesh(tmp_path / "a.dae")
    assert mesh.findings == [
        "normals in it are one vector for faces that look other ways; they are computed from the faces"
    ]
    (part,) = mesh.parts
    outward = part.vertices / np.linalg.norm(part.vertices, axis=1)[:, None]
    assert np.einsum("ij,ij->i", part.vertex_normals, outward).min() > 0.99


def test_one_normal_of_what_is_flat_is_kept(tmp_path: Path) -> None:
    # a sheet that is seen from both sides, with one normal that is a little off
    lines = ["v 0 0 0", "v 1 0 0", "v 0 1 0", "vn 0 0.05 1", "f 1//1 2//1 3//1", "f 1//1 3//1 2//1"]
    (tmp_path / "sheet.obj").write_text("\n".join(lines))
    mesh = read_mesh(tmp_path / "sheet.obj")
    assert mesh.findings == [] and mesh.parts[0].vertex_normals[0][1] > 0.04


BROKEN_NUMBERS = ("0 0 0 1 0 0 1 1 0 0 1 0", "0,5 0 0 1 0 0 1 1 0 0 1 0")
"""Written where a comma is the decimal sign."""


def test_a_document_of_broken_shapes_alone_says_what_is_broken(tmp_path: Path) -> None:
    (tmp_path / "a.dae").write_text(DOCUMENT.format(texture="", nodes="", extra="").replace(*BROKEN_NUMBERS))
    with pytest.raises(
        InputError, match=r"no_faces: a\.dae: .* because its COLLADA is broken \(Corrupted float array\); export"
    ):
        read_mesh(tmp_path / "a.dae")


def test_broken_shapes_beside_whole_ones_are_told(tmp_path: Path) -> None:
    whole = DOCUMENT.format(texture="", nodes="", extra='<node id="o"><instance_geometry url="#h"/></node>')
    geometry = whole[whole.index("<geometry id") : whole.index("</library_geometries>")]
    other = geometry.replace(*BROKEN_NUMBERS).replace('id="', 'id="h').replace('="#', '="#h').replace('"hg"', '"h"')
    (tmp_path / "a.dae").write_text(whole.replace("</library_geometries>", f"{other}</library_geometries>"))
    mesh = read_mesh(tmp_path / "a.dae")
    assert len(mesh.parts) == 1
    assert any(each.startswith("broken shapes or nodes in it were left out (") for each in mesh.findings)


def test_a_texture_without_a_file_is_told_and_its_material_grey(tmp_path: Path) -> None:
    (tmp_path / "a.dae").write_text(DOCUMENT.format(texture="", nodes="", extra=""))
    mesh = read_mesh(tmp_path / "a.dae")
    assert mesh.findings == ["a material names a texture without a file; carried on without it"]
    assert mesh.parts[0].visual.material.baseColorTexture is None
