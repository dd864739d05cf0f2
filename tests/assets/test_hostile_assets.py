"""Assets of others that are pipes, devices, links out of their folder, or deeper than can be read: a line, and no waiting."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from foreign_assets import gso, manitwin100k, mug_urdf
from manitwin.assets.audit.check import audit_path
from manitwin.assets.audit.run import find_all
from manitwin.assets.audit.selection import select_rules
from manitwin.assets.importers.importer import import_assets
from manitwin.assets.read import find_assets, read_asset
from manitwin.errors import AssetError, UsageError
from manitwin.twin.import_record import IMPORT_RECORD, read_import_record

ROBOT = '<robot name="r"><link name="l"><visual><geometry><box size="1 1 1"/></geometry></visual></link></robot>'
MAIN = ("a.urdf", "a.xml", "a.sdf", "a.usda", "model_data0.json", "twin.json", "manipulation_annotations.json")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    made = tmp_path / "asset"
    made.mkdir()
    return made


@pytest.mark.parametrize("name", MAIN)
@pytest.mark.parametrize("kind", ["pipe", "device", "loop", "nowhere", "folder"])
def test_main_file_that_is_no_file_is_refused_without_waiting(
    name: str, kind: str, folder: Path, tmp_path: Path
) -> None:
    file = folder / name
    match kind:
        case "pipe":
            os.mkfifo(file)
        case "folder":
            file.mkdir()
        case _:
            file.symlink_to({"device": "/dev/zero", "loop": name, "nowhere": "/nonexistent"}[kind])
    for place in (file, folder):
        with pytest.raises(AssetError) as found:
            read_asset(place)
        assert len(str(found.value).splitlines()) == 1
        assert audit_path(place, select_rules([""], [""])).findings[0].code == "FIL001"
    assert not [path for path in find_assets(folder) if path != folder]
    imported = list(import_assets([folder], tmp_path / "out"))
    assert [each.folder for each in imported] == [None] and not (tmp_path / "out").exists()


@pytest.mark.parametrize("name", ["a.urdf", "a.xml", "sub/a.urdf", "model_data0.json"])
def test_links_out_of_a_folder_are_no_assets_of_it(name: str, folder: Path, tmp_path: Path) -> None:
    secret = tmp_path / "secret.urdf"
    secret.write_text(ROBOT)
    (folder / name).parent.mkdir(exist_ok=True)
    (folder / name).symlink_to(secret)
    before = secret.stat().st_atime_ns
    assert list(find_assets(folder)) == []
    with pytest.raises(AssetError, match=r"holds no asset|no such file|is read"):
        read_asset(folder)
    assert secret.stat().st_atime_ns == before


def test_a_link_that_a_person_names_and_one_inside_of_the_folder_are_read(folder: Path, tmp_path: Path) -> None:
    file = mug_urdf(folder)
    (folder / "other.urdf").symlink_to(file.name)
    assert [path.name for path in find_assets(folder)] == ["mug.urdf", "other.urdf"]
    assert read_asset(folder / "other.urdf").visual


@pytest.mark.parametrize(
    "content",
    ["[" * 200_000, '{"scale": ' + "9" * 10_000 + "}", '{"scale": 1e400}', '{"scale": NaN}', "\0\0", "[1]", "", "\xff"],
    ids=["deep", "huge integer", "1e400", "NaN", "NUL", "list", "empty", "latin-1"],
)
@pytest.mark.parametrize("name", ["model_data0.json", "manipulation_annotations.json", IMPORT_RECORD])
def test_broken_json_of_any_format_is_one_line(content: str, name: str, folder: Path) -> None:
    if name == "manipulation_annotations.json":
        folder = manitwin100k(folder)
    (folder / name).write_bytes(content.encode("latin-1"))
    error: type[Exception] = UsageError if name == IMPORT_RECORD else AssetError
    with pytest.raises(error) as found:
        read_import_record(folder / name) if name == IMPORT_RECORD else read_asset(folder)
    assert name in str(found.value) and len(str(found.value)) < 500 and len(str(found.value).splitlines()) == 1


def test_import_record_is_a_regular_file_of_its_folder(folder: Path, tmp_path: Path) -> None:
    (tmp_path / "out.json").write_text("{}")
    for replace in (lambda p: p.symlink_to(tmp_path / "out.json"), lambda p: p.symlink_to("/dev/zero"), os.mkfifo):
        make: Callable[[Path], object] = replace
        (folder / IMPORT_RECORD).unlink(missing_ok=True)
        make(folder / IMPORT_RECORD)
        with pytest.raises(UsageError, match=r"import\.json: (leads out|is a|cannot)"):
            read_import_record(folder / IMPORT_RECORD)
    (folder / IMPORT_RECORD).unlink()
    (folder / IMPORT_RECORD).write_text(json.dumps({"\x1b[31m": 1}))
    with pytest.raises(UsageError, match="import the asset again"):
        read_import_record(folder / IMPORT_RECORD)


def test_pictures_and_metadata_that_lead_out_of_a_scan_are_not_read(folder: Path, tmp_path: Path) -> None:
    place = gso(folder)
    (tmp_path / "metadata").write_text('categories { first: "CANARY" }')
    (place / "metadata.pbtxt").unlink()
    (place / "metadata.pbtxt").symlink_to(tmp_path / "metadata")
    assert read_asset(place / "model.sdf").category != "CANARY"


def test_pipes_that_are_named_are_refused(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "x.urdf")
    with pytest.raises(AssetError, match="is no regular file"):
        find_all([tmp_path / "x.urdf"])
    with pytest.raises(AssetError, match="is no regular file"):
        list(import_assets([tmp_path / "x.urdf"], tmp_path / "out"))
