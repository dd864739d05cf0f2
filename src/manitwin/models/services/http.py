"""Client of a vendor's JSON API: the key is sent to its host only, and retries never pay for a job twice."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2

from manitwin.config import ServicesConfig
from manitwin.engine.charges import REHEARSAL_MARK, note_rehearsal
from manitwin.errors import BadReply, ConfigError, ManiTwinError, RateLimited, Unavailable
from manitwin.models.services.addresses import AllowedServers, ForbiddenAddress
from manitwin.models.services.bodies import NotJson, TooLarge, parsed, whole_body
from manitwin.models.services.connections import MAX_CONNECT_S, Deadline, GuardedTransport
from manitwin.models.services.download import MAX_FILE_BYTES, download_file
from manitwin.models.services.keys import check_key, is_local, redacted, without_key
from manitwin.models.services.refusal import (
    AnswerLost,
    FailedRequest,
    NotFound,
    Refusal,
    RequestRejected,
    error_for,
    refusal_by_status,
    retry_after_s,
    retry_request,
)

MAX_ANSWER_BYTES = 16 << 20
_SHOWN_BYTES = 4_000
_WORDS = 10_000

# no connection was made, so nothing was sent
_NOT_SENT = (
    httpx2.ConnectError,
    httpx2.ConnectTimeout,
    httpx2.ProxyError,
    httpx2.PoolTimeout,
    httpx2.UnsupportedProtocol,
)
# statuses that say that the server did not accept the request, so any request may be repeated
_NOT_TAKEN = (429, 503)
# a gateway timed out waiting for the server behind it; with 500 and 502 the work was not done
_ANSWER_LOST = (504,)


@dataclass(frozen=True)
class FormFile:
    """A file in a multipart form."""

    field: str
    filename: str
    content: bytes
    mime: str


class HttpService:
    """Client of a vendor's API below ``base_url``.

    ``authorization`` are the headers with the key; they are sent to this host only and never displayed. ``refusal`` parses
    the vendor's error bodies; ``remedy`` is the advice for a refused key. Errors are AccessDenied, RateLimited, Unavailable,
    Gone (a BadReply for 404 and 410) and BadReply. A request is retried ``services.retries`` times after 429, 5xx or a
    missing answer. A request that ``pays`` is retried only if it was certainly not accepted (no connection, 429, 503); if it
    may have been accepted (no answer, 504, an unreadable answer), Unanswered (an Unavailable) is raised.

    A request ends within ``services.timeout_s``, from resolving the name to the last byte; an answer has at most
    ``max_bytes`` after decompression. Redirects are not followed. Messages of the server are shown as one short line without
    the key.
    """

    def __init__(
        self,
        name: str,
        base_url: str,
        *,
        authorization: Mapping[str, str],
        services: ServicesConfig,
        key: str | None,
        remedy: str = "set a valid key in the environment",
        refusal: Callable[[int, Any], Refusal | None] = refusal_by_status,
        sleep: Callable[[float], None] = time.sleep,
    ):
        self._own = origin(base_url)
        if self._own is None or self._own[0] not in ("http", "https"):
            raise ConfigError(f"{name}: {base_url!r} is not the address of a web service; give http:// or https://")
        check_key(key, base_url, f"the key of {name}")
        _, host, port = self._own
        self._reach = AllowedServers(host, port, on_this_machine=is_local(base_url))
        self.name, self.base_url = name, base_url.rstrip("/")
        self._authorization, self._key = dict(authorization), key
        self._services, self._remedy, self._refusal, self._sleep = services, remedy, refusal, sleep

    def __repr__(self) -> str:
        return f"HttpService({self.name!r}, {self.base_url!r})"

    def get_json(self, path: str, *, max_bytes: int | None = None) -> dict[str, Any]:
        """Return the JSON object at ``path`` (below the base URL, or a full address on the same host)."""
        return self._object(self.ask("GET", path, max_bytes=max_bytes))

    def get_list(self, path: str) -> list[Any]:
        """Return the JSON list at ``path``; raises BadReply for another value."""
        value = self._value(self.ask("GET", path))
        if not isinstance(value, list):
            raise self.unreadable("list")
        return value

    def post_json(
        self, path: str, body: Mapping[str, Any], *, pays: bool = False, max_bytes: int | None = None
    ) -> dict[str, Any]:
        """Post JSON and return the JSON object of the answer."""
        return self._object(self.ask("POST", path, body=body, pays=pays, max_bytes=max_bytes), pays)

    def post_form(
        self, path: str, fields: Mapping[str, str], files: Sequence[FormFile] = (), *, pays: bool = False
    ) -> dict[str, Any]:
        """Post a ``multipart/form-data`` form and return the JSON object of the answer."""
        return self._object(self.ask("POST", path, fields=fields, files=files, pays=pays), pays)

    def ask(
        self,
        method: str,
        path: str,
        *,
        body: Mapping[str, Any] | None = None,
        fields: Mapping[str, str] | None = None,
        files: Sequence[FormFile] = (),
        pays: bool = False,
        max_bytes: int | None = None,
    ) -> bytes:
        """Send a request and return the body of its answer, with the retries of the class.

        The body has at most ``max_bytes``, by default MAX_ANSWER_BYTES.
        """
        content: dict[str, Any] = {}
        if body is not None:
            content["json"] = dict(body)
        if fields is not None:
            # a part without file name is a plain field; this keeps a form without files multipart
            parts: list[tuple[str, Any]] = [(name, (None, value)) for name, value in fields.items()]
            content["files"] = parts + [(f.field, (f.filename, f.content, f.mime)) for f in files]
        url = self._address(path)
        attempt = partial(
            self._send_once, method, url, content, pays, MAX_ANSWER_BYTES if max_bytes is None else max_bytes
        )
        return retry_request(attempt, self._services, self._sleep)

    def download(
        self,
        url: str,
        to: Path,
        max_bytes: int = MAX_FILE_BYTES,
        *,
        fresh_url: Callable[[], str] | None = None,
    ) -> None:
        """Download a finished file to ``to``, without sending a key; a partial file is removed.

        A link that is no longer valid (401, 403, 404, 410) is replaced once by ``fresh_url()``. Raises BadReply for a file
        that is empty, truncated or larger than ``max_bytes``, and for an address that is not https (http is allowed if
        ``base_url`` is http); Unavailable if the file's server does not answer.
        """
        for again in (True, False):
            try:
                retry_request(partial(self._file, url, to, max_bytes), self._services, self._sleep)
            except NotFound as error:
                if not again or fresh_url is None:
                    raise BadReply(f"{error}; run it again") from None
                url = fresh_url()
            else:
                return

    def said(self, text: str) -> str:
        """Return a message of the service as one line without the key."""
        return redacted(text, self._key)

    def unreadable(self, what: str, pays: bool = False) -> ManiTwinError:
        """Return the error for an answer without ``what``; for a request that ``pays``, the job may have been accepted."""
        if pays:
            return AnswerLost(
                f"{self.name}: its answer to a submit has no {what}; it is unknown whether the service accepted the job"
            )
        return BadReply(f"{self.name}: its answer has no {what}; run it again")

    def _address(self, path: str) -> str:
        url = path if "://" in path else f"{self.base_url}/{path.lstrip('/')}"
        if origin(url) != self._own:
            raise BadReply(
                f"{self.name}: it names {self.said(urlsplit(url).netloc)!r} to ask next, which is not its own host; the key"
                " goes to no other"
            )
        return url

    def _send_once(
        self, method: str, url: str, content: dict[str, Any], pays: bool, max_bytes: int
    ) -> bytes | FailedRequest:
        """Send a request once; return the body or the failure with the decision whether it may be repeated."""
        headers = {**self._authorization, "Accept": "application/json, */*"}
        deadline = Deadline(self._services.timeout_s)
        try:
            with self._client(deadline) as client, client.stream(method, url, headers=headers, **content) as response:
                status, after = response.status_code, retry_after_s(response.headers.get("Retry-After"))
                data = whole_body(response, max_bytes)
        except _NOT_SENT as error:
            return FailedRequest(self._no_answer_error(error, False), again=True)
        except httpx2.RequestError as error:  # timeouts, lost connections, invalid HTTP
            return FailedRequest(self._no_answer_error(error, pays), again=not pays)
        except TooLarge:
            return FailedRequest(self.unreadable(f"end within {max_bytes} bytes", pays), again=False)
        except ForbiddenAddress as error:
            return FailedRequest(Unavailable(f"{self.name}: {error}; nothing was sent"), again=False)
        return self._interpret_response(status, data, after, pays)

    def _interpret_response(self, status: int, data: bytes, after: float | None, pays: bool) -> bytes | FailedRequest:
        """Return the body of an accepted request, or the failure of a refused one."""
        if 300 <= status < 400:
            error: ManiTwinError = BadReply(f"{self.name}: {self.base_url} redirects; give the new address after @")
            return FailedRequest(error, again=False)
        try:
            body = parsed(data, self._key) if status >= 400 or len(data) <= MAX_ANSWER_BYTES else None
        except NotJson:
            body = None
        refusal = self._refusal(status, body)
        if refusal is None:
            return data
        error = error_for(self.name, Refusal(self.said(refusal.message), refusal.kind), status, self._remedy, after)
        if isinstance(error, RequestRejected):
            error.words = without_key(refusal.message[:_WORDS], self._key)
        if pays and status in _ANSWER_LOST:
            return FailedRequest(
                AnswerLost(f"{error}; it is unknown whether the service accepted the job"), again=False
            )
        retryable = refusal.kind == "busy" or (refusal.kind == "down" and (not pays or status in _NOT_TAKEN))
        return FailedRequest(error, again=retryable, wait_s=after if isinstance(error, RateLimited) else None)

    def _file(self, url: str, to: Path, max_bytes: int) -> bytes | FailedRequest:
        schemes = {"https", urlsplit(self.base_url).scheme}
        deadline = Deadline(self._services.timeout_s)
        with self._client(deadline) as client:
            error, again = download_file(
                client, url, to, name=self.name, max_bytes=max_bytes, schemes=schemes, deadline=deadline
            )
        return b"" if error is None else FailedRequest(error, again)

    def _client(self, deadline: Deadline) -> httpx2.Client:
        # One connection per request: the server may close a connection that is kept open just as a job is submitted, and then
        # it is unknown whether the job was accepted.
        timeout_s = self._services.timeout_s
        return httpx2.Client(
            transport=GuardedTransport(self._reach, deadline),
            timeout=httpx2.Timeout(timeout_s, connect=min(timeout_s, MAX_CONNECT_S)),
            # asks for uncompressed bodies, so that Content-Length is the size; compressed ones are still decompressed within
            # limits
            headers={"Accept-Encoding": "identity"},
            follow_redirects=False,
            trust_env=False,
            event_hooks={"response": [_note_rehearsal]},
        )

    def _no_answer_error(self, error: httpx2.RequestError, pays: bool) -> ManiTwinError:
        cause = self.said(str(error)) or type(error).__name__
        if pays:
            return AnswerLost(
                f"{self.name}: no answer to a submit ({cause}); it is unknown whether the service accepted the job"
            )
        return error_for(self.name, Refusal(f"{self.base_url} does not answer ({cause})", "down"), None, "", None)

    def _value(self, data: bytes) -> Any:
        try:
            return parsed(data, self._key)
        except NotJson:
            return None

    def _object(self, data: bytes, pays: bool = False) -> dict[str, Any]:
        value = self._value(data)
        if not isinstance(value, dict):
            shown = self.said(data[:_SHOWN_BYTES].decode(errors="replace"))[:60]
            raise self.unreadable(f"JSON object but {shown!r}", pays)
        return value


def _note_rehearsal(response: httpx2.Response) -> None:
    """Note that an answer comes from a rehearsal server (``manitwin fake``), by its header."""
    if REHEARSAL_MARK in response.headers:
        note_rehearsal()


def origin(url: str) -> tuple[str, str, int] | None:
    """Return scheme, host and port of an address as a request uses them; None if it is not an address of a server.

    None is also returned for addresses in which other parsers would read another host: with a user or password, spaces or
    backslashes.
    """
    try:
        own, other = httpx2.URL(url), urlsplit(url)
        port = other.port or {"http": 80, "https": 443}.get(own.scheme, 0)
        alike = own.port in (other.port, None) and (own.host == (other.hostname or "") or not url.isascii())
    except (httpx2.InvalidURL, ValueError):
        return None
    if not own.host or not alike or own.userinfo or not url.isprintable() or " " in url or "\\" in url:
        return None
    return own.scheme, own.raw_host.decode(), port
