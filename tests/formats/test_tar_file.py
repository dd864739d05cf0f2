"""Tarballs give named members alone, within limits."""

from __future__ import annotations

import gzip
import io
import tarfile
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.formats.tar_file import read_members

MIB = 1 << 20


def _tarball(path: Path, members: dict[str, bytes], links: dict[str, str] | None = None) -> Path:
    with tarfile.open(path, "w:gz") as archive:
        for name, content in members.items():
            info = tarfile.TarInfo(name)
            info.size = len(content)
            archive.addfile(info, io.BytesIO(content))
        for name, target in (links or {}).items():
            info = tarfile.TarInfo(name)
            info.type, info.linkname = tarfile.SYMTYPE, target
            archive.addfile(info)
    return path


def test_wanted_members_are_read_and_links_are_not(tmp_path: Path) -> None:
    path = _tarball(tmp_path / "a.tgz", {"a/b": b"one", "../c": b"two"}, {"a/passwd": "/etc/passwd"})
    found = read_members(path, lambda name: 10 if name.startswith("a/") else 0, UsageError, max_unpacked_bytes=MIB)
    assert found == {"a/b": b"one"}
    assert sorted(p.name for p in tmp_path.iterdir()) == ["a.tgz"]


@pytest.mark.parametrize("size", [30 * MIB, 300 * MIB])
def test_a_bomb_is_refused_before_it_is_unpacked(tmp_path: Path, size: int) -> None:
    """A gigabyte of zeros is a megabyte of gzip; it may also hide in a member's long name."""
    path = tmp_path / "bomb.tgz"
    head = tarfile.TarInfo("a/b")
    head.size, head.type = size, tarfile.GNUTYPE_LONGNAME
    with gzip.open(path, "wb", compresslevel=1) as stream:
        stream.write(head.tobuf(tarfile.GNU_FORMAT))
        for _ in range(30):
            stream.write(bytes(MIB))
    with pytest.raises(UsageError, match="unpacks to more") as caught:
        read_members(path, lambda name: 100, UsageError, max_unpacked_bytes=8 * MIB)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "content", [b"", b"no gzip at all", gzip.compress(b"x" * 700, mtime=0), gzip.compress(bytes(4000), mtime=0)[:-9]]
)
def test_what_is_no_tarball_is_refused_in_one_line(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.tgz"
    path.write_bytes(content)
    with pytest.raises(UsageError, match=r"a\.tgz: no gzipped tarball") as caught:
        read_members(path, lambda name: 100, UsageError, max_unpacked_bytes=MIB)
    assert "\n" not in str(caught.value)


def test_a_member_beyond_its_limit_is_refused(tmp_path: Path) -> None:
    path = _tarball(tmp_path / "a.tgz", {"a/b": b"12345"})
    with pytest.raises(UsageError, match="larger than 4"):
        read_members(path, lambda name: 4, UsageError, max_unpacked_bytes=MIB)
