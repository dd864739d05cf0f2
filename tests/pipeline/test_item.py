import dataclasses
import os
from pathlib import Path

import pytest

from manitwin.errors import InputError
from manitwin.pipeline.item import Item, twin_id


def test_identity_depends_on_bytes_name_size_units_and_up_only(tmp_path: Path) -> None:
    file, copy, other = tmp_path / "a.stl", tmp_path / "b.stl", tmp_path / "c.stl"
    file.write_bytes(b"same")
    copy.write_bytes(b"same")
    other.write_bytes(b"other")
    item = Item(file=str(file))
    assert twin_id(item) == twin_id(Item(file=str(copy), license="CC0-1.0", attribution="somebody"))
    changed = [
        Item(file=str(other)),
        *(
            dataclasses.replace(item, **c)
            for c in ({"name": "mug"}, {"units": "mm"}, {"up": "y"}, {"longest_side_m": 0.1})
        ),
    ]
    assert len({twin_id(item), *map(twin_id, changed)}) == 6


def test_changed_texture_is_another_twin(tmp_path: Path) -> None:
    (tmp_path / "a.obj").write_text("mtllib a.mtl\n")
    (tmp_path / "a.mtl").write_text("newmtl m\nmap_Kd wood grain.png\n")
    (tmp_path / "wood grain.png").write_bytes(b"1")
    before = twin_id(Item(file=str(tmp_path / "a.obj")))
    (tmp_path / "wood grain.png").write_bytes(b"2")
    assert twin_id(Item(file=str(tmp_path / "a.obj"))) != before


@pytest.mark.parametrize("what", ["nothing", "pipe", "device", "loop"])
def test_a_file_that_is_another_thing_by_now_is_unreadable(tmp_path: Path, what: str) -> None:
    path = tmp_path / "a.stl"
    if what == "pipe":
        os.mkfifo(path)
    elif what != "nothing":
        path.symlink_to("/dev/zero" if what == "device" else path)
    with pytest.raises(InputError, match=r"a\.stl: .*; (check the path|give a file)") as caught:
        twin_id(Item(file=str(path)))
    assert caught.value.reason == "unreadable"


def test_an_imported_asset_is_told_by_its_folder_since_all_have_one_file_name(tmp_path: Path) -> None:
    mesh, record = tmp_path / "padlock" / "asset.glb", tmp_path / "padlock" / "import.json"
    assert Item(file=str(mesh), given=str(record)).title == "padlock"
    assert Item(file=str(mesh)).title == "asset.glb"
