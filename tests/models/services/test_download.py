"""Finished files: fetched whole or not at all, and without the key."""

from __future__ import annotations

import socket
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from hostile_services import raw_server
from manitwin.errors import BadReply, Unavailable
from manitwin.models.fakes.server import FakeServer, Response
from scripted_service import KEY, Client, Script, error_of


def _download(server: FakeServer, folder: Path, url: str | None = None, **arguments: Any) -> None:
    Client(server.url).service.download(url or f"{server.url}/file", folder / "made.glb", **arguments)


def test_download_is_asked_for_without_the_key(tmp_path: Path) -> None:
    data = bytes(range(256)) * 999
    with FakeServer(Script(Response(302, b"", {"Location": "/store"}), Response(200, data))) as server:
        _download(server, tmp_path)
    assert (tmp_path / "made.glb").read_bytes() == data
    assert [request.path for request in server.requests] == ["/file", "/store"]
    for request in server.requests:
        assert "authorization" not in request.headers and KEY not in str(request)


def test_download_of_broken_files(tmp_path: Path) -> None:
    cut, empty = Response(200, b"x" * 999, cut_after=500), Response(200, b"")
    for broken, words in ((cut, "truncated"), (empty, "is empty")):
        with FakeServer(Script(broken)) as server:
            assert words in str(error_of(lambda server=server: _download(server, tmp_path)))  # type: ignore[misc]
            assert len(server.requests) == 3
        with FakeServer(Script(broken, Response(200, b"whole"))) as server:
            _download(server, tmp_path)
        assert (tmp_path / "made.glb").read_bytes() == b"whole"
        (tmp_path / "made.glb").unlink()
        assert not list(tmp_path.iterdir())


def test_download_is_bounded(tmp_path: Path) -> None:
    with FakeServer(Script(Response(200, b"x" * 4000))) as server:
        error = error_of(lambda: _download(server, tmp_path, max_bytes=3999))
        assert type(error) is BadReply and "3999 bytes" in str(error) and not list(tmp_path.iterdir())
        _download(server, tmp_path, max_bytes=4000)
    assert len(server.requests) == 2


def test_length_that_is_not_announced_is_bounded_too(tmp_path: Path) -> None:
    listener = socket.create_server(("127.0.0.1", 0))

    def endless() -> None:
        connection, _ = listener.accept()
        with connection:
            connection.recv(9999)
            try:
                connection.sendall(b"HTTP/1.1 200 OK\r\nConnection: close\r\n\r\n")
                while True:
                    connection.sendall(b"x" * 4096)
            except OSError:
                return

    thread = threading.Thread(target=endless)
    thread.start()
    url = f"http://127.0.0.1:{listener.getsockname()[1]}"
    error = error_of(lambda: Client(url).service.download(url, tmp_path / "m.glb", 100_000))
    thread.join(10)
    listener.close()
    assert type(error) is BadReply and "100000 bytes" in str(error) and not list(tmp_path.iterdir())


def test_file_that_drips_ends_by_the_deadline(tmp_path: Path) -> None:
    stop = threading.Event()

    def drip(write: Callable[[bytes], None]) -> None:
        write(b"HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n")
        while not stop.wait(0.05):
            write(b"x")

    with raw_server(drip) as (url, asked):
        service = Client(url, timeout_s=0.5, retries=1).service
        error = error_of(lambda: service.download(url, tmp_path / "m.glb"))
        stop.set()
    assert type(error) is BadReply and "too slowly (no whole answer within 0.5" in str(error)
    assert len(asked) == 2 and not list(tmp_path.iterdir())


@pytest.mark.parametrize("status", [401, 403, 404, 410])
def test_expired_link_is_replaced_once(tmp_path: Path, status: int) -> None:
    with FakeServer(Script(Response(status, b"<Error/>"), Response(200, b"whole"))) as server:
        fresh = f"{server.url}/fresh"
        _download(server, tmp_path, fresh_url=lambda: fresh)
        assert [request.path for request in server.requests] == ["/file", "/fresh"]
    with FakeServer(Script(Response(status, b"<Error/>"))) as server:
        error = error_of(lambda: _download(server, tmp_path, fresh_url=lambda: f"{server.url}/fresh"))
        assert type(error) is BadReply and "no longer valid" in str(error) and len(server.requests) == 2


@pytest.mark.parametrize("link", ["file:///etc/passwd", "ftp://host/x", "/file", "", "None", "http://[", "http://a b/"])
def test_links_that_are_no_web_address(tmp_path: Path, link: str) -> None:
    with FakeServer(Script(Response(200, b"data"), Response(302, b"", {"Location": "file:///etc/passwd"}))) as server:
        if link:
            assert type(error_of(lambda: _download(server, tmp_path, link))) is BadReply
        server.service.count = 1  # type: ignore[attr-defined]
        assert "file" in str(error_of(lambda: _download(server, tmp_path)))
    assert not list(tmp_path.iterdir())


def test_redirects_end(tmp_path: Path) -> None:
    with FakeServer(Script(Response(302, b"", {"Location": "/file"}))) as server:
        assert "more than 5 times" in str(error_of(lambda: _download(server, tmp_path)))
        assert len(server.requests) == 6


def test_service_of_https_gives_no_file_of_http(tmp_path: Path) -> None:
    with FakeServer(Script(Response(200, b"data"))) as server:
        service = Client("https://localhost:1").service
        assert "only https" in str(error_of(lambda: service.download(server.url, tmp_path / "m")))
        assert not server.requests


def test_store_that_is_down(tmp_path: Path) -> None:
    with FakeServer(Script(Response(503, b"later"))) as server:
        assert type(error_of(lambda: _download(server, tmp_path))) is Unavailable and len(server.requests) == 3
