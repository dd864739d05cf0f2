"""The root of a data set, local and elsewhere."""

from __future__ import annotations

import pickle
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.twin.dataset_root import DatasetRoot


@pytest.fixture(params=["local", "memory"])
def root(request: pytest.FixtureRequest, tmp_path: Path) -> DatasetRoot:
    return DatasetRoot(tmp_path / "d" if request.param == "local" else f"memory://{tmp_path}/d")


def test_what_is_written_is_read(root: DatasetRoot, tmp_path: Path) -> None:
    root.write_bytes("a/b.txt", b"one")
    root.write_bytes("a/b.txt", b"two")
    (tmp_path / "file").write_bytes(b"three")
    root.put_file(tmp_path / "file", "a/c.txt")
    assert root.read_bytes("a/b.txt") == b"two"
    assert root.names_below("a") == ["a/b.txt", "a/c.txt"]
    root.fetch_file("a/c.txt", tmp_path / "back" / "c.txt")
    assert (tmp_path / "back" / "c.txt").read_bytes() == b"three"
    root.remove("a")
    root.remove("a")
    assert not root.exists("a/b.txt") and root.names_below("a") == []


def test_a_folder_replaces_the_one_before(root: DatasetRoot, tmp_path: Path) -> None:
    for number, names in enumerate((["twin.json", "old"], ["twin.json", "sub/new"])):
        fresh = (root.local or tmp_path) / f"fresh{number}"
        for name in names:
            (fresh / name).parent.mkdir(parents=True, exist_ok=True)
            (fresh / name).write_text(str(number))
        root.put_folder(fresh, "twins/ab/abc")
        assert not fresh.exists()
    assert root.names_below("twins/ab/abc") == ["twins/ab/abc/sub/new", "twins/ab/abc/twin.json"]
    assert list(root.twin_ids()) == ["abc"]


@pytest.mark.parametrize("name", ["../x", "a/../../x", "/etc/passwd"])
def test_names_do_not_leave_the_root(root: DatasetRoot, name: str) -> None:
    with pytest.raises(UsageError, match="lies outside"):
        root.read_bytes(name)
    with pytest.raises(UsageError, match="lies outside"):
        root.write_bytes(name, b"")


def test_it_goes_to_another_process(root: DatasetRoot) -> None:
    root.write_bytes("x", b"1")
    assert pickle.loads(pickle.dumps(root)).read_bytes("x") == b"1"


def test_an_unknown_protocol_is_refused() -> None:
    with pytest.raises(UsageError, match="nowhere://x"):
        DatasetRoot("nowhere://x")


def test_absolute_of_a_folder_is_a_path_and_of_a_url_the_url(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert DatasetRoot("some/set").absolute() == str(tmp_path.resolve() / "some" / "set")
    assert DatasetRoot("memory://bucket/set").absolute() == "memory://bucket/set"


@pytest.mark.parametrize("url", ["s3://AKIA:secret@bucket/x", "ftp://me:secret@h:1/x", "simplecache::s3://a:secret@b"])
def test_password_in_a_url_is_refused_and_not_shown(url: str) -> None:
    with pytest.raises(UsageError, match="password or a key") as caught:
        DatasetRoot(url)
    assert "secret" not in str(caught.value)
