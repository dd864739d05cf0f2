import json
from pathlib import Path

import pytest
from rejected_records import rejected_record

from manitwin.errors import TwinError, UsageError
from manitwin.twin.migration import SCHEMA_VERSION
from manitwin.twin.store import read_record, replace_folder, revision_of, write_bytes_atomically, write_twin_record


@pytest.fixture
def sealed(tmp_path: Path) -> Path:
    folder = tmp_path / "abc"
    folder.mkdir()
    (folder / "source.png").write_bytes(b"")
    write_twin_record(folder, rejected_record())
    return folder


def test_sealed_folder_reads_back_verified(sealed: Path) -> None:
    record = read_record(sealed, verify=True)
    assert record.rejection is not None and record.rejection.reason == "empty"
    assert set(record.files) == {"source.png"}
    assert record.revision == revision_of(json.loads((sealed / "twin.json").read_text()))


def test_run_json_is_not_part_of_the_revision(sealed: Path) -> None:
    (sealed / "run.json").write_text("{}")
    before = read_record(sealed, verify=True).revision
    assert write_twin_record(sealed, rejected_record()).revision == before


@pytest.mark.parametrize("alter", ["content", "missing", "record"])
def test_altered_twin_is_refused(sealed: Path, alter: str) -> None:
    if alter == "content":
        (sealed / "source.png").write_bytes(b"x")
    elif alter == "missing":
        (sealed / "source.png").unlink()
    else:
        path = sealed / "twin.json"
        path.write_text(path.read_text().replace("nothing in it", "something in it"))
    with pytest.raises(TwinError, match=r"altered|missing"):
        read_record(sealed, verify=True)


def test_unknown_schema_version_is_named(sealed: Path) -> None:
    path = sealed / "twin.json"
    path.write_text(path.read_text().replace(f'"schema_version": {SCHEMA_VERSION}', '"schema_version": 99'))
    with pytest.raises(TwinError, match="99"):
        read_record(sealed)


def test_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "file"
    target.write_bytes(b"old")

    def fail(*_: object) -> None:
        raise OSError("disk full")

    monkeypatch.setattr("os.fsync", fail)
    with pytest.raises(OSError, match="disk full"):
        write_bytes_atomically(target, b"new")
    assert target.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [target]


def test_folder_in_the_place_of_a_file_is_said_and_stays(tmp_path: Path) -> None:
    (tmp_path / "attempts.parquet").mkdir()
    with pytest.raises(UsageError, match=r"attempts\.parquet: is a folder"):
        write_bytes_atomically(tmp_path / "attempts.parquet", b"new")
    assert [each.name for each in tmp_path.iterdir()] == ["attempts.parquet"]


def test_replacing_a_folder_leaves_only_the_new_one(tmp_path: Path) -> None:
    new, place = tmp_path / "work" / "new", tmp_path / "place"
    for folder, text in ((new, "new"), (place, "old")):
        folder.mkdir(parents=True)
        (folder / "file").write_text(text)
    (place / "stale").write_text("")
    replace_folder(new, place)
    assert [p.name for p in place.iterdir()] == ["file"]
    assert (place / "file").read_text() == "new"
    assert list((tmp_path / "work").iterdir()) == []
