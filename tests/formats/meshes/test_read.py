from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
import trimesh

from manitwin.errors import InputError
from manitwin.formats.meshes.read import read_mesh


def _points(parts: list[trimesh.Trimesh]) -> np.ndarray:
    return np.vstack([part.vertices for part in parts])


@pytest.mark.shared_data
@pytest.mark.slow
def test_all_shared_meshes_have_the_extents_of_their_manifest(shared_data: Path) -> None:
    with (shared_data / "manifest.csv").open() as stream:
        rows = [row for row in csv.DictReader(stream) if row["kind"] == "mesh"]
    for row in rows:
        mesh = read_mesh(shared_data / row["file"])
        expected = [float(x) for x in row["dims_m"].split(" x ")]
        np.testing.assert_allclose(np.ptp(_points(mesh.parts), axis=0), expected, atol=6e-5, err_msg=row["file"])
        listed = [p.suffix for p in (shared_data / row["file"]).parent.iterdir()]
        textured = any(part.visual.material.baseColorTexture is not None for part in mesh.parts)
        assert textured == (any(s in (".png", ".jpg") for s in listed) or row["file"].endswith(".glb")), row["file"]


@pytest.mark.shared_data
def test_gltf_with_an_extra_ktx2_uses_the_png(shared_data: Path) -> None:
    mesh = read_mesh(shared_data / "meshes/gelatin_box/009_gelatin_box_textured.gltf")
    assert mesh.parts[0].visual.material.baseColorTexture is not None
    assert (mesh.findings, mesh.unit_m, mesh.up) == ([], 1.0, "y")


@pytest.mark.shared_data
def test_gltf_agrees_with_trimesh(shared_data: Path) -> None:
    path = shared_data / "bad/scene_four_objects.glb"
    ours = read_mesh(path).parts
    theirs = trimesh.load_scene(path).dump()
    assert len(ours) == len(theirs) == 4
    assert sum(len(part.faces) for part in ours) == sum(len(part.faces) for part in theirs)
    np.testing.assert_allclose(sorted(p.area for p in ours), sorted(p.area for p in theirs), rtol=1e-6)
    np.testing.assert_allclose(np.ptp(_points(ours), axis=0), np.ptp(_points(theirs), axis=0), atol=1e-7)


@pytest.mark.shared_data
def test_textured_obj_samples_the_same_colours_as_trimesh(shared_data: Path) -> None:
    path = shared_data / "meshes/fuze_bottle/fuze.obj"
    (ours,) = read_mesh(path).parts
    theirs = trimesh.load_mesh(path)
    left = ours.visual.material.baseColorTexture
    assert left is not None and np.array_equal(
        np.asarray(left), np.asarray(theirs.visual.material.image.convert("RGB"))
    )
    mine = {tuple(np.round([*v, *uv], 6)) for v, uv in zip(ours.vertices, ours.visual.uv, strict=True)}
    other = {tuple(np.round([*v, *uv], 6)) for v, uv in zip(theirs.vertices, theirs.visual.uv, strict=True)}
    assert mine == other


@pytest.mark.shared_data
@pytest.mark.parametrize(
    ("name", "reason", "said"),
    [("nan_vertices.obj", "not_finite", "50 of"), ("zero_faces.obj", "no_faces", "2536 vertices")],
)
def test_bad_shared_meshes_are_refused_with_their_cause(shared_data: Path, name: str, reason: str, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        read_mesh(shared_data / "bad" / name)
    assert caught.value.reason == reason


@pytest.mark.shared_data
def test_box_without_its_material_library_is_read(shared_data: Path) -> None:
    mesh = read_mesh(shared_data / "bad/missing_texture.obj")
    np.testing.assert_allclose(np.sort(np.ptp(_points(mesh.parts), axis=0)), [0.02, 0.06, 0.09], atol=1e-9)
    assert len(mesh.findings) == 1 and "gone.mtl" in mesh.findings[0]


@pytest.mark.shared_data
def test_photo_is_no_mesh(shared_data: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_mesh(shared_data / "photos/apple.jpg")
    assert caught.value.reason == "wrong_type"


def test_misnamed_mesh_is_read_with_a_finding(tmp_path: Path) -> None:
    trimesh.creation.box().export(tmp_path / "box.ply")
    (tmp_path / "box.ply").rename(tmp_path / "box.obj")
    mesh = read_mesh(tmp_path / "box.obj")
    assert mesh.format == "ply" and "holds ply" in mesh.findings[0]


@pytest.mark.parametrize("suffix", ["glb", "ply", "stl", "obj", "dae"])
def test_files_cut_anywhere_end_in_input_errors(tmp_path: Path, suffix: str) -> None:
    trimesh.creation.icosphere(subdivisions=1).export(tmp_path / f"whole.{suffix}")
    data = (tmp_path / f"whole.{suffix}").read_bytes()
    for share in (0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 0.98):
        (tmp_path / f"cut.{suffix}").write_bytes(data[: int(len(data) * share)])
        try:
            read_mesh(tmp_path / f"cut.{suffix}")
        except InputError as error:
            assert error.detail.startswith("cut.") and "\n" not in error.detail
        else:
            # text formats that end between two lines are whole as far as anyone can tell
            assert suffix == "obj"


@pytest.mark.parametrize("suffix", ["glb", "ply", "stl", "obj", "dae"])
def test_flipped_bytes_never_end_in_another_error(tmp_path: Path, suffix: str) -> None:
    trimesh.creation.box().export(tmp_path / f"whole.{suffix}")
    data = np.frombuffer((tmp_path / f"whole.{suffix}").read_bytes(), dtype=np.uint8)
    rng = np.random.default_rng(0)
    for _ in range(60):
        broken = data.copy()
        where = rng.integers(0, len(broken), size=3)
        broken[where] = rng.integers(0, 256, size=3)
        (tmp_path / f"broken.{suffix}").write_bytes(broken.tobytes())
        try:
            mesh = read_mesh(tmp_path / f"broken.{suffix}")
        except InputError:
            continue
        assert np.isfinite(_points(mesh.parts)).all()
