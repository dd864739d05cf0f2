"""The client of services: what is retried, what is never repeated, and where the key goes."""

from __future__ import annotations

import socket
import time
from datetime import UTC, datetime, timedelta
from email.utils import format_datetime
from typing import Any

import pytest

from manitwin.config import ServicesConfig
from manitwin.errors import AccessDenied, BadReply, ConfigError, RateLimited, Rejected, Unavailable
from manitwin.models.fakes.server import FakeServer, Request, Response
from manitwin.models.services.http import FormFile, HttpService
from manitwin.models.services.refusal import AnswerLost, NotFound, Refusal, RequestRejected
from scripted_service import KEY, OK, Client, Script, error_of

STATUSES = [
    (401, AccessDenied, 1),
    (402, AccessDenied, 1),
    (403, AccessDenied, 1),
    (400, RequestRejected, 1),
    (404, NotFound, 1),
    (410, NotFound, 1),
    (422, RequestRejected, 1),
    (429, RateLimited, 3),
    (500, Unavailable, 3),
    (502, Unavailable, 3),
    (503, Unavailable, 3),
    (504, Unavailable, 3),
    (301, BadReply, 1),
]


@pytest.mark.parametrize(("status", "kind", "requests"), STATUSES)
def test_statuses_of_a_safe_request(status: int, kind: type, requests: int) -> None:
    with FakeServer(Script(Response(status, {"error": {"message": f"no, {KEY}\nreally"}}))) as server:
        client = Client(server.url)
        error = error_of(lambda: client.service.get_json("x"))
    assert type(error) is kind and len(server.requests) == requests
    assert client.waits == [1, 2][: requests - 1]
    if status != 301:
        assert f"no, *** really (HTTP {status})" in str(error) and str(error).startswith("vendor: ")
    if kind is AccessDenied:
        assert "set VENDOR_KEY" in str(error)


PAID = [
    (429, RateLimited, 3),
    (503, Unavailable, 3),
    (500, Unavailable, 1),
    (502, Unavailable, 1),
    (504, AnswerLost, 1),
]


@pytest.mark.parametrize(("status", "kind", "requests"), PAID)
def test_paid_submit_is_repeated_only_where_it_was_not_taken(status: int, kind: type, requests: int) -> None:
    with FakeServer(Script(Response(status, {"message": "no"}))) as server:
        error = error_of(lambda: Client(server.url).service.post_json("x", {}, pays=True))
    assert type(error) is kind and len(server.requests) == requests


def test_request_succeeds_after_faults() -> None:
    with FakeServer(Script(Response(500, b"oops"), Response(429, b"", {"Retry-After": "7"}), OK)) as server:
        client = Client(server.url)
        assert client.service.post_json("x", {"a": 1}, pays=False) == {"fine": True}
    assert client.waits == [1, 7] and server.requests[2].json() == {"a": 1}


def test_rate_limit_says_when_to_come_back() -> None:
    with FakeServer(Script(Response(429, {"message": "slow"}, {"Retry-After": "120"}))) as server:
        client = Client(server.url, longest_wait_s=30)
        error = error_of(lambda: client.service.get_json("x"))
    assert isinstance(error, RateLimited) and error.retry_after_s == 120
    assert len(server.requests) == 1 and client.waits == []  # longer than anybody waits here
    date = format_datetime(datetime.now(UTC) + timedelta(seconds=20), usegmt=True)
    with FakeServer(Script(Response(429, b"", {"Retry-After": date}), OK)) as server:
        client = Client(server.url)
        client.service.get_json("x")
    assert client.waits == [pytest.approx(20, abs=2)]


@pytest.mark.parametrize("pays", [False, True])
def test_connection_refused_is_tried_again_even_for_a_paid_submit(pays: bool) -> None:
    with socket.socket() as unused:
        unused.bind(("127.0.0.1", 0))
        url = f"http://127.0.0.1:{unused.getsockname()[1]}"
        client = Client(url)
        error = error_of(lambda: client.service.post_json("x", {}, pays=pays))
    assert type(error) is Unavailable and client.waits == [1, 2] and url in str(error)


@pytest.mark.parametrize(("pays", "kind", "requests"), [(False, Unavailable, 3), (True, AnswerLost, 1)])
def test_silence_after_the_request_was_sent(pays: bool, kind: type, requests: int) -> None:
    def silent(request: Request) -> Response:
        time.sleep(1.5)
        return OK

    with FakeServer(Script(silent)) as server:
        error = error_of(lambda: Client(server.url, timeout_s=0.7).service.post_json("x", {}, pays=pays))
    assert type(error) is kind and len(server.requests) == requests


@pytest.mark.parametrize(("pays", "kind", "requests"), [(False, Unavailable, 3), (True, AnswerLost, 1)])
def test_answer_that_is_cut(pays: bool, kind: type, requests: int) -> None:
    with FakeServer(Script(Response(200, {"fine": True}, cut_after=4))) as server:
        error = error_of(lambda: Client(server.url).service.post_json("x", {}, pays=pays))
    assert type(error) is kind and len(server.requests) == requests


@pytest.mark.parametrize(("pays", "kind"), [(False, BadReply), (True, AnswerLost)])
@pytest.mark.parametrize("body", [b"<html>", b"[1]", b"null", b"\xff\xfe", b"[" * 100_000])
def test_answer_that_is_no_object(body: bytes, pays: bool, kind: type) -> None:
    with FakeServer(Script(Response(200, body))) as server:
        error = error_of(lambda: Client(server.url).service.post_json("x", {}, pays=pays))
    assert type(error) is kind and len(server.requests) == 1


def test_answer_that_is_too_large() -> None:
    with FakeServer(Script(Response(200, b"x" * 5000))) as server:
        service = Client(server.url).service
        assert "1000 bytes" in str(error_of(lambda: service.get_json("x", max_bytes=1000)))
        assert len(service.ask("GET", "x", max_bytes=5000)) == 5000


def test_vendors_own_error_codes() -> None:
    def refusal(status: int, body: Any) -> Refusal | None:
        return Refusal(body["why"], body["kind"]) if "kind" in body else None

    kinds = {"denied": AccessDenied, "busy": RateLimited, "down": Unavailable, "gone": NotFound, "bad": BadReply}
    for name, kind in {**kinds, "input": Rejected}.items():
        with FakeServer(Script(Response(200, {"kind": name, "why": "words"}))) as server:
            error = error_of(lambda url=server.url: Client(url, refusal=refusal).service.get_json("x"))  # type: ignore[misc]
        assert type(error) is kind and "words" in str(error)


def test_form_arrives_byte_for_byte() -> None:
    content = bytes(range(256)) + b"\r\n--\r\n\n" * 3
    with FakeServer(Script(OK)) as server:
        service = Client(server.url).service
        service.post_form("x", {"tier": "Regular"}, [FormFile("images", "image.png", content, "image/png")])
        service.post_form("x", {"prompt": "a mug, blue: ü"})
    first, second = (request.form() for request in server.requests)
    assert [(name, filename) for name, filename, _ in first] == [("tier", None), ("images", "image.png")]
    assert first[1][2].startswith(bytes(range(256))) and len(first[1][2]) >= len(content) - 2
    assert second == [("prompt", None, "a mug, blue: ü".encode())]


def test_key_stays_with_its_host() -> None:
    with FakeServer(Script(OK)) as other, FakeServer(Script(Response(307, b"", {"Location": other.url}), OK)) as server:
        service = Client(server.url).service
        assert "redirects" in str(error_of(lambda: service.post_json("x", {})))
        assert "not its own host" in str(error_of(lambda: service.get_json(f"{other.url}/x")))
        assert service.get_json(f"{server.url}/status/1") == {"fine": True}
    assert not other.requests
    assert {request.headers["authorization"] for request in server.requests} == {f"Bearer {KEY}"}
    assert KEY not in repr(service) + str(service)


@pytest.mark.parametrize("key", ["two words", "line\nbreak", "schlüssel"])
def test_key_that_cannot_be_one_is_refused_without_showing_it(key: str) -> None:
    with pytest.raises(ConfigError) as caught:
        HttpService("v", "http://localhost", authorization={}, services=ServicesConfig(), key=key)
    assert key not in str(caught.value)
    with pytest.raises(ConfigError, match="ftp://x"):
        HttpService("v", "ftp://x", authorization={}, services=ServicesConfig(), key=None)
