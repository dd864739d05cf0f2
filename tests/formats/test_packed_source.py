import hashlib
import os
import zipfile
from pathlib import Path

import pytest

from manitwin.errors import InputError
from manitwin.formats import packed_source
from manitwin.formats.packed_source import pack_source


def packed(path: Path, kept: Path, *beside: Path) -> tuple[str, bytes]:
    kept.mkdir(exist_ok=True)
    name, sha256 = pack_source(path, kept, beside)
    content = (kept / name).read_bytes()
    assert hashlib.sha256(content).hexdigest() == sha256
    return name, content


def test_archive_holds_every_part_and_is_repeatable(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib a b.mtl\n")
    (tmp_path / "a b.mtl").write_text("map_Kd -s 1 1 1 tex/t.png\n")
    (tmp_path / "tex").mkdir()
    (tmp_path / "tex" / "t.png").write_bytes(b"png")
    name, content = packed(tmp_path / "a.obj", tmp_path / "kept")
    assert name == "source.zip"
    with zipfile.ZipFile(tmp_path / "kept" / name) as archive:
        assert sorted(archive.namelist()) == ["a b.mtl", "a.obj", "tex/t.png"]
        assert archive.read("tex/t.png") == b"png"
    assert packed(tmp_path / "a.obj", tmp_path / "again")[1] == content


def test_single_file_is_kept_byte_for_byte(tmp_path: Path) -> None:
    (tmp_path / "a.STL").write_bytes(b"\x00\x01")
    assert packed(tmp_path / "a.STL", tmp_path / "kept") == ("source.stl", b"\x00\x01")


def test_the_texture_that_a_ply_names_belongs_to_its_source(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(b"ply\nformat ascii 1.0\ncomment TextureFile my colours.png\nend_header\n")
    (tmp_path / "my colours.png").write_bytes(b"png")
    name, _ = packed(tmp_path / "a.ply", tmp_path / "kept")
    with zipfile.ZipFile(tmp_path / "kept" / name) as archive:
        assert (name, sorted(archive.namelist())) == ("source.zip", ["a.ply", "my colours.png"])


def test_a_link_to_a_mesh_elsewhere_is_kept_under_the_links_name(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "real.obj").write_text("mtllib m.mtl\n")
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "a.obj").symlink_to(tmp_path / "elsewhere" / "real.obj")
    (tmp_path / "in" / "m.mtl").write_text("newmtl a\n")
    name, _ = packed(tmp_path / "in" / "a.obj", tmp_path / "kept")
    with zipfile.ZipFile(tmp_path / "kept" / name) as archive:
        assert archive.namelist() == ["a.obj", "m.mtl"]


def test_a_sparse_file_of_gigabytes_is_told_and_not_copied(tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[31m.glb"
    path.write_bytes(b"glTF")
    os.truncate(path, packed_source.MAX_KEPT_BYTES + 1)
    name, content = packed(path, tmp_path / "kept")
    assert name == "source.txt" and b"4294967297 bytes, not kept" in content and b"\x1b" not in content


def test_a_reference_says_names_sizes_and_digests_and_no_folder(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    (tmp_path / "kept").mkdir()
    (tmp_path / "in" / "a.obj").write_text("mtllib m.mtl\n")
    (tmp_path / "in" / "m.mtl").write_text("newmtl a\n")
    name, sha256 = packed_source.pack_source(tmp_path / "in" / "a.obj", tmp_path / "kept", keep=False)
    content = (tmp_path / "kept" / name).read_bytes()
    assert [path.name for path in (tmp_path / "kept").iterdir()] == [name] == ["source.txt"]
    assert sha256 == hashlib.sha256(content).hexdigest()
    digests = [hashlib.sha256(text).hexdigest() for text in (b"mtllib m.mtl\n", b"newmtl a\n")]
    assert content.decode().splitlines() == [
        f"a.obj: 13 bytes, sha256 {digests[0]}, not kept",
        f"m.mtl: 9 bytes, sha256 {digests[1]}, not kept",
    ]


def test_photos_by_reference_keep_their_order(tmp_path: Path) -> None:
    for called in ("z.png", "a.png"):
        (tmp_path / called).write_bytes(called.encode())
    name, _ = packed_source.pack_photos([tmp_path / "z.png", tmp_path / "a.png"], tmp_path, keep=False)
    first, second = (tmp_path / name).read_text().splitlines()
    assert first.startswith("photo_00.png: 5 bytes, sha256 ") and hashlib.sha256(b"z.png").hexdigest() in first
    assert second.startswith("photo_01.png") and hashlib.sha256(b"a.png").hexdigest() in second


def test_an_input_that_is_gone_or_became_a_pipe_is_unreadable(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^unreadable: a\.obj: cannot be opened"):
        packed(tmp_path / "a.obj", tmp_path / "kept")
    os.mkfifo(tmp_path / "a.obj")
    with pytest.raises(InputError, match="named pipe"):
        packed(tmp_path / "a.obj", tmp_path / "kept")
