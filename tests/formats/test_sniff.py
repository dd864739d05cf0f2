from __future__ import annotations

import csv
import json
import struct
import zipfile
from pathlib import Path

import pytest
import trimesh
from PIL import Image

from manitwin.errors import InputError
from manitwin.formats.sniff import Sniffed, sniff
from manitwin.pipeline.inspection import why_no_inputs


@pytest.mark.parametrize(
    ("suffix", "expected"), [("glb", "glb"), ("obj", "obj"), ("ply", "ply"), ("stl", "stl"), ("dae", "dae")]
)
def test_meshes_are_known_by_content_whatever_their_name(tmp_path: Path, suffix: str, expected: str) -> None:
    trimesh.creation.box().export(tmp_path / f"mesh.{suffix}")
    (tmp_path / f"mesh.{suffix}").rename(tmp_path / "mesh.png")
    assert sniff(tmp_path / "mesh.png") == Sniffed("mesh", expected)


@pytest.mark.parametrize("format", ["png", "jpeg", "gif", "webp", "tiff", "bmp"])
def test_images_are_known_by_content(tmp_path: Path, format: str) -> None:
    Image.new("RGB", (8, 8)).save(tmp_path / "thing.obj", format)
    assert sniff(tmp_path / "thing.obj") == Sniffed("image", format)


def test_binary_stl_whose_header_says_solid_is_still_binary_stl(tmp_path: Path) -> None:
    triangle = struct.pack("<12fH", *range(12), 0)
    (tmp_path / "a.stl").write_bytes(b"solid not ascii".ljust(80) + struct.pack("<I", 1) + triangle)
    assert sniff(tmp_path / "a.stl").format == "stl"


def test_gltf_json_is_told_from_other_json(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(json.dumps({"asset": {"version": "2.0"}}))
    assert sniff(tmp_path / "a.json").format == "gltf"
    (tmp_path / "b.gltf").write_text(json.dumps({"assets": [1, 2]}))
    with pytest.raises(InputError) as caught:
        sniff(tmp_path / "b.gltf")
    assert caught.value.reason == "wrong_type"


def test_zip_without_usd_layer_first_is_no_usdz(tmp_path: Path) -> None:
    with zipfile.ZipFile(tmp_path / "a.usdz", "w") as archive:
        archive.writestr("readme.txt", "hello")
    with pytest.raises(InputError, match="ZIP archive"):
        sniff(tmp_path / "a.usdz")


def test_prose_renamed_obj_is_wrong_type(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("v 1 2 3 is how vertices look.\nBut this is a letter.\nDear reader,\nfarewell.\n")
    with pytest.raises(InputError) as caught:
        sniff(tmp_path / "a.obj")
    assert caught.value.reason == "wrong_type"


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 1\n", "fetch it with git lfs pull"),
        ("\ufeff\n<!DOCTYPE html>\n<html><body>404 <svg></svg></body></html>", "a web page (HTML)"),
        ("<HTML><body>404</body></HTML>", "a web page (HTML)"),
        ('<svg xmlns="http://www.w3.org/2000/svg"/>', "an SVG drawing"),
        ('<?xml version="1.0"?>\n<!-- by hand -->\n<svg width="3">\n</svg>', "an SVG drawing"),
        ("<!-- a note -->", "holds plain text"),
    ],
)
@pytest.mark.parametrize("name", ["thing.png", "thing.obj"])
def test_what_is_often_found_in_a_file_s_place_is_told_with_what_to_do(
    tmp_path: Path, name: str, content: str, told: str
) -> None:
    (tmp_path / name).write_text(content, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        sniff(tmp_path / name)
    assert caught.value.reason == "wrong_type" and told in caught.value.detail and name in caught.value.detail


@pytest.mark.parametrize("name", ["scan.pdf", "photo.pam", "photo.eps"])
def test_pictures_of_other_kinds_are_told_by_their_suffix(tmp_path: Path, name: str) -> None:
    (tmp_path / name).write_bytes(b"P7\nWIDTH 8\n" + bytes(192))
    with pytest.raises(InputError, match="PNG or JPEG"):
        sniff(tmp_path / name)


def test_missing_file_is_unreadable(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        sniff(tmp_path / "gone.obj")
    assert caught.value.reason == "unreadable"


@pytest.mark.shared_data
def test_shared_inputs_are_what_their_manifest_says(shared_data: Path) -> None:
    with (shared_data / "manifest.csv").open() as stream:
        for row in csv.DictReader(stream):
            assert sniff(shared_data / row["file"]).kind == {"photo": "image", "mesh": "mesh"}[row["kind"]]


@pytest.mark.shared_data
@pytest.mark.parametrize(("name", "reason"), [("zero_byte.png", "empty"), ("text_renamed.png", "wrong_type")])
def test_bad_shared_inputs_are_refused(shared_data: Path, name: str, reason: str) -> None:
    with pytest.raises(InputError) as caught:
        sniff(shared_data / "bad" / name)
    assert caught.value.reason == reason
    assert caught.value.detail.startswith(name) and "\n" not in caught.value.detail


@pytest.mark.parametrize("content", [b"", b"(: exchange of the product model", b"PK\3\4" + bytes(60)])
@pytest.mark.parametrize("name", ["thing.iges", "a.zip", "robot.URDF", "clip.mp4"])
def test_single_file_is_refused_with_the_reason_of_a_folder(tmp_path: Path, name: str, content: bytes) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError) as refused:
        sniff(path)
    assert refused.value.reason == "wrong_type" and str(refused.value).endswith(f"{name}: {why_no_inputs([path])[0]}")


def test_image_under_such_a_name_is_an_image(tmp_path: Path) -> None:
    path = tmp_path / "photo.zip"
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64))
    assert sniff(path).format == "png"
