import json
from pathlib import Path

import pytest

from input_items import collect_items
from manitwin.errors import UsageError


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    for name in (
        "cup.glb",
        "photo.jpg",
        "with_texture/model.obj",
        "with_texture/texture.png",
        "photos/a.png",
        ".hidden/b.png",
    ):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"x")
    return tmp_path


def test_folder_takes_meshes_and_photos_but_not_textures_and_accounts_for_every_file(folder: Path) -> None:
    (folder / "cup.glb").rename(folder / "photos" / "cup.glb")
    items, notes = collect_items([folder])
    names = [Path(item.file or "").relative_to(folder).as_posix() for item in items]
    assert names == ["photo.jpg", "photos/a.png", "photos/cup.glb", "with_texture/model.obj"]
    (listing,) = notes.folders
    assert listing.files == 6 == sum(path.is_file() for path in folder.rglob("*"))
    assert {path.name for path in listing.left} == {"texture.png", "b.png"}
    assert (
        notes.remarks == listing.remarks()
        and "6 files: 4 inputs (2 meshes, 2 images), 2 left alone" in notes.remarks[0]
    )


def test_csv_rows_override_what_holds_for_all(folder: Path) -> None:
    manifest = folder / "list.csv"
    manifest.write_text("file,name,units,license\ncup.glb,cup,mm,CC0-1.0\nphoto.jpg,,,\n,,,\n".replace("\n,,,\n", "\n"))
    items, _ = collect_items([manifest], units="cm", name="thing")
    assert [(i.name, i.units, i.license) for i in items] == [("cup", "mm", "CC0-1.0"), ("thing", "cm", None)]
    assert items[0].file == str(folder / "cup.glb")


def test_a_row_says_its_size_by_its_longest_side_or_by_its_unit(folder: Path) -> None:
    """What a row says of either counts before what holds for all; a row that says both, or neither rightly, is told."""
    manifest = folder / "list.csv"
    manifest.write_text("file,units,longest_side_m\ncup.glb,,0.12\ncup.glb,mm,\nphoto.jpg,none,.3\nphoto.jpg,,\n")
    items, _ = collect_items([manifest], units="cm")
    said = [("auto", 0.12), ("mm", None), ("none", 0.3), ("cm", None)]
    assert [(item.units, item.longest_side_m) for item in items] == said
    items, _ = collect_items([manifest], longest_side_m=0.5)
    assert [item.longest_side_m for item in items] == [0.12, None, 0.3, 0.5]
    for row, told in (
        ("cup.glb,mm,0.1", r"list\.csv:2: longest_side_m: the unit mm already determines the size of the mesh"),
        ("photo.jpg,,12 cm", r"list\.csv:2: longest_side_m is 12 cm; give metres, more than 0"),
        ("photo.jpg,,0", "longest_side_m is 0; give metres"),
        ("photo.jpg,,inf", "longest_side_m is inf; give metres"),
        ("photo.jpg,,1e-290", "longest_side_m is 1e-290; give metres"),
    ):
        manifest.write_text(f"file,units,longest_side_m\n{row}\n")
        with pytest.raises(UsageError, match=told):
            collect_items([manifest])
    manifest.write_text("text,longest_side_m\na mug,0.1\n")
    with pytest.raises(UsageError, match="a text states the size in its words"):
        collect_items([manifest])
    manifest.write_text("file,height_m\nphoto.jpg,0.1\n")
    assert "'height_m' (did you mean 'longest_side_m'?)" in collect_items([manifest])[1].remarks[0]


def test_jsonl_holds_texts_and_absolute_paths(folder: Path) -> None:
    manifest = folder / "list.jsonl"
    manifest.write_text(
        json.dumps({"text": "a red mug", "name": "mug"}) + "\n\n" + json.dumps({"file": str(folder / "cup.glb")})
    )
    items, _ = collect_items([manifest])
    assert items[0].text == "a red mug" and items[0].file is None
    assert items[1].file == str(folder / "cup.glb")


def test_repeated_inputs_are_one_item(folder: Path) -> None:
    items, _ = collect_items([folder / "cup.glb", folder / "cup.glb"])
    assert len(items) == 1


def test_columns_that_nobody_knows_are_a_remark_with_the_nearest_name(folder: Path) -> None:
    manifest = folder / "list.csv"
    manifest.write_text("file,mass_kg,unit,License\ncup.glb,0.1,mm,MIT\nphoto.jpg,,,\n")
    items, notes = collect_items([manifest])
    assert [item.units for item in items] == ["auto", "auto"]
    (remark,) = notes.remarks
    assert "columns not used: 'License' (did you mean 'license'?), 'mass_kg', 'unit' (did you mean 'units'?)" in remark


def test_columns_that_nobody_knows_are_an_error_where_it_is_asked_for(folder: Path) -> None:
    manifest = folder / "list.csv"
    manifest.write_text("file,unit\ncup.glb,m\n")
    with pytest.raises(UsageError, match=r"unknown column 'unit' \(did you mean 'units'\?\); valid: file, text"):
        collect_items([manifest], strict=True)
    manifest.write_text("file,zeal,yard,xylem,width,vigour,azimuth\ncup.glb,1,2,3,4,5,6\n")
    with pytest.raises(UsageError, match="unknown column 'azimuth'"):
        collect_items([manifest], strict=True)  # whatever the hashes of names are in this process
    manifest.write_text("file,units\ncup.glb,m\n")
    collect_items([manifest], strict=True)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("fil,name\ncup.glb,cup\n", "did you mean 'file'"),
        ("file,units\ncup.glb,inch\n", "Valid: auto, cm, m, mm, none"),
        ("file\nnot_there.glb\n", "not_there.glb is not found"),
        ("file,text\ncup.glb,a cup\n", "either 'file' or 'text'"),
        ("name\ncup\n", "either 'file' or 'text'"),
        ("file\n", "no rows"),
        ("file,name\ncup.glb,a,b\n", "more values than columns"),
        ("file;name\ncup.glb;cup\n", "list.csv:1: its columns are separated by semicolons"),
        ("file\tname\ncup.glb\tcup\n", "list.csv:1: its columns are separated by tabs"),
        ("cup.glb,cup\nphoto.jpg,cup\n", "the first line must name the columns; unknown: 'cup'"),
        ("file\nhttps://example.org/cup.glb\n", "is a URL; URLs are not downloaded"),
    ],
)
def test_bad_manifest_is_one_clear_error(folder: Path, content: str, message: str) -> None:
    manifest = folder / "list.csv"
    manifest.write_text(content)
    with pytest.raises(UsageError, match=message):
        collect_items([manifest])


@pytest.mark.parametrize(("value", "kind"), [(["cup"], "list"), ({"en": "cup"}, "dict"), (True, "bool")])
def test_value_of_json_that_is_no_text_is_an_error_that_names_its_column(
    folder: Path, value: object, kind: str
) -> None:
    manifest = folder / "list.jsonl"
    manifest.write_text(json.dumps({"file": "photo.jpg", "name": value, "tags": ["a", "b"]}) + "\n")
    with pytest.raises(UsageError, match=rf"list\.jsonl:1: name: is a {kind}; give one text or number"):
        collect_items([manifest])
    manifest.write_text(json.dumps({"file": "photo.jpg", "name": None, "tags": ["a", "b"]}) + "\n")
    (item,), _ = collect_items([manifest])
    assert item.name is None


def test_manifest_that_is_no_text_is_told(folder: Path) -> None:
    manifest = folder / "list.csv"
    manifest.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(UsageError, match="not UTF-8"):
        collect_items([manifest])


def test_path_that_is_not_there_is_a_usage_error(folder: Path) -> None:
    with pytest.raises(UsageError, match="not found"):
        collect_items([folder / "nothing.png"])
    with pytest.raises(UsageError, match="a URL; URLs are not downloaded"):
        collect_items([Path("https://example.org/mug.png")])


def test_folder_without_inputs_is_told_with_what_it_has(tmp_path: Path) -> None:
    (tmp_path / "photo.heic").write_bytes(b"x")
    with pytest.raises(
        UsageError,
        match=r"this folder contains no image or mesh; left alone: photo\.heic: HEIC is"
        " not read",
    ):
        collect_items([tmp_path])
    (tmp_path / "photo.heic").unlink()
    with pytest.raises(UsageError, match="no image or mesh"):
        collect_items([tmp_path])


def test_a_link_keeps_its_name_where_its_target_is_named_by_a_digest(tmp_path: Path) -> None:
    (tmp_path / "blobs").mkdir()
    (tmp_path / "blobs/3f2a90c1").write_text("v 0 0 0")
    (tmp_path / "blobs/other.obj").write_text("v 0 0 1")
    (tmp_path / "snapshot").mkdir()
    (tmp_path / "snapshot/mug.obj").symlink_to("../blobs/3f2a90c1")
    (tmp_path / "snapshot/cup.obj").symlink_to("../blobs/other.obj")
    items, _ = collect_items([tmp_path / "snapshot"])
    assert {Path(item.file or "").name for item in items} == {"mug.obj", "other.obj"}
