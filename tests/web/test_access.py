"""The guard before the pages, request by request."""

from __future__ import annotations

import logging
from typing import Any

import pytest
from access_requests import Header, asked, header
from starlette.types import Receive, Scope, Send

from manitwin.web.access import HEADERS, PERSON, Guard, ServerNames
from manitwin.web.tokens import MOST_LINKS, Tokens

PORT = 8765
HOST = ("host", f"127.0.0.1:{PORT}")
OWN = ("origin", f"http://127.0.0.1:{PORT}")


class Pages:
    """What lies behind the guard: it notes who came through."""

    def __init__(self) -> None:
        self.people: list[str] = []

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        self.people.append(scope[PERSON])
        if scope["type"] == "websocket":
            await send({"type": "websocket.accept"})
            return
        await send({"type": "http.response.start", "status": 200, "headers": [(b"X-Frame-Options", b"ALLOWALL")]})
        await send({"type": "http.response.body", "body": b"seen"})


class Server:
    """A guard with one person inside."""

    def __init__(self, host: str = "127.0.0.1") -> None:
        self.pages, self.tokens, self.used = Pages(), Tokens(), 0
        self.guard = Guard(self.pages, ServerNames.of(host, PORT), self.tokens, self._used)
        entered = asked(self.guard, f"/enter?token={self.tokens.link('anna')}", [HOST])
        self.cookie = ("cookie", "other=1; " + header(entered, "set-cookie").split(";")[0])

    def _used(self) -> None:
        self.used += 1

    def status(self, *headers: Header, **how: Any) -> int:
        (first, *_) = asked(self.guard, headers=headers, **how)
        return int(first.get("status", 200 if first["type"] == "websocket.accept" else 403))


@pytest.fixture(scope="module")
def server() -> Server:
    return Server()


def test_who_has_the_cookie_gets_the_pages_with_the_headers_that_keep_them_safe(server: Server) -> None:
    answer = asked(server.guard, headers=[HOST, server.cookie])
    assert answer[0]["status"] == 200 and server.pages.people[-1] == "anna"
    assert {name: header(answer, name) for name in HEADERS} == HEADERS
    assert not any("unsafe" in value or "*" in value or "http:" in value for value in HEADERS.values())


@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ([HOST], 403),  # no cookie
        ([HOST, ("cookie", "manitwin_8765=guess")], 403),
        ([HOST, ("cookie", "manitwin_8765=\xff\xfe")], 403),
        (["COOKIE"], 403),  # no host
        (["COOKIE", ("host", f"evil.example:{PORT}")], 403),
        (["COOKIE", ("host", "127.0.0.1")], 403),  # another port
        (["COOKIE", ("host", f"127.0.0.1:{PORT}@evil.example")], 403),
        (["COOKIE", ("host", f"user@127.0.0.1:{PORT}")], 403),
        (["COOKIE", ("host", f"192.168.0.1:{PORT}")], 403),
        (["COOKIE", ("host", "127.0.0.1:port")], 403),
        (["COOKIE", HOST, HOST], 403),
        (["COOKIE", ("host", f"LOCALHOST:{PORT}")], 200),
        (["COOKIE", ("host", f"[::1]:{PORT}")], 200),
        (["COOKIE", HOST, OWN], 200),
        (["COOKIE", HOST, ("origin", "null")], 403),
        (["COOKIE", HOST, ("origin", "http://evil.example")], 403),
        (["COOKIE", HOST, ("origin", f"https://127.0.0.1:{PORT}")], 403),
        (["COOKIE", HOST, ("origin", f"http://localhost:{PORT}")], 403),  # not the name it is called by
        (["COOKIE", HOST, OWN, ("origin", "http://evil.example")], 403),
        (["COOKIE", HOST, ("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "no-cors")], 403),
        (["COOKIE", HOST, ("sec-fetch-site", "same-site"), ("sec-fetch-mode", "cors")], 403),
        (["COOKIE", HOST, ("sec-fetch-site", "cross-site"), ("sec-fetch-mode", "navigate")], 200),  # a link in a mail
        (["COOKIE", HOST, ("sec-fetch-site", "same-origin"), ("sec-fetch-mode", "cors")], 200),
    ],
)
def test_reading_wants_a_known_host_no_foreign_origin_and_the_cookie(
    server: Server, headers: list[Any], status: int
) -> None:
    assert server.status(*(server.cookie if each == "COOKIE" else each for each in headers)) == status


@pytest.mark.parametrize(("kind", "method"), [("websocket", "GET"), ("http", "POST"), ("http", "DELETE")])
def test_a_websocket_and_what_changes_something_want_an_origin(server: Server, kind: str, method: str) -> None:
    assert server.status(HOST, server.cookie, kind=kind, method=method) == 403
    assert server.status(HOST, server.cookie, ("origin", "http://evil.example"), kind=kind, method=method) == 403
    assert server.status(HOST, OWN, kind=kind, method=method) == 403
    assert server.status(HOST, server.cookie, OWN, kind=kind, method=method) == 200


def test_a_link_is_of_one_use_and_sets_a_cookie_that_no_script_reads(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.DEBUG)
    server = Server()
    token = server.tokens.link("bob")
    assert asked(server.guard, f"/enter?token={token}", [HOST], method="HEAD")[0]["status"] == 403
    assert asked(server.guard, f"/enter?token={token}", [("host", "evil.example")])[0]["status"] == 403
    first = asked(server.guard, f"/enter?token={token}&next=/twin/0a?x=1", [HOST])
    assert first[0]["status"] == 303 and header(first, "location") == "/twin/0a?x=1"
    attributes = header(first, "set-cookie").split("; ")[1:]
    assert attributes == ["Path=/", "HttpOnly", "SameSite=Lax"]
    secret = header(first, "set-cookie").split("=", 1)[1].split(";")[0]
    assert token not in secret and server.tokens.person(secret) == "bob"
    assert asked(server.guard, f"/enter?token={token}", [HOST])[0]["status"] == 403 and server.used == 2
    assert token not in caplog.text and secret not in caplog.text


@pytest.mark.parametrize(
    "onward", ["//evil.example", "/\\evil.example", "http://evil.example", "/%0d%0aset-cookie:a=b", "/\u00e9"]
)
def test_a_link_leads_nowhere_else(onward: str) -> None:
    server = Server()
    answer = asked(server.guard, f"/enter?token={server.tokens.link()}&next={onward}", [HOST])
    assert header(answer, "location") == "/"


def test_links_that_nobody_uses_do_not_pile_up() -> None:
    tokens = Tokens()
    links = [tokens.link() for _ in range(MOST_LINKS + 1)]
    assert tokens.redeem(links[0]) is None and tokens.redeem(links[1]) is not None


def test_beyond_this_machine_it_answers_to_addresses_and_to_no_other_name() -> None:
    server = Server("0.0.0.0")
    assert server.status(server.cookie, ("host", f"192.168.0.7:{PORT}")) == 200
    assert server.status(server.cookie, ("host", f"evil.example:{PORT}")) == 403
    named = ServerNames.of("Workstation", PORT)
    assert named.is_known_host(f"workstation:{PORT}") and not named.is_known_host(f"evil.example:{PORT}")
