"""Weights lie in one folder, with their record, and are checked when they are read."""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.models.weights.catalog import KNOWN_WEIGHTS
from manitwin.models.weights.store import FOLDER, find_stored, read_stored, store, weights_folder

WEIGHTS = replace(KNOWN_WEIGHTS["isnet"], sha256=hashlib.sha256(b"network").hexdigest())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(FOLDER, str(tmp_path / "models"))
    return tmp_path / "models"


def test_the_folder_is_the_named_one_or_that_of_the_desktop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv(FOLDER, raising=False)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    assert weights_folder() == tmp_path / "manitwin" / "models"
    monkeypatch.setenv("XDG_DATA_HOME", "relative")  # the specification: to be ignored
    assert weights_folder() == Path.home() / ".local" / "share" / "manitwin" / "models"


def test_what_was_stored_is_read_with_its_licence(folder: Path) -> None:
    assert find_stored("isnet") is None
    store(WEIGHTS, b"network")
    found = find_stored("isnet")
    assert found is not None and found.path.parent == folder and "MIT" in found.licence
    assert read_stored(found) == b"network"
    assert sorted(path.suffix for path in folder.iterdir()) == [".json", ".onnx"]


def test_a_changed_file_is_refused(folder: Path) -> None:
    added = store(WEIGHTS, b"network")
    added.path.write_bytes(b"netwonk")
    with pytest.raises(UsageError, match="sha256"):
        read_stored(added)


@pytest.mark.parametrize("record", ["[]", "{", '{"file": "../../x", "sha256": "", "source": "", "licence": ""}', "{}"])
def test_a_broken_record_is_refused_with_its_remedy(folder: Path, record: str) -> None:
    folder.mkdir()
    (folder / "isnet.json").write_text(record)
    with pytest.raises(UsageError, match="manitwin models add isnet"):
        find_stored("isnet")


def test_a_folder_that_cannot_be_made_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    monkeypatch.setenv(FOLDER, str(tmp_path / "file"))
    with pytest.raises(UsageError, match=FOLDER):
        store(WEIGHTS, b"network")
