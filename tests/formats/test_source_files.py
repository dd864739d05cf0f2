import io
import json
import zipfile
from pathlib import Path

from manitwin.formats.source_files import pack_source, side_files


def test_side_files_never_leave_the_folder(tmp_path: Path) -> None:
    secret = tmp_path / "secret.png"
    secret.write_bytes(b"secret")
    folder = tmp_path / "mesh"
    folder.mkdir()
    (folder / "link.png").symlink_to(secret)
    (folder / "inside.png").write_bytes(b"fine")
    images = [
        {"uri": u}
        for u in ("../secret.png", str(secret), "link.png", "inside.png", "http://x/y.png", "data:image/png;base64,")
    ]
    (folder / "a.gltf").write_text(json.dumps({"images": images, "buffers": "nonsense"}))
    assert side_files(folder / "a.gltf") == [folder / "inside.png"]


def test_archive_holds_every_part_and_is_repeatable(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib a b.mtl\n")
    (tmp_path / "a b.mtl").write_text("map_Kd -s 1 1 1 tex/t.png\n")
    (tmp_path / "tex").mkdir()
    (tmp_path / "tex" / "t.png").write_bytes(b"png")
    name, content = pack_source(tmp_path / "a.obj")
    assert name == "source.zip"
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert sorted(archive.namelist()) == ["a b.mtl", "a.obj", "tex/t.png"]
        assert archive.read("tex/t.png") == b"png"
    assert pack_source(tmp_path / "a.obj")[1] == content


def test_single_file_is_kept_byte_for_byte(tmp_path: Path) -> None:
    (tmp_path / "a.STL").write_bytes(b"\x00\x01")
    assert pack_source(tmp_path / "a.STL") == ("source.stl", b"\x00\x01")


def test_the_texture_that_a_ply_names_belongs_to_its_source(tmp_path: Path) -> None:
    (tmp_path / "a.ply").write_bytes(b"ply\nformat ascii 1.0\ncomment TextureFile my colours.png\nend_header\n")
    (tmp_path / "my colours.png").write_bytes(b"png")
    name, content = pack_source(tmp_path / "a.ply")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert (name, sorted(archive.namelist())) == ("source.zip", ["a.ply", "my colours.png"])


def test_files_are_found_as_the_reader_finds_them(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text('mtllib "m.mtl"\n')
    (tmp_path / "m.mtl").write_text("newmtl a\nmap_Kd -bm 0.5 tex\\my map.png\nnorm %2e%2e/secret.png\n")
    (tmp_path / "tex").mkdir()
    (tmp_path / "tex" / "my map.png").write_bytes(b"png")
    assert side_files(tmp_path / "a.obj") == [tmp_path / "m.mtl", tmp_path / "tex" / "my map.png"]
