"""Local HTTP server in a thread for a fake service; a response header marks every answer as a rehearsal."""

from __future__ import annotations

import json
import socket
import sys
import threading
from contextlib import suppress
from dataclasses import dataclass, field
from email.parser import BytesParser
from email.policy import HTTP
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any, Protocol
from urllib.parse import parse_qsl, urlsplit

from manitwin.engine.charges import REHEARSAL_MARK

MAX_BODY_BYTES = 256 << 20
LONGEST_WAIT_S = 0.05
"""Interval in seconds at which the server checks whether to stop."""


@dataclass(frozen=True)
class Request:
    """A received request; header names are in lower case."""

    method: str
    path: str
    query: dict[str, str]
    headers: dict[str, str]
    body: bytes

    def json(self) -> Any:
        """Return the body as JSON; raises ValueError."""
        return json.loads(self.body)

    def form(self) -> list[tuple[str, str | None, bytes]]:
        """Return the parts of a multipart body as (name, file name, content); raises ValueError."""
        kind = self.headers.get("content-type", "")
        if not kind.startswith("multipart/form-data"):
            raise ValueError(f"the content type is {kind!r}, not multipart/form-data")
        message = BytesParser(policy=HTTP).parsebytes(b"Content-Type: " + kind.encode() + b"\r\n\r\n" + self.body)
        parts = []
        for part in message.iter_parts():
            content = part.get_payload(decode=True)
            name = str(part.get_param("name", header="content-disposition"))
            parts.append((name, part.get_filename(), content if isinstance(content, bytes) else b""))
        return parts


@dataclass(frozen=True)
class Response:
    """An answer; a dictionary or list is sent as JSON. ``cut_after`` closes the connection after that many bytes of the body."""

    status: int = 200
    body: bytes | dict[str, Any] | list[Any] = b""
    headers: dict[str, str] = field(default_factory=dict)
    cut_after: int | None = None

    def content(self) -> tuple[bytes, dict[str, str]]:
        """Return the bytes and headers to send."""
        if isinstance(self.body, bytes):
            return self.body, {"Content-Type": "application/octet-stream", **self.headers}
        return json.dumps(self.body).encode(), {"Content-Type": "application/json", **self.headers}


class FakeService(Protocol):
    """A service behind a fake server."""

    def answer(self, request: Request, base_url: str) -> Response:
        """Answer a request; ``base_url`` is the address of this server."""
        ...


class FakeServer:
    """Serve a service on this machine within the context; ``requests`` records the requests in order."""

    def __init__(self, service: FakeService, port: int = 0):
        self.service, self.requests = service, list[Request]()
        self._server = _Server(("127.0.0.1", port), _Handler)
        self._server.fake = self
        self.url = f"http://127.0.0.1:{self._server.server_address[1]}"

    def __enter__(self) -> FakeServer:
        threading.Thread(target=self._server.serve_forever, args=(LONGEST_WAIT_S,), daemon=True).start()
        return self

    def __exit__(self, *exc: object) -> None:
        with suppress(OSError):  # shutting the socket down ends the wait for the next request at once
            self._server.socket.shutdown(socket.SHUT_RDWR)
        self._server.shutdown()
        self._server.server_close()


class _Server(ThreadingHTTPServer):
    daemon_threads = True
    fake: FakeServer

    def handle_error(self, request: Any, client_address: Any) -> None:
        """Ignore errors of clients that disconnected early."""
        if not isinstance(sys.exception(), ConnectionError):
            super().handle_error(request, client_address)


class _Handler(BaseHTTPRequestHandler):
    server: _Server
    protocol_version = "HTTP/1.1"

    def _do(self) -> None:
        length = int(self.headers.get("Content-Length") or 0)
        if length > MAX_BODY_BYTES:
            self.send_error(413)
            return
        address = urlsplit(self.path)
        request = Request(
            self.command,
            address.path,
            dict(parse_qsl(address.query, keep_blank_values=True)),
            {name.lower(): value for name, value in self.headers.items()},
            self.rfile.read(length),
        )
        fake = self.server.fake
        fake.requests.append(request)
        response = fake.service.answer(request, fake.url)
        content, headers = response.content()
        self.send_response(response.status)
        for name, value in headers.items():
            self.send_header(name, value)
        self.send_header(REHEARSAL_MARK, "1")
        self.send_header("Content-Length", str(len(content)))
        self.end_headers()
        if response.cut_after is not None:
            self.wfile.write(content[: response.cut_after])
            self.close_connection = True
            return
        self.wfile.write(content)

    do_GET = do_POST = do_PUT = do_DELETE = do_HEAD = _do

    def log_message(self, format: str, *args: object) -> None:
        """Print nothing; requests are recorded in ``requests``."""
