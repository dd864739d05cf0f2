from __future__ import annotations

import os
import socket
import tracemalloc
from functools import partial
from pathlib import Path

import pytest

from manitwin.errors import AssetError, InputError, UsageError
from manitwin.formats.bounded_file import open_regular, read_bytes, read_text


def test_whole_file_is_read_up_to_the_limit_itself(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"12345")
    assert read_bytes(tmp_path / "a", 5, AssetError) == b"12345"
    with pytest.raises(AssetError, match=r"^a: 5 bytes exceed the limit of 4; give a smaller file$"):
        read_bytes(tmp_path / "a", 4, AssetError)


def test_sparse_file_is_refused_by_its_size_before_it_is_read(tmp_path: Path) -> None:
    with (tmp_path / "a").open("wb") as stream:
        stream.truncate(1 << 42)
    with pytest.raises(AssetError, match=f"a: {1 << 42} bytes exceed"):
        read_bytes(tmp_path / "a", 1 << 20, AssetError)


def test_file_that_says_it_is_empty_is_read_no_further_than_the_limit() -> None:
    assert read_bytes(Path("/proc/self/stat"), 1 << 16, AssetError)
    with pytest.raises(AssetError, match=r"stat: 11 bytes exceed the limit of 10"):
        read_bytes(Path("/proc/self/stat"), 10, AssetError)


def make_pipe(path: Path) -> None:
    os.mkfifo(path)


def make_folder(path: Path) -> None:
    path.mkdir()


def make_link_to_device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def make_link_to_pipe(path: Path) -> None:
    os.mkfifo(path.with_name("pipe"))
    path.symlink_to("pipe")


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (make_pipe, "thing: is a named pipe, but only regular files are read; give a file"),
        (make_link_to_pipe, "thing: is a named pipe, but only regular files are read; give a file"),
        (make_folder, "thing: is a folder, but only regular files are read; give a file"),
        (make_link_to_device, "thing: is a device, but only regular files are read; give a file"),
        (lambda path: path.symlink_to(path.name), "thing: cannot be opened (Too many levels of symbolic links); "),
        (lambda path: None, "thing: cannot be opened (No such file or directory); check the path"),
    ],
)
def test_what_is_no_regular_file_is_refused_without_waiting(tmp_path: Path, make, said: str) -> None:  # type: ignore[no-untyped-def]
    make(tmp_path / "thing")
    with pytest.raises(AssetError) as caught:
        open_regular(tmp_path / "thing", AssetError)
    assert str(caught.value).startswith(said)


def test_socket_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)  # the name of a socket has at most 107 characters
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("s")
        with pytest.raises(AssetError, match=r"^s: cannot be opened|^s: is a socket"):
            open_regular(Path("s"), AssetError)


@pytest.mark.parametrize("name", ["a\0b", "n" * 300, "x/" * 3000])
def test_name_that_no_file_can_have_is_one_short_line(tmp_path: Path, name: str) -> None:
    with pytest.raises(AssetError, match="cannot be opened") as caught:
        read_bytes(tmp_path / name, 10, AssetError, name=name)
    assert len(str(caught.value)) < 300 and "\0" not in str(caught.value)


def test_link_is_followed_inside_its_folder_only(tmp_path: Path) -> None:
    (tmp_path / "in" / "deep").mkdir(parents=True)
    (tmp_path / "secret").write_text("secret")
    (tmp_path / "in" / "there").write_text("here")
    (tmp_path / "in" / "deep" / "good").symlink_to("../there")
    (tmp_path / "in" / "deep" / "bad").symlink_to("../../secret")
    (tmp_path / "in" / "up").symlink_to("..")
    inside = tmp_path / "in"
    assert read_text(inside / "deep" / "good", 100, AssetError, inside=inside) == "here"
    for way in ("deep/bad", "up/secret", "../secret", str(tmp_path / "secret")):
        with pytest.raises(AssetError, match="leads outside its folder"):
            read_text(inside / way, 100, AssetError, inside=inside)


def test_folder_that_is_itself_a_link_holds_its_files(tmp_path: Path) -> None:
    (tmp_path / "real").mkdir()
    (tmp_path / "real" / "a").write_text("x")
    (tmp_path / "link").symlink_to("real")
    assert read_text(tmp_path / "link" / "a", 10, AssetError, inside=tmp_path / "link") == "x"


def test_error_is_the_one_of_the_border_that_reads(tmp_path: Path) -> None:
    with pytest.raises(InputError) as caught:
        read_bytes(tmp_path / "gone.obj", 10, partial(InputError, "unreadable"))
    assert caught.value.reason == "unreadable" and caught.value.detail.startswith("gone.obj: cannot be opened")


def test_text_is_utf8_with_or_without_a_byte_order_mark(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes("\ufeffgrün".encode())
    assert read_text(tmp_path / "a", 100, AssetError) == "grün"
    (tmp_path / "a").write_bytes("grün".encode("latin-1"))
    with pytest.raises(AssetError, match=r"a: not UTF-8 text \(.* at byte 2\); save it as UTF-8"):
        read_text(tmp_path / "a", 100, AssetError)


def test_message_shows_a_name_that_a_terminal_would_obey(tmp_path: Path) -> None:
    path = tmp_path / "a\x1b[31m\u202e\n.obj"
    with pytest.raises(AssetError) as caught:
        read_bytes(path, 10, AssetError)
    assert str(caught.value).startswith(r"a\x1b[31m\u202e\n.obj: ")


def test_memory_is_asked_for_by_the_size_of_a_file_and_not_by_the_limit(tmp_path: Path) -> None:
    (tmp_path / "small").write_bytes(b"x" * 1000)
    tracemalloc.start()
    try:
        assert read_bytes(tmp_path / "small", 1 << 33, UsageError) == b"x" * 1000
        assert tracemalloc.get_traced_memory()[1] < 1 << 20
    finally:
        tracemalloc.stop()


def test_a_file_that_says_it_is_empty_is_read_to_its_end_or_the_limit() -> None:
    assert len(read_bytes(Path("/proc/self/maps"), 1 << 24, UsageError)) > 0
    with pytest.raises(UsageError, match="exceed the limit of 10"):
        read_bytes(Path("/proc/self/maps"), 10, UsageError)
