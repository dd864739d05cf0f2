"""Requests to an ASGI application, header by header: what a browser would not send, an attacker's program does."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from typing import Any

from starlette.types import ASGIApp

Header = tuple[str, str]


def asked(
    app: ASGIApp,
    path: str = "/",
    headers: Sequence[Header] = (),
    *,
    method: str = "GET",
    kind: str = "http",
    body: bytes = b"",
) -> list[dict[str, Any]]:
    """Return the messages that the application sends for one request."""
    place, _, query = path.partition("?")
    scope: dict[str, Any] = {
        "type": kind,
        "method": method,
        "path": place,
        "raw_path": place.encode(),
        "query_string": query.encode(),
        "headers": [(name.encode(), value.encode()) for name, value in headers],
        "http_version": "1.1",
        "scheme": "http",
    }
    sent: list[dict[str, Any]] = []
    incoming = [{"type": "websocket.connect"} if kind == "websocket" else {"type": "http.request", "body": body}]

    async def receive() -> dict[str, Any]:
        if not incoming:
            await asyncio.Event().wait()  # who asked waits for the answer
        return incoming.pop(0)

    async def send(message: Any) -> None:
        sent.append(dict(message))

    asyncio.run(app(scope, receive, send))
    return sent


def header(messages: Sequence[dict[str, Any]], name: str) -> str:
    """Return a header of an answer, '' where it has none."""
    return dict(messages[0].get("headers", [])).get(name.encode(), b"").decode()
