"""The pictures that FBX files name: found in binary and text, beside the file whatever machine wrote it."""

from __future__ import annotations

from pathlib import Path

import pytest

from fbx_document import fbx_box
from manitwin.formats.fbx_names import embedded_files, fbx_file_names, relative_name
from manitwin.formats.source_files import named_files, side_files
from manitwin.pipeline.item import Item, twin_id


@pytest.mark.parametrize(
    ("name", "there"),
    [
        ("a.png", "a.png"),
        ("textures\\a.png", "textures/a.png"),
        ("C:\\Users\\somebody\\a.png", "a.png"),
        ("/home/somebody/a.png", "a.png"),
        ("..\\..\\maps\\a.png", "a.png"),
    ],
)
def test_names_of_other_machines_count_by_their_last_part(name: str, there: str) -> None:
    assert relative_name(name) == there


def test_names_are_found_in_text_and_in_bytes() -> None:
    assert set(fbx_file_names(fbx_box(texture="maps/a.png").encode())) == {"maps/a.png"}
    binary = b"\x10RelativeFilenameS" + (9).to_bytes(4, "little") + b"maps\\a.pn" + b"\x08FileNameS\xff\xff\xff\xff"
    assert list(fbx_file_names(binary)) == ["maps/a.pn"]
    assert list(fbx_file_names(b"RelativeFilename" * 3 + b"FileName: broken")) == []


def _record(key: bytes, value: bytes, kind: bytes = b"S") -> bytes:
    return bytes([len(key)]) + key + kind + len(value).to_bytes(4, "little") + value


def test_pictures_within_a_file_are_found_by_their_names() -> None:
    one = _record(b"Filename", b"C:\\maps\\a.png") + _record(b"RelativeFilename", b"maps\\a.png")
    two = _record(b"Filename", b"/home/b.jpg")
    data = one + _record(b"Content", b"AAA", b"R") + two + _record(b"Content", b"BB", b"R")
    assert embedded_files(data) == {"a.png": b"AAA", "b.jpg": b"BB"}
    cut = _record(b"Content", b"AAA", b"R")[:-1]
    assert embedded_files(one + cut) == {} and embedded_files(_record(b"Content", b"", b"R")) == {}


def test_a_texture_beside_a_file_is_one_of_its_files_and_part_of_what_a_twin_is(tmp_path: Path) -> None:
    mesh, picture = tmp_path / "box.fbx", tmp_path / "a.png"
    mesh.write_text(fbx_box(texture="a.png"))
    picture.write_bytes(b"one")
    assert list(named_files(mesh)) == ["a.png"] and side_files(mesh) == [picture]
    before = twin_id(Item(str(mesh)))
    picture.write_bytes(b"another")
    assert twin_id(Item(str(mesh))) != before
