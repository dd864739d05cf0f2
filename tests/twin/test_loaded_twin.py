from __future__ import annotations

import shutil
from pathlib import Path

import fsspec
import pytest

from manitwin.errors import UsageError
from manitwin.twin.loaded_twin import TwinSource
from twin_folders import write_set


def test_twins_are_found_in_a_data_set_and_in_a_flat_folder(tmp_path: Path) -> None:
    ids = write_set(tmp_path / "set", accepted=2, rejected=1)
    in_set = TwinSource(tmp_path / "set")
    for twin_id in ids:
        shutil.copytree(in_set.folder(twin_id), tmp_path / "flat" / twin_id)
    (tmp_path / "flat" / "notes").mkdir()
    flat = TwinSource(tmp_path / "flat")
    assert in_set.twin_ids() == flat.twin_ids() == sorted(ids)
    assert flat.twin(ids[0]).record == in_set.twin(ids[0]).record
    assert flat.record_bytes(ids[1]) == in_set.record_bytes(ids[1])
    for source in (flat, in_set):
        with pytest.raises(UsageError, match="no twin ffff"):
            source.folder("ffff")
        with pytest.raises(UsageError, match="no twin ffff"):
            source.record_bytes("ffff")


def test_twins_of_a_url_are_copied_once(tmp_path: Path) -> None:
    ids = write_set(tmp_path / "set", accepted=1, rejected=0)
    memory = fsspec.filesystem("memory")
    memory.put(str(tmp_path / "set") + "/", "/twin-source/", recursive=True)
    try:
        source = TwinSource("memory://twin-source", cache=tmp_path / "cache")
        assert source.twin_ids() == ids
        assert source.twin(ids[0]).record == TwinSource(tmp_path / "set").twin(ids[0]).record
        memory.rm("/twin-source/twins", recursive=True)
        assert source.folder(ids[0]) == tmp_path / "cache" / ids[0]
        with pytest.raises(UsageError, match="local folder"):
            TwinSource("memory://twin-source")
    finally:
        memory.rm("/twin-source", recursive=True)


def test_a_place_that_is_not_there_says_so(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no such folder"):
        TwinSource(tmp_path / "nowhere")


def test_missing_twins_are_counted_before_any_is_read(tmp_path: Path) -> None:
    ids = write_set(tmp_path / "set", accepted=2, rejected=0)
    source = TwinSource(tmp_path / "set")
    source.check(set(ids))
    with pytest.raises(UsageError, match=r"no twin ffff there \(2 of 4 are missing\).*--twins"):
        source.check({*ids, "gggg", "ffff"})
