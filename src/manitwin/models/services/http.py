"""A vendor's JSON API over HTTP: the key goes to its host only, a job is never paid for twice by a retry."""

from __future__ import annotations

import json
import ssl
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from typing import Any
from urllib.parse import urljoin, urlsplit

import httpx2

from manitwin.config import ServicesConfig
from manitwin.engine.charges import REHEARSAL_MARK, note_rehearsal
from manitwin.errors import BadReply, ConfigError, ManiTwinError, RateLimited
from manitwin.models.services.download import MAX_FILE_BYTES, download_file
from manitwin.models.services.keys import is_local, redacted
from manitwin.models.services.refusal import (
    FailedRequest,
    Gone,
    Refusal,
    Unanswered,
    error_for,
    refusal_by_status,
    retry_after_s,
    until_answered,
)

MAX_ANSWER_BYTES = 64 << 20
MAX_CONNECT_S = 30.0

# the connection was never made: nothing of the request has left this machine
_NOT_SENT = (httpx2.ConnectError, httpx2.ConnectTimeout, httpx2.PoolTimeout, httpx2.UnsupportedProtocol)
# what says that a request may be made again, whatever it was: the server has not taken it
_NOT_TAKEN = (429, 503)
# a gateway waited in vain for what stands behind it; 500 and 502 say that the work was not done
_ANSWER_LOST = (504,)


@dataclass(frozen=True)
class FormFile:
    """A file in a multipart form."""

    field: str
    filename: str
    content: bytes
    mime: str


class HttpService:
    """A vendor's API below ``base_url``.

    ``authorization`` are the headers that hold the key; they go to this host and no other, and show nowhere. ``refusal`` reads
    the vendor's error bodies; ``remedy`` is what a person does about a refused key. Errors: AccessDenied, RateLimited,
    Unavailable, Gone (a BadReply: 404 and 410) and BadReply. A request is retried ``services.retries`` times after 429 and
    5xx and where no answer came; one that ``pays`` only where it surely was not taken (no connection, 429, 503). Where it
    may have been taken (no answer, 504, an answer that cannot be read) that raises Unanswered (an Unavailable).
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
        if key is not None and not (key.isascii() and key.isprintable() and " " not in key):
            raise ConfigError(f"{name}: the key holds spaces or characters that no key has; copy it again")
        if urlsplit(base_url).scheme not in ("http", "https"):
            raise ConfigError(f"{name}: {base_url!r} is no address of a web service; give http:// or https://")
        self.name, self.base_url = name, base_url.rstrip("/")
        self._authorization, self._key = dict(authorization), key
        self._services, self._remedy, self._refusal, self._sleep = services, remedy, refusal, sleep

    def __repr__(self) -> str:
        return f"HttpService({self.name!r}, {self.base_url!r})"

    def get_json(self, path: str, *, max_bytes: int = MAX_ANSWER_BYTES) -> dict[str, Any]:
        """Return the JSON object at ``path`` (below the base URL, or a whole address on the same host)."""
        return self._object(self.ask("GET", path, max_bytes=max_bytes))

    def post_json(
        self, path: str, body: Mapping[str, Any], *, pays: bool = False, max_bytes: int = MAX_ANSWER_BYTES
    ) -> dict[str, Any]:
        """Post JSON and return the JSON object that comes back."""
        return self._object(self.ask("POST", path, body=body, pays=pays, max_bytes=max_bytes), pays)

    def post_form(
        self, path: str, fields: Mapping[str, str], files: Sequence[FormFile] = (), *, pays: bool = False
    ) -> dict[str, Any]:
        """Post a ``multipart/form-data`` form and return the JSON object that comes back."""
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
        max_bytes: int = MAX_ANSWER_BYTES,
    ) -> bytes:
        """Send a request and return the bytes of its answer, retried as the class says."""
        content: dict[str, Any] = {}
        if body is not None:
            content["json"] = dict(body)
        if fields is not None:
            # a part without a file name is a plain field; this keeps a form without files multipart
            parts: list[tuple[str, Any]] = [(name, (None, value)) for name, value in fields.items()]
            content["files"] = parts + [(f.field, (f.filename, f.content, f.mime)) for f in files]
        url = self._address(path)
        attempt = partial(self._once, method, url, content, pays, max_bytes)
        return until_answered(attempt, self._services, self._sleep)

    def download(
        self,
        url: str,
        to: Path,
        max_bytes: int = MAX_FILE_BYTES,
        *,
        fresh_url: Callable[[], str] | None = None,
    ) -> None:
        """Write a finished file to ``to``, asked for without any key; a partial file is removed.

        A link that is no longer valid (401, 403, 404, 410) is replaced once by ``fresh_url()``. Raises BadReply for a file
        that is empty, cut short or larger than ``max_bytes``, and for an address that is not https (or http, of a server
        that is reached by http itself); Unavailable where its server does not answer.
        """
        for again in (True, False):
            try:
                until_answered(partial(self._file, url, to, max_bytes), self._services, self._sleep)
            except Gone as error:
                if not again or fresh_url is None:
                    raise BadReply(f"{error}; run it again") from None
                url = fresh_url()
            else:
                return

    def said(self, text: str) -> str:
        """Return what the service said, as one line without the key."""
        return redacted(text, self._key)

    def unreadable(self, what: str, pays: bool = False) -> ManiTwinError:
        """Return the error for an answer that lacks ``what``; of one that ``pays`` the job may have been taken."""
        if pays:
            return Unanswered(
                f"{self.name}: its answer to a submit has no {what}; whether it took the job is not known"
            )
        return BadReply(f"{self.name}: its answer has no {what}; run it again")

    def _address(self, path: str) -> str:
        url = path if "://" in path else f"{self.base_url}/{path.lstrip('/')}"
        if _origin(url) != _origin(self.base_url):
            raise BadReply(
                f"{self.name}: it names {self.said(urlsplit(url).netloc)!r} to ask next, which is not its own host; the key"
                " goes to no other"
            )
        return url

    def _once(
        self, method: str, url: str, content: dict[str, Any], pays: bool, max_bytes: int
    ) -> bytes | FailedRequest:
        headers = {**self._authorization, "Accept": "application/json, */*"}
        try:
            with self._stream(method, url, headers, content) as response:
                status, after = response.status_code, retry_after_s(response.headers.get("Retry-After"))
                data = _bounded(response.iter_bytes(), max_bytes)
        except _NOT_SENT as error:
            return FailedRequest(self._silent(error, False), again=True)
        except httpx2.RequestError as error:  # timeouts, connections cut, broken HTTP
            return FailedRequest(self._silent(error, pays), again=not pays)
        if data is None:
            return FailedRequest(self.unreadable(f"end within {max_bytes} bytes", pays), again=False)
        return self._judged(status, data, after, pays)

    def _judged(self, status: int, data: bytes, after: float | None, pays: bool) -> bytes | FailedRequest:
        if 300 <= status < 400:
            error: ManiTwinError = BadReply(f"{self.name}: {self.base_url} redirects; give the new address after @")
            return FailedRequest(error, again=False)
        refusal = self._refusal(status, _parsed(data))
        if refusal is None:
            return data
        error = error_for(self.name, Refusal(self.said(refusal.message), refusal.kind), status, self._remedy, after)
        if pays and status in _ANSWER_LOST:
            return FailedRequest(Unanswered(f"{error}; whether it took the job is not known"), again=False)
        retryable = refusal.kind == "busy" or (refusal.kind == "down" and (not pays or status in _NOT_TAKEN))
        return FailedRequest(error, again=retryable, wait_s=after if isinstance(error, RateLimited) else None)

    def _file(self, url: str, to: Path, max_bytes: int) -> bytes | FailedRequest:
        schemes = {"https", urlsplit(self.base_url).scheme}
        with self._client() as client:
            error, again = download_file(client, url, to, name=self.name, max_bytes=max_bytes, schemes=schemes)
        return b"" if error is None else FailedRequest(error, again)

    @contextmanager
    def _stream(
        self, method: str, url: str, headers: Mapping[str, str], content: dict[str, Any]
    ) -> Iterator[httpx2.Response]:
        with self._client() as client, client.stream(method, url, headers=headers, **content) as response:
            yield response

    def _client(self) -> httpx2.Client:
        # one connection a request: one kept open may be closed by the server just as a job is submitted, and then
        # nobody knows whether it was taken
        return http_client(self.base_url, self._services)

    def _silent(self, error: httpx2.RequestError, pays: bool) -> ManiTwinError:
        cause = self.said(str(error)) or type(error).__name__
        if pays:
            return Unanswered(f"{self.name}: no answer to a submit ({cause}); whether it took the job is not known")
        return error_for(self.name, Refusal(f"{self.base_url} does not answer ({cause})", "down"), None, "", None)

    def _object(self, data: bytes, pays: bool = False) -> dict[str, Any]:
        value = _parsed(data)
        if not isinstance(value, dict):
            raise self.unreadable(f"JSON object but {self.said(data.decode(errors='replace'))[:60]!r}", pays)
        return value


def http_client(
    base_url: str, services: ServicesConfig, on_request: Callable[[httpx2.Request], None] | None = None
) -> httpx2.Client:
    """Return a client that follows no redirect, leaves proxies out on this machine, and notes rehearsals."""
    return httpx2.Client(
        timeout=httpx2.Timeout(services.timeout_s, connect=min(services.timeout_s, MAX_CONNECT_S)),
        verify=_tls(),
        follow_redirects=False,
        trust_env=not is_local(base_url),
        event_hooks={"request": [on_request] if on_request else [], "response": [_note_rehearsal]},
    )


def _note_rehearsal(response: httpx2.Response) -> None:
    """Note an answer of a rehearsal server (``manitwin fake``) by its header."""
    if REHEARSAL_MARK in response.headers:
        note_rehearsal()


@cache
def _tls() -> ssl.SSLContext:
    """Return the certificates that are trusted; reading them takes 34 ms, more than a request on this machine."""
    return httpx2.create_ssl_context()


def _parsed(data: bytes) -> Any:
    try:
        return json.loads(data)
    except (ValueError, RecursionError):
        return None


def _bounded(chunks: Iterator[bytes], max_bytes: int) -> bytes | None:
    data = bytearray()
    for chunk in chunks:
        data += chunk
        if len(data) > max_bytes:
            return None
    return bytes(data)


def _origin(url: str) -> tuple[str, str | None, int | None]:
    parts = urlsplit(urljoin(url, "/"))
    return parts.scheme, parts.hostname, parts.port or {"http": 80, "https": 443}.get(parts.scheme)
