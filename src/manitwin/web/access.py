"""Access control of the page server: host and origin checks, one-time links, and session cookies.

A server on 127.0.0.1 can be reached by every page that is open in the same browser. Each request, HTTP and WebSocket alike, must
pass three checks before it reaches the application:

1. ``Host`` is a name of this server, which prevents DNS rebinding.

2. ``Origin``, if present, is the server's own; WebSockets and state-changing requests must have one.

3. The cookie holds a secret that was issued for a one-time link.

Nothing here is logged.
"""

from __future__ import annotations

import ipaddress
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs, urlsplit

from starlette.types import ASGIApp, Message, Receive, Scope, Send

from manitwin.web.tokens import Tokens

ENTER = "/enter"
"""Path of a one-time link: ``/enter?token=...&next=/...``."""
PERSON = "manitwin.person"
"""Key of the ASGI scope with the authenticated person."""
LOOPBACK_NAMES = ("127.0.0.1", "localhost", "[::1]")
_READING = frozenset({"GET", "HEAD"})

CONTENT_SECURITY_POLICY = "; ".join(
    (
        "default-src 'none'",
        "script-src 'self'",
        "style-src 'self'",
        "img-src 'self' blob: data:",  # blob: textures of a GLB
        "connect-src 'self' blob:",
        "form-action 'self'",
        "base-uri 'none'",
        "frame-ancestors 'none'",
    )
)
HEADERS = {
    "content-security-policy": CONTENT_SECURITY_POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "same-origin",  # with no-referrer, the Origin of a form's POST would be null
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
}
"""Headers of every answer. Scripts and styles are only loaded from files of this server; inline code in a caption never runs."""


@dataclass(frozen=True)
class ServerNames:
    """Names under which a server may be addressed: those of the local machine, and the requested host.

    ``open`` means that the server listens beyond this machine. It then also answers to any numeric IP address, which DNS
    rebinding cannot forge.
    """

    hosts: frozenset[str]
    port: int
    open: bool = False

    @classmethod
    def of(cls, host: str, port: int) -> ServerNames:
        """Return the names of a server that listens on a host."""
        bare = host.strip("[]")
        try:
            local = ipaddress.ip_address(bare).is_loopback
        except ValueError:
            local = bare == "localhost"
        written = f"[{bare}]" if ":" in bare else bare
        return cls(frozenset({*LOOPBACK_NAMES, written.lower()}), port, open=not local)

    def is_known_host(self, host: str) -> bool:
        """Return whether a ``Host`` header is one of these names with the server's port."""
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return False
        if parts.netloc != host or parts.username is not None or parts.path or port != self.port:
            return False
        written = f"[{name}]" if ":" in name else name
        return written in self.hosts or (self.open and _is_address(name))

    def is_own_origin(self, origin: str, host: str) -> bool:
        """Return whether an ``Origin`` is that of this server's pages under the requested host name."""
        return origin.lower() == f"http://{host.lower()}"


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True


class Guard:
    """ASGI middleware that refuses requests as described in this module and adds ``HEADERS`` to every answer."""

    def __init__(self, app: ASGIApp, names: ServerNames, tokens: Tokens, used_link: Callable[[], None] | None = None):
        self.app, self.names, self.tokens = app, names, tokens
        self.cookie = f"manitwin_{names.port}"  # cookies ignore ports: servers must not share one
        self._used_link = used_link

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Refuse a request, answer it, or pass it on."""
        if scope["type"] == "lifespan":
            await self.app(scope, receive, send)
            return
        if scope["type"] not in ("http", "websocket"):
            return
        headers = _Headers(scope)
        refused = self._refusal(scope, headers)
        if refused is None and scope["type"] == "http" and scope["path"] == ENTER:
            await self._redeem_link(scope, send)
            return
        person = None if refused else self.tokens.person(_cookie(headers.all("cookie"), self.cookie))
        if refused is None and person is None:
            refused = "open the link that the command printed; it is for this browser alone"
        if refused is not None:
            await _refuse(scope, receive, send, refused)
            return
        scope[PERSON] = person
        await self.app(scope, receive, _with_headers(send) if scope["type"] == "http" else send)

    def _refusal(self, scope: Scope, headers: _Headers) -> str | None:
        hosts, origins = headers.all("host"), headers.all("origin")
        if len(hosts) != 1 or not self.names.is_known_host(hosts[0]):
            return "this server is not called so"
        reads = scope["type"] == "http" and scope["method"] in _READING
        if len(origins) > 1 or (not origins and not reads):
            return "asked by no page of this server"
        if origins and not self.names.is_own_origin(origins[0], hosts[0]):
            return "asked by a page of another site"
        foreign = headers.one("sec-fetch-site") in ("cross-site", "same-site")
        if foreign and headers.one("sec-fetch-mode") != "navigate":
            return "asked by a page of another site"
        return None

    async def _redeem_link(self, scope: Scope, send: Send) -> None:
        asked = parse_qs(scope["query_string"].decode("latin-1"))
        token, onward = asked.get("token", [""])[0], asked.get("next", ["/"])[0]
        secret = self.tokens.redeem(token) if scope["method"] == "GET" else None  # a preview (HEAD) keeps the link
        if secret is None:
            if self._used_link is not None:
                self._used_link()
            await _answer(send, 403, "This link was used, or is not of this server; the command has printed a new one.")
            return
        inside = onward.startswith("/") and not onward.startswith(("//", "/\\")) and onward.isprintable()
        lasting = "" if self.tokens.lasting_s is None else f"; Max-Age={self.tokens.lasting_s:.0f}"
        cookie = f"{self.cookie}={secret}; Path=/; HttpOnly; SameSite=Lax{lasting}"
        more = [("set-cookie", cookie), ("location", onward if inside and onward.isascii() else "/")]
        await _answer(send, 303, "", more)


class _Headers:
    def __init__(self, scope: Scope):
        self._all = [(name.decode("latin-1").lower(), value.decode("latin-1")) for name, value in scope["headers"]]

    def all(self, name: str) -> list[str]:
        return [value for each, value in self._all if each == name]

    def one(self, name: str) -> str:
        return (self.all(name) or [""])[0]


def _cookie(headers: list[str], name: str) -> str:
    for header in headers:
        try:
            found = SimpleCookie(header).get(name)
        except CookieError:
            continue
        if found is not None:
            return found.value
    return ""


def _with_headers(send: Send) -> Send:
    async def guarded(message: Message) -> None:
        if message["type"] == "http.response.start":
            own = [(name.encode(), value.encode()) for name, value in HEADERS.items()]
            others = [pair for pair in message.get("headers", []) if pair[0].decode("latin-1").lower() not in HEADERS]
            message = {**message, "headers": [*others, *own]}
        await send(message)

    return guarded


async def _refuse(scope: Scope, receive: Receive, send: Send, reason: str) -> None:
    if scope["type"] == "websocket":
        await receive()
        await send({"type": "websocket.close", "code": 1008, "reason": reason})
        return
    await _answer(send, 403, f"Refused: {reason}.")


async def _answer(send: Send, status: int, text: str, headers: Iterable[tuple[str, str]] = ()) -> None:
    body = f"{text}\n".encode()
    told = {"content-type": "text/plain; charset=utf-8", "content-length": str(len(body)), "cache-control": "no-store"}
    pairs = [*told.items(), *headers]
    written = [(name.encode(), value.encode("latin-1")) for name, value in pairs]
    await _with_headers(send)({"type": "http.response.start", "status": status, "headers": written})
    await send({"type": "http.response.body", "body": body})
