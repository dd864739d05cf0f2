"""Download of a finished file from its link, without sending a key."""

from __future__ import annotations

from collections.abc import Set
from pathlib import Path
from urllib.parse import urljoin, urlsplit

import httpx2

from manitwin.errors import BackendError, BadReply, Unavailable
from manitwin.models.services.addresses import ForbiddenAddress
from manitwin.models.services.bodies import TooLarge, decompressed_chunks
from manitwin.models.services.connections import Deadline
from manitwin.models.services.keys import redacted
from manitwin.models.services.refusal import NotFound

MAX_FILE_BYTES = 1 << 30
MAX_REDIRECTS = 5
LEAST_BYTES_PER_S = 1 << 20  # minimum rate that extends the deadline; at this rate a gigabyte takes 17 minutes
LONGEST_ADDRESS = 8192
EXPIRED = (401, 403, 404, 410)


def download_file(
    client: httpx2.Client,
    url: str,
    to: Path,
    *,
    name: str,
    max_bytes: int,
    schemes: Set[str],
    deadline: Deadline,
) -> tuple[BackendError | None, bool]:
    """Download ``url`` to the file ``to``; return the error or None, and whether a retry may help.

    Redirects are followed within ``schemes``, never from https to http, and only to addresses that the client may connect to.
    ``deadline`` is extended in proportion to the received bytes (LEAST_BYTES_PER_S). No file is left at ``to`` after an
    error.
    """
    part = to.with_name(f"{to.name}.part")
    try:
        error, again = _fetched(client, url, part, name, max_bytes, schemes, deadline)
        if error is None:
            part.replace(to)
        return error, again
    except httpx2.RequestError as failure:
        # the server answers, but the rest of the file does not arrive
        if part.exists() and isinstance(failure, httpx2.ReadTimeout):
            return BadReply(
                f"{name}: its file downloads too slowly ({failure}); run it again, or raise services.timeout_s"
            ), True
        if part.exists() and isinstance(failure, httpx2.RemoteProtocolError | httpx2.ReadError):
            return BadReply(f"{name}: its file was truncated ({redacted(str(failure), None)}); run it again"), True
        where, why = (redacted(text, None) for text in (urlsplit(url).netloc, str(failure) or type(failure).__name__))
        return Unavailable(f"{name}: {where} does not answer ({why}); run again later"), True
    except ForbiddenAddress as forbidden:
        where = redacted(str(forbidden), None)
        return BadReply(f"{name}: its file is not downloaded from this address: {where}; ask the vendor"), False
    except TooLarge:
        return BadReply(f"{name}: its file is larger than {max_bytes} bytes; ask for a simpler mesh"), False
    finally:
        part.unlink(missing_ok=True)


def _fetched(
    client: httpx2.Client, url: str, part: Path, name: str, max_bytes: int, schemes: Set[str], deadline: Deadline
) -> tuple[BackendError | None, bool]:
    """Follow redirects and write the file; return the error or None, and whether a retry may help."""
    for _ in range(MAX_REDIRECTS + 1):
        if not _is_url(url):
            return BadReply(f"{name}: the link to its file leads to an invalid URL"), False
        scheme = httpx2.URL(url).scheme
        if scheme not in schemes:
            return BadReply(
                f"{name}: its file is at a {scheme or 'relative'} address; only {_or(schemes)} is read"
            ), False
        with client.stream("GET", url) as response:
            location = response.headers.get("Location")
            if not 300 <= response.status_code < 400 or location is None:
                return _written(response, part, name, max_bytes, deadline)
        try:
            url = urljoin(url, location)
        except ValueError:
            url = location  # not a valid address: refused in the next iteration
        if scheme == "https":
            schemes = {"https"}
    return BadReply(f"{name}: the link to its file redirects more than {MAX_REDIRECTS} times"), False


def _written(
    response: httpx2.Response, part: Path, name: str, max_bytes: int, deadline: Deadline
) -> tuple[BackendError | None, bool]:
    """Write the body of a response to ``part``; return the error or None, and whether a retry may help."""
    status = response.status_code
    if status in EXPIRED:
        return NotFound(f"{name}: the link to its file is no longer valid (HTTP {status})"), False
    if status == 429 or status >= 500:
        return Unavailable(f"{name}: its file is not available now (HTTP {status}); run again later"), True
    if status != 200:
        return BadReply(f"{name}: its file is not available (HTTP {status})"), False
    announced = response.headers.get("Content-Length", "")
    length = 0
    with part.open("wb") as stream:
        for piece in decompressed_chunks(response, max_bytes):
            length += len(piece)
            deadline.extend(len(piece) / LEAST_BYTES_PER_S)
            stream.write(piece)
    if announced.isdecimal() and "Content-Encoding" not in response.headers and length != int(announced):
        return BadReply(f"{name}: its file was truncated at {length} of {announced} bytes; run it again"), True
    if not length:
        return BadReply(f"{name}: its file is empty; run it again"), True
    return None, False


def _is_url(url: str) -> bool:
    try:
        urlsplit(url).port  # noqa: B018 - reading the port is what raises ValueError
        user = httpx2.URL(url).userinfo
    except (ValueError, httpx2.InvalidURL):
        return False
    return url.isprintable() and " " not in url and not user and len(url) <= LONGEST_ADDRESS


def _or(schemes: Set[str]) -> str:
    return " or ".join(sorted(schemes))
