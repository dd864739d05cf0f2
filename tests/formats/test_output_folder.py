"""Folders to write into, asked before any work."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from manitwin.errors import UsageError
from manitwin.formats.output_folder import require_writable_folder


@pytest.mark.parametrize(
    ("folder", "why"),
    [
        ("file", "file: a file; give a folder to write twins into"),
        ("file/x", "file is a file; give a folder"),
        ("dangling", "dangling: a link that leads nowhere; give a folder"),
        ("dangling/x", "dangling is a link that leads nowhere; give a folder"),
        ("loop", "loop: a link that leads nowhere; give a folder"),
        ("a" * 300, r"cannot be written \(File name too long\); give a folder"),
        ("/dev/null/x", "/dev/null is a file; give a folder"),
        ("/proc/x", r"/proc/x: cannot be written \(.*\); give a folder"),
    ],
)
def test_what_cannot_be_a_folder_is_told_with_its_cause(tmp_path: Path, folder: str, why: str) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    with pytest.raises(UsageError, match=why):
        require_writable_folder(tmp_path / folder, "twins")


@pytest.mark.skipif(os.geteuid() == 0, reason="root writes everywhere")
def test_folder_that_may_only_be_read_is_told(tmp_path: Path) -> None:
    tmp_path.chmod(0o555)
    with pytest.raises(UsageError, match=r"cannot be written .Permission denied.; give a folder"):
        require_writable_folder(tmp_path / "out")


def test_folder_that_can_be_made_is_not_made(tmp_path: Path) -> None:
    (tmp_path / "there").mkdir()
    (tmp_path / "link").symlink_to("there")
    for folder in ("new", "new/deeper", "there", "link", "link/new"):
        require_writable_folder(tmp_path / folder)
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["link", "there"]
