"""FBX: metres and Y up whatever a file says, materials and textures, and broken or old ones in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from fbx_document import fbx_box
from manitwin.errors import InputError
from manitwin.formats.meshes import fbx
from manitwin.formats.meshes.read import MeshFile, read_mesh
from manitwin.formats.meshes.source import MeshLimits
from manitwin.formats.meshes.textures import material_of, uv_of
from manitwin.formats.sniff import sniff


def _read(folder: Path, text: str, limits: MeshLimits | None = None) -> MeshFile:
    (folder / "box.fbx").write_text(text)
    return read_mesh(folder / "box.fbx", limits=limits)


@pytest.mark.parametrize("unit_cm", [1.0, 100.0, 2.54])
def test_a_box_is_in_its_unit_where_it_is_placed(tmp_path: Path, unit_cm: float) -> None:
    read = _read(tmp_path, fbx_box(unit_cm=unit_cm))
    (part,) = read.parts
    assert (read.format, read.up, read.findings) == ("fbx", "y", [])
    assert read.unit_m == pytest.approx(unit_cm / 100)
    assert np.allclose(part.extents, [10, 20, 30], rtol=1e-5), "which is what --units is about"
    assert np.allclose(part.bounds.mean(axis=0), [100, 0, 0], rtol=1e-5, atol=1e-3)
    assert part.volume == pytest.approx(6000, rel=1e-4), "faces look outward"


def test_a_file_with_z_up_is_turned(tmp_path: Path) -> None:
    (part,) = _read(tmp_path, fbx_box(up=2)).parts
    assert np.allclose(part.extents, [10, 30, 20], rtol=1e-5)


def test_colours_are_kept(tmp_path: Path) -> None:
    (part,) = _read(tmp_path, fbx_box()).parts
    assert material_of(part).name == "paint" and material_of(part).baseColorFactor.tolist() == [255, 0, 0, 255]


@pytest.mark.parametrize("path", ["picture.png", "C:/Users/someone/picture.png", "/home/someone/picture.png"])
def test_a_texture_beside_the_file_is_found_whatever_machine_wrote_its_path(tmp_path: Path, path: str) -> None:
    Image.new("RGB", (4, 4), (0, 200, 0)).save(tmp_path / "picture.png")
    (part,) = _read(tmp_path, fbx_box(texture=path)).parts
    material, uv = material_of(part), uv_of(part)
    assert np.asarray(material.baseColorTexture)[0, 0].tolist() == [0, 200, 0]
    assert material.baseColorFactor.tolist() == [255] * 4
    assert uv is not None and np.allclose(uv, [0.25, 0.75])


def test_textures_outside_of_the_folder_are_never_read(tmp_path: Path) -> None:
    Image.new("RGB", (4, 4)).save(tmp_path / "secret.png")
    folder = tmp_path / "inside"
    folder.mkdir()
    for path in ("../secret.png", str(tmp_path / "secret.png")):
        read = _read(folder, fbx_box(texture=path))
        assert material_of(read.parts[0]).baseColorTexture is None
        assert read.findings == ["texture 'secret.png' is not there; carried on without it"]


def test_it_is_told_by_what_it_holds_and_a_skeleton_is_told(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text(
        fbx_box(more='    Deformer: 60, "Deformer::", "Skin" {\n        Version: 101\n    }\n')
    )
    assert sniff(tmp_path / "a.obj").format == "fbx"
    read = read_mesh(tmp_path / "a.obj")
    assert read.findings == [
        "the file is named .obj and holds fbx; it was read as that",
        "it is bound to a skeleton, or has morph targets; it was taken as it was modelled",
    ]


@pytest.mark.parametrize(
    ("content", "cause"),
    [
        (fbx_box().encode()[:900], "its FBX is broken"),
        (fbx_box().replace("Geometry: 20", "Geometrie: 20").encode(), "its FBX is broken, or contains only points"),
        (fbx_box().replace("7.4.0", "6.1.0").encode(), "FBX 6.1 is not supported, only 7.1 (2011) and later"),
        (b"Kaydara FBX Binary  \x00\x1a\x00" + (6100).to_bytes(4, "little") + bytes(99), "FBX 6.1 is not supported"),
        (b"Kaydara FBX Binary  \x00\x1a\x00" + (7400).to_bytes(4, "little") + b"\xff" * 99, "its FBX is broken"),
        (b"Kaydara FBX Binary  \x00", "its FBX is broken"),
    ],
    ids=["cut", "no mesh", "old text", "old", "broken", "head alone"],
)  # fmt: skip
def test_broken_and_old_files_are_one_clear_line(tmp_path: Path, content: bytes, cause: str) -> None:
    (tmp_path / "a.fbx").write_bytes(content)
    with pytest.raises(InputError) as caught:
        read_mesh(tmp_path / "a.fbx")
    assert caught.value.reason == "unreadable" and cause in str(caught.value) and "\n" not in str(caught.value)


def test_too_many_faces_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="12 faces exceed the limit of 10") as caught:
        _read(tmp_path, fbx_box(), MeshLimits(max_faces=10))
    assert caught.value.reason == "too_large"


def test_what_reads_fbx_is_named_where_it_is_missing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fbx, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"the FBX reader is not installed; pip install 'manitwin\[fbx\]', or export"):
        _read(tmp_path, fbx_box())
