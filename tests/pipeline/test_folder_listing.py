"""Every file of a folder is an input, a part of one, or left alone with the reason; the counts add up."""

from __future__ import annotations

import contextlib
import json
import os
import struct
from collections.abc import Iterable, Iterator
from pathlib import Path

import pytest
from PIL import Image

from manitwin.formats.isolated import Limits, ProcessCrashed, iterate_isolated, run_isolated
from manitwin.formats.source_files import named_file
from manitwin.pipeline import inspection
from manitwin.pipeline.folder_listing import FolderListing, list_folder
from manitwin.pipeline.manifest import Notes, iterate_items

OBJ = "mtllib mug.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def put(folder: Path, files: dict[str, str | bytes]) -> Path:
    for name, content in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content.encode() if isinstance(content, str) else content)
    return folder


def listed(folder: Path) -> FolderListing:
    """List a folder, and check what holds of every listing: each file of the disk is in exactly one place."""
    listing = list_folder(folder)
    assets = {p / "asset.glb" if p.is_dir() else p for p in listing.inputs}
    everything = [*assets, *listing.parts, *listing.left]
    assert len(everything) == len(set(everything)) == listing.files
    on_disk = {Path(top) / name for top, _, names in os.walk(folder) for name in names}
    assert {p for p in everything if not p.is_dir()} == {p for p in on_disk if not p.is_dir()}
    return listing


def names(folder: Path, paths: object) -> list[str]:
    return [p.relative_to(folder).as_posix() for p in paths]  # type: ignore[attr-defined]


def test_photos_beside_a_mesh_are_inputs_and_its_texture_is_a_part(tmp_path: Path) -> None:
    photos = {f"photo{i}.jpg": b"\xff\xd8\xff" for i in range(1, 6)}
    put(tmp_path, {"mug.obj": OBJ, "mug.mtl": "newmtl a\nmap_Kd colours.png\n", "colours.png": b"x", **photos})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["mug.obj", *photos]
    assert names(tmp_path, listing.parts) == ["colours.png", "mug.mtl"]
    assert set(listing.parts.values()) == {tmp_path / "mug.obj"}
    first, beside = listing.remarks()
    assert first.endswith("8 files: 6 inputs (1 mesh, 5 images), 2 textures and material files of 1 mesh")
    assert "5 images beside a mesh, named by none, are inputs of their own" in beside


def test_avif_is_an_input_and_heic_is_named_with_the_remedy(tmp_path: Path) -> None:
    Image.new("RGB", (40, 40)).save(tmp_path / "photo.avif")
    heic = b"\0\0\0\x18ftypheic\0\0\0\0mif1heic" + bytes(64)
    put(tmp_path, {"photo.heic": heic, "renamed_without_suffix": heic, "notes.txt": "hello"})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["photo.avif"]
    assert listing.left[tmp_path / "photo.heic"] == "HEIC is not read; convert it to PNG or JPEG"
    assert listing.left[tmp_path / "renamed_without_suffix"] == listing.left[tmp_path / "photo.heic"]
    assert listing.left[tmp_path / "notes.txt"] == "not an image or a mesh"
    assert f"{tmp_path}: left alone: notes.txt: not an image or a mesh" in listing.remarks()


def test_an_image_under_another_name_is_an_input_as_it_is_alone(tmp_path: Path) -> None:
    Image.new("RGB", (40, 40)).save(tmp_path / "photo.jfif", format="JPEG")
    assert names(tmp_path, listed(tmp_path).inputs) == ["photo.jfif"]


def glb(document: dict[str, object]) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    return struct.pack("<4sIIII", b"glTF", 2, 20 + len(text), len(text), 0x4E4F534A) + text


@pytest.mark.parametrize(
    ("mesh", "content"),
    [
        ("m.gltf", json.dumps({"asset": {}, "images": [{"uri": "tex/my%20map.jpg"}], "buffers": [{"uri": "m.bin"}]})),
        ("m.glb", glb({"asset": {"version": "2.0"}, "images": [{"uri": "tex/my map.jpg"}], "buffers": [{"uri": "m.bin"}]})),
        ("m.ply", "ply\nformat ascii 1.0\ncomment TextureFile tex/my map.jpg\nend_header\n"),
        ("m.dae", '<COLLADA><image><init_from>./tex/my%20map.jpg</init_from></image></COLLADA>'),
        ("m.dae", '<COLLADA><image><init_from>\n<ref>tex/my map.jpg</ref></init_from></image></COLLADA>'),
        ("m.obj", "v 0 0 0\nmtllib m.mtl\n"),
    ],
)  # fmt: skip
def test_what_any_format_names_is_a_part_of_its_mesh(tmp_path: Path, mesh: str, content: str | bytes) -> None:
    material = "newmtl a\nmap_Kd -s 2 2 -clamp on tex\\my map.jpg\n"
    beside: dict[str, str | bytes] = {"m.mtl": material} if mesh == "m.obj" else {}
    beside |= {"m.bin": b"1"} if mesh in ("m.gltf", "m.glb") else {}
    put(tmp_path, {mesh: content, "tex/my map.jpg": b"x", "photo.jpg": b"x", **beside})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == [mesh, "photo.jpg"]
    assert names(tmp_path, listing.parts) == sorted([*beside, "tex/my map.jpg"])


def test_a_texture_that_is_not_where_its_mesh_says_is_no_photo(tmp_path: Path) -> None:
    put(tmp_path, {"a/mug.obj": OBJ, "a/mug.mtl": "newmtl a\nmap_Kd C:\\maps\\Wood.png\nmap_Ks ../b/shine.jpg\n"})
    put(tmp_path, {"a/wood.PNG": b"x", "b/shine.jpg": b"x", "b/lamp.jpg": b"x"})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["a/mug.obj", "b/lamp.jpg"]
    reasons = {listing.left[tmp_path / "a/wood.PNG"], listing.left[tmp_path / "b/shine.jpg"]}
    assert reasons == {"a mesh names a file of this name, but not where it lies, so it is not read"}


def test_a_picture_named_like_a_map_beside_a_mesh_is_left_alone_and_elsewhere_an_input(tmp_path: Path) -> None:
    maps = ["mug_Normal.png", "textures/Mug_BaseColor_4k.jpg", "texture0.png", "mug_metallic-roughness.png"]
    put(tmp_path, {"with/mug.stl": b"x", **{f"with/{name}": b"x" for name in maps}, "without/texture.png": b"x"})
    put(tmp_path, {"with/red_mug.png": b"x"})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["with/mug.stl", "with/red_mug.png", "without/texture.png"]
    assert names(tmp_path, listing.left) == sorted(f"with/{name}" for name in maps)
    assert all("named like a texture map" in reason for reason in listing.left.values())


def test_hidden_files_links_and_what_is_no_file_are_named(tmp_path: Path) -> None:
    put(tmp_path, {"cup.jpg": b"x", ".DS_Store": b"x", ".git/a.png": b"x", ".git/deep/b.png": b"x"})
    (tmp_path / "again.jpg").symlink_to(tmp_path / "cup.jpg")
    (tmp_path / "gone.jpg").symlink_to(tmp_path / "nothing.jpg")
    (tmp_path / "up").symlink_to(tmp_path.parent)
    os.mkfifo(tmp_path / "pipe.jpg")
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["cup.jpg"]
    said = dict(zip(names(tmp_path, listing.left), listing.left.values(), strict=True))
    assert [name for name, reason in said.items() if reason == "hidden"] == [
        ".DS_Store",
        ".git/a.png",
        ".git/deep/b.png",
    ]
    assert said["again.jpg"] == "a link to cup.jpg"
    assert (
        "a broken link" in said["gone.jpg"]
        and "link to a folder" in said["up"]
        and said["pipe.jpg"] == "not a regular file"
    )


def test_a_folder_of_twins_gives_none_of_its_files_as_inputs(tmp_path: Path) -> None:
    put(
        tmp_path,
        {"out/0123/twin.json": '{"twin_id": "0123"}', "out/0123/visual.glb": b"x", "out/0123/views/rgb_00.webp": b"x"},
    )
    put(tmp_path, {"cup.jpg": b"x", "mine/twin.json": "{}", "mine/mug.jpg": b"x"})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["cup.jpg", "mine/mug.jpg"]
    assert listing.left[tmp_path / "out/0123/visual.glb"] == "part of a twin that manitwin built"


IMPORTED = {
    **dict.fromkeys(("category", "license", "attribution", "mass_kg", "center_of_mass_m", "inertia_kg_m2", "material")),
    **dict.fromkeys(("friction_static", "friction_dynamic", "restitution")),
    **{name: [] for name in ("captions", "functional_points", "grasp_points", "grasps", "rests", "missing", "remarks")},
    "format": "urdf",
    "file": "mug.urdf",
    "name": "mug",
    "asset_to_object": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]],
}


def test_an_imported_asset_is_one_input_with_its_parts(tmp_path: Path) -> None:
    record = json.dumps(IMPORTED)
    put(tmp_path, {"mug/asset.glb": b"x", "mug/import.json": record, "mug/more/view.png": b"x", "cup.jpg": b"x"})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["cup.jpg", "mug"]
    assert names(tmp_path, listing.parts) == ["mug/import.json", "mug/more/view.png"]
    assert listing.remarks()[0].endswith("4 files: 2 inputs (1 image, 1 imported asset), 2 files of 1 imported asset")


@pytest.mark.parametrize("record", ["{}", "[" * 100_000, json.dumps(IMPORTED | {"name": 1e400}), "\xff"])
def test_an_import_that_cannot_be_read_is_left_alone_and_ends_nothing(tmp_path: Path, record: str) -> None:
    put(tmp_path, {"mug/asset.glb": b"x", "mug/import.json": record, "cup.jpg": b"x"})
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["cup.jpg"]
    assert listing.left[tmp_path / "mug/asset.glb"].startswith("an imported asset: ")
    assert all("\n" not in reason for reason in listing.left.values())


def test_what_is_no_regular_file_is_not_opened(tmp_path: Path) -> None:
    put(tmp_path, {"cup.jpg": b"x", "mug.obj": "mtllib a.mtl\n", "deep/twin.json": "x"})
    (tmp_path / "deep/twin.json").unlink()
    for name in ("pipe.glb", "pipe", "deep/twin.json"):
        os.mkfifo(tmp_path / name)
    (tmp_path / "null.obj").symlink_to("/dev/null")
    (tmp_path / "a.mtl").symlink_to("/dev/zero")
    (tmp_path / "loop.obj").symlink_to("loop.obj")
    listing = listed(tmp_path)
    assert names(tmp_path, listing.inputs) == ["cup.jpg", "mug.obj"]


def inspected_by(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str) -> FolderListing:
    """List three meshes; the process that inspects them does what ``body`` says with the path of each."""
    module = tmp_path / "module"
    module.mkdir()
    (module / "hostile_reader.py").write_text(f"def read(path):\n    {body}\n    return []\n")
    monkeypatch.setenv("PYTHONPATH", f"{module}:{os.environ.get('PYTHONPATH', '')}")
    run_isolated_anew()
    limits = Limits(seconds=1.0, memory_bytes=1 << 30)

    def names_of(meshes: Iterable[Path]) -> Iterator[list[str] | inspection.NotInspected]:
        return (
            inspection._found(answer, limits) for _, answer in iterate_isolated("hostile_reader:read", meshes, limits)
        )

    monkeypatch.setattr("manitwin.pipeline.folder_listing.names_of", names_of)
    return listed(put(tmp_path / "in", {"a.obj": OBJ, "bad.obj": OBJ, "c.obj": OBJ, "photo.png": "x"}))


def run_isolated_anew() -> None:
    with contextlib.suppress(ProcessCrashed):
        run_isolated("os:abort")


@pytest.mark.parametrize(
    ("body", "why"),
    [
        ("import os; path.name == 'bad.obj' and os.abort()", "longer than 1 s, or crashes the process"),
        (
            "import re; path.name == 'bad.obj' and re.match('(a+)+b', 'a' * 64)",
            "longer than 1 s, or crashes the process",
        ),
        ("path.name == 'bad.obj' and bytearray(1 << 40)", "more than 1 GiB of memory"),
        ("import time; path.name == 'bad.obj' and time.sleep(1e6)", "longer than 1 s"),
    ],
)
def test_a_mesh_that_cannot_be_inspected_within_the_limits_is_left_alone_by_itself(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, body: str, why: str
) -> None:
    listing = inspected_by(tmp_path, monkeypatch, body)
    root = tmp_path / "in"
    assert names(root, listing.inputs) == ["a.obj", "c.obj", "photo.png"]
    assert list(listing.left) == [root / "bad.obj"] and why in listing.left[root / "bad.obj"]


def test_long_lists_are_counted_by_reason_and_kept_whole(tmp_path: Path) -> None:
    put(tmp_path, {"cup.jpg": b"x", **{f"{i:03}.txt": "x" for i in range(200)}, "scan.blend": b"x"})
    listing = listed(tmp_path)
    lines = listing.remarks()
    assert lines[0].endswith("202 files: 1 input (1 image), 201 left alone")
    assert f"{tmp_path}: left alone: 200 files (000.txt, 001.txt, 002.txt, ...): not an image or a mesh" in lines
    assert any("scan.blend: this mesh format is not read; export it" in line for line in lines)
    assert len(lines) == 3 and len(listing.left) == 201


def test_nothing_is_said_where_every_file_is_an_input(tmp_path: Path) -> None:
    assert listed(put(tmp_path, {"a.jpg": b"x", "b/c.stl": b"x"})).remarks() == []


def test_meshes_are_not_opened_where_nothing_could_be_a_part_of_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    put(tmp_path, {"a.obj": OBJ, "b.gltf": "{}", "README.md": "x", "LICENSE": "x"})
    monkeypatch.setattr("manitwin.pipeline.folder_listing.names_of", lambda paths: pytest.fail("meshes were opened"))
    assert names(tmp_path, listed(tmp_path).inputs) == ["a.obj", "b.gltf"]


def test_a_listing_says_how_far_it_is(tmp_path: Path) -> None:
    root = put(tmp_path / "scans", {f"{k}/{k}.obj": "mtllib m.mtl\n" for k in range(3)} | {"0/m.mtl": "map_Kd t.png\n"})
    put(root, {"0/t.png": b"x"})
    said: list[str] = []
    list_folder(root, said.append)
    assert said[0] == "0 files found in scans" and "files found in scans" in said[3]
    assert said[-1] == "3 of 3 meshes of scans searched for the files that they reference"
    notes = Notes()
    list(iterate_items([root], {}, notes))
    assert notes.under_way == said[-1]


def test_files_beside_a_mesh_are_its_parts_without_being_resolved(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A link, a folder above, or another spelling is still looked for on the disk."""
    put(
        tmp_path,
        {"plain/a.obj": "mtllib a.mtl\n", "plain/a.mtl": "map_Kd maps/t%201.png\n", "plain/maps/t%201.png": b"x"},
    )
    put(
        tmp_path,
        {"plain/maps/t 1.png": b"x", "up/b.obj": "mtllib x/../b.mtl\n", "up/b.mtl": "newmtl b\n", "up/x/y.jpg": b"x"},
    )
    put(tmp_path, {"link/c.obj": "mtllib c.mtl\n", "link/d.mtl": "newmtl c\n"})
    (tmp_path / "link" / "c.mtl").symlink_to("d.mtl")
    asked: list[str] = []

    def found(folder: Path, name: str) -> Path | None:
        asked.append(name)
        return named_file(folder, name)

    monkeypatch.setattr("manitwin.pipeline.folder_listing.named_file", found)
    parts = {str(k.relative_to(tmp_path)): str(v.relative_to(tmp_path)) for k, v in list_folder(tmp_path).parts.items()}
    assert parts == {
        "plain/a.mtl": "plain/a.obj",
        "plain/maps/t%201.png": "plain/a.obj",
        "plain/maps/t 1.png": "plain/a.obj",
        "up/b.mtl": "up/b.obj",
        "link/c.mtl": "link/c.obj",
        "link/d.mtl": "link/c.obj",
    }
    assert asked == ["c.mtl", "x/../b.mtl"]


def hostile_texts() -> dict[str, str]:
    long = 3_000_000
    return {
        "blank_lines.obj": "\n" * long,
        "spaces.obj": "mtllib " + " " * long + "x",
        "one_line.obj": "mtllib" * (long // 6),
        "open.dae": "<init_from>" * (long // 11),
        "spaces.dae": "<init_from>" + " " * long,
        "maps.obj": "mtllib maps.mtl\n",
        "maps.mtl": "map_Kd" + " " * long + "\n" * long + "bump\n" * (long // 5),
        "deep.gltf": '{"uri":' * (long // 7),
        "short.glb": "glTF",
        "header.ply": "ply\n" + "comment TextureFile \n" * (long // 21),
        "photo.png": "x",
    }


def test_hostile_text_takes_no_more_than_a_pass(tmp_path: Path) -> None:
    # a backtracking expression takes hours here; no bound on time is asserted, the suite's own limit would show it
    listing = listed(put(tmp_path, dict(hostile_texts())))
    assert tmp_path / "photo.png" in listing.inputs
    assert listing.parts == {tmp_path / "maps.mtl": tmp_path / "maps.obj"}


def test_a_folder_of_asset_descriptions_is_told_of_import_and_one_of_meshes_is_not(tmp_path: Path) -> None:
    for name in ("cup/seen.obj", "cup/hull.obj"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    assert not any("manitwin import" in line for line in list_folder(tmp_path).remarks())
    (tmp_path / "cup/cup.urdf").write_text("<robot name='cup'/>")
    told = list_folder(tmp_path).remarks()[1]
    assert (
        "makes one input of each of 1 asset description with its meshes; here 2 meshes are things of their own" in told
    )
