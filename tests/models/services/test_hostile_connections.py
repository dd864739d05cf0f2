"""Every served backend against a server that lies in HTTP itself: bodies without end, bombs, drips, headers, redirects."""

from __future__ import annotations

import gzip
import threading
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest

from hostile_services import SECRET, SERVICES, Script, raw_server, settings, used
from manitwin.errors import BadReply, RateLimited, Unavailable
from manitwin.models.generators import hunyuan3d
from manitwin.models.services import http

LIMIT = 100_000
Write = Callable[[bytes], None]


@pytest.fixture(autouse=True)
def small_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(http, "MAX_ANSWER_BYTES", LIMIT)
    monkeypatch.setattr(hunyuan3d, "MAX_ANSWER_BYTES", LIMIT)


@pytest.fixture(params=sorted(SERVICES))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def answer(body: bytes, *headers: bytes, status: bytes = b"200 OK") -> Script:
    """Return a script of one whole answer."""
    head = b"\r\n".join([b"HTTP/1.1 " + status, b"Content-Length: %d" % len(body), b"Connection: close", *headers])
    return lambda write: write(head + b"\r\n\r\n" + body)


def without_end(head: bytes, piece: bytes) -> Script:
    """Return a script that writes until nobody reads."""

    def script(write: Write) -> None:
        write(head)
        while True:
            write(piece)

    return script


OK = b"HTTP/1.1 200 OK\r\n"
BOMB = gzip.compress(bytes(50 * LIMIT))
ENDLESS = {
    "a body": without_end(OK + b"Connection: close\r\n\r\n", b" " * 4096),
    "a body that is announced": without_end(OK + b"Content-Length: 3000000000\r\n\r\n", b" " * 4096),
    "chunks": without_end(OK + b"Transfer-Encoding: chunked\r\n\r\n", b"1000\r\n" + b" " * 4096 + b"\r\n"),
    "a bomb": answer(BOMB, b"Content-Encoding: gzip"),
    "a bomb of zlib": answer(zlib.compress(bytes(50 * LIMIT)), b"Content-Encoding: deflate"),
    "empty blocks of gzip": without_end(
        OK + b"Content-Encoding: gzip\r\nConnection: close\r\n\r\n" + BOMB[:10], b"\x00\x00\x00\xff\xff" * 800
    ),
}


@pytest.mark.parametrize("what", sorted(ENDLESS))
def test_body_without_end_is_not_read_to_its_end(name: str, what: str, tmp_path: Path) -> None:
    with raw_server(ENDLESS[what]) as (url, asked):
        error = used(name, url, tmp_path)
    assert isinstance(error, BadReply | Unavailable) and f"{LIMIT} bytes" in str(error)
    assert len(asked) == 1 and not list(tmp_path.iterdir())


NO_HTTP = {
    "headers without end": without_end(OK, b"X-Header: " + b"y" * 4000 + b"\r\n"),
    "one header without end": without_end(OK + b"X: ", b"y" * 4096),
    "a status without end": without_end(b"HTTP/1.1 200 ", b"y" * 4096),
    "a length of 5000 digits": lambda write: write(OK + b"Content-Length: " + b"9" * 5000 + b"\r\n\r\n{}"),
    "a length of 20 digits": answer(b"{}", b"Content-Length: " + b"9" * 20),
    "a length below 0": lambda write: write(OK + b"Content-Length: -1\r\n\r\n{}"),
    "two lengths": answer(b"{}", b"Content-Length: 7"),
    "a chunk of 2^80 bytes": lambda write: write(OK + b"Transfer-Encoding: chunked\r\n\r\n" + b"f" * 21 + b"\r\n"),
    "an encoding that is not asked for": answer(b"{}", b"Content-Encoding: br, gzip"),
    "what is no gzip": answer(b"{}", b"Content-Encoding: gzip"),
    "another protocol": lambda write: write(b"SSH-2.0-OpenSSH_9.6\r\n"),
    "HTTP/2": lambda write: write(bytes.fromhex("000000040000000000")),
    "nothing": lambda write: None,
    "an upgrade": answer(b"", b"Upgrade: websocket", status=b"101 Switching Protocols"),
    "half a header": lambda write: write(OK + b"Content-Le"),
    "a header that is no text": answer(b"{}", b"X: \xff\xfe\x80", status=b"599 \xff\xfe"),
}


@pytest.mark.parametrize("what", sorted(NO_HTTP))
def test_what_is_no_answer_in_http_is_said_in_one_line(name: str, what: str, tmp_path: Path) -> None:
    with raw_server(NO_HTTP[what]) as (url, _):
        assert isinstance(used(name, url, tmp_path), BadReply | Unavailable)
    assert not list(tmp_path.iterdir())


NO_JSON = {
    "deep": b"[" * 20_000,
    "deep objects": b'{"error":' * 10_000,
    "deep and whole": b'{"message":' * 300 + b"1" + b"}" * 300,
    "many parts": b"[" + b"[]," * 30_000 + b"[]]",
    "a huge number": b'{"id": ' + b"9" * 10_000 + b"}",
    "not finite": b'{"id": NaN, "code": Infinity}',
    "1e400": b'{"code": 1e400}',
    "not UTF-8": b"\xff\xfe\x00",
    "nothing": b"",
    "half of a pair": b'{"error": {"message": "\\ud800", "code": "\\udfff"}, "code": 1, "detail": "\\ud800"}',
    "a page": b"<html>login</html>",
    "nul": b"\x00" * 1000,
}


@pytest.mark.parametrize("status", [b"200 OK", b"400 no", b"500 no", b"999 odd"])
@pytest.mark.parametrize("what", sorted(NO_JSON))
def test_body_that_is_no_answer_is_said_in_one_line(name: str, what: str, status: bytes, tmp_path: Path) -> None:
    with raw_server(answer(NO_JSON[what], status=status)) as (url, _):
        error = used(name, url, tmp_path)
    if error is None:  # /generate of hunyuan3d answers with a file, whatever is in it
        assert name == "hunyuan3d-2.1" and status == b"200 OK"


def test_drip_ends_by_the_deadline_of_the_whole_request(name: str, tmp_path: Path) -> None:
    stop = threading.Event()

    def drip(write: Write) -> None:
        write(OK + b"Content-Length: 90000\r\n\r\n")
        while not stop.wait(0.05):
            write(b" ")

    with raw_server(drip) as (url, asked):
        error = used(name, url, tmp_path, settings(timeout_s=0.5))
        stop.set()
    assert isinstance(error, Unavailable) and "no whole answer within 0.5 s" in str(error) and len(asked) == 1


def test_head_that_drips_ends_by_the_deadline_too(name: str, tmp_path: Path) -> None:
    stop = threading.Event()

    def drip(write: Write) -> None:
        while not stop.wait(0.05):
            write(b"HTTP/1.1 100 Continue\r\n\r\n")

    with raw_server(drip) as (url, _):
        error = used(name, url, tmp_path, settings(timeout_s=0.5))
        stop.set()
    assert isinstance(error, Unavailable) and "no whole answer within 0.5 s" in str(error)


@pytest.mark.parametrize("status", [b"301 to", b"302 to", b"303 to", b"307 to", b"308 to", b"300 to"])
def test_no_redirect_is_followed_with_a_key(name: str, status: bytes, tmp_path: Path) -> None:
    with raw_server(answer(b"{}")) as (elsewhere, stolen):
        with raw_server(answer(b"", b"Location: " + elsewhere.encode() + b"/x", status=status)) as (url, asked):
            error = used(name, url, tmp_path)
        with raw_server(answer(b"", b"Location: file:///etc/passwd", status=status)) as (url, _):
            used(name, url, tmp_path)
    assert isinstance(error, BadReply) and "redirects" in str(error)
    assert not stolen and len(asked) == 1


ODD_TIMES = [
    "NaN", "Infinity", "-1", "1e9", "1000000000", "9" * 5000, "\u00b2", "", " ", "0x10", "1_0", "Wed, 99 Foo 2099",
    "Mon, 01 Jan 0001 00:00:00 +2359", "Fri, 31 Dec 9999 23:59:59 -2359", "Wed, 21 Oct 99999 07:28:00 GMT",
]  # fmt: skip


@pytest.mark.parametrize("after", ODD_TIMES)
def test_odd_time_to_wait_does_no_harm(name: str, after: str, tmp_path: Path) -> None:
    busy = answer(b"{}", b"Retry-After: " + after.encode(), status=b"429 busy")
    with raw_server(busy) as (url, _):
        error = used(name, url, tmp_path)
    assert isinstance(error, RateLimited)
    assert error.retry_after_s is None or 0 <= error.retry_after_s <= 86_400


def test_key_is_in_one_header_of_each_request_and_nowhere_else(name: str, tmp_path: Path) -> None:
    with raw_server(answer(b"{}", status=b"400 no")) as (url, asked):
        used(name, url, tmp_path)
    (request,) = asked
    lines = [line for line in request.split(b"\r\n") if SECRET.encode() in line]
    assert all(line.lower().startswith((b"authorization: ", b"x-api-key: ")) for line in lines)
    assert len(lines) == {"hunyuan3d-2.0": 0, "hunyuan3d-2.1": 0, "anthropic": 2}.get(name, 1)
