"""Bodies of answers: decoded in bounded pieces, read as JSON of a bounded number of parts, without the key."""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator
from typing import Any

import httpx2

from manitwin.formats.json_file import parse_json
from manitwin.models.services.keys import without_key

PIECE_BYTES = 1 << 20
MOST_PARTS = 2_000_000  # of a JSON answer: what a part takes in memory is bounded (100 bytes or so), not what it is in
MOST_LEVELS = 100  # of nesting: what reads an answer may go through it by recursion
_HALF_CHARACTER = re.compile(rb"\\u[dD][89a-fA-F]")


class TooLarge(Exception):
    """A body of more bytes than are read."""


def pieces(answer: httpx2.Response, max_bytes: int) -> Iterator[bytes]:
    """Return the body of an answer that is being received, decoded, in pieces of at most 1 MiB.

    The limit holds for what is sent and for what that unpacks to. Raises TooLarge, and httpx2.DecodingError for what is not
    in its encoding: none, gzip or deflate, once.
    """
    announced = answer.headers.get("Content-Length", "")
    if announced.isdecimal() and int(announced) > max_bytes:
        raise TooLarge
    unpack = _unpacker(answer.headers.get("Content-Encoding", ""))
    sent = decoded = 0
    for chunk in answer.iter_raw(PIECE_BYTES):
        sent += len(chunk)
        for piece in unpack(chunk):
            decoded += len(piece)
            if decoded > max_bytes:
                raise TooLarge
            yield piece
        if sent > max_bytes:
            raise TooLarge


class _Plain:
    def __call__(self, chunk: bytes) -> Iterator[bytes]:
        yield chunk


class _Zipped:
    """Unpack gzip or zlib (RFC 1952, RFC 1950), never more than a piece at a time."""

    def __init__(self) -> None:
        self._unpacker = zlib.decompressobj(zlib.MAX_WBITS | 32)

    def __call__(self, chunk: bytes) -> Iterator[bytes]:
        while chunk and not self._unpacker.eof:
            try:
                piece = self._unpacker.decompress(chunk, PIECE_BYTES)
            except zlib.error as error:
                raise httpx2.DecodingError(str(error)) from None
            chunk = self._unpacker.unconsumed_tail
            if piece:
                yield piece


def _unpacker(encoding: str) -> _Plain | _Zipped:
    encoding = encoding.strip().lower()
    if encoding in ("", "identity"):
        return _Plain()
    if encoding in ("gzip", "x-gzip", "deflate"):
        return _Zipped()
    raise httpx2.DecodingError("its content encoding was not requested")


def whole_body(answer: httpx2.Response, max_bytes: int) -> bytes:
    """Return a body of at most ``max_bytes``; raises TooLarge."""
    return b"".join(pieces(answer, max_bytes))


class NotJson(Exception):
    """A body that is no JSON, or is JSON that no answer is."""


def parsed(data: bytes, key: str | None) -> Any:
    """Return the value of a JSON answer, in which the key stands nowhere and every text can be written as UTF-8.

    Raises NotJson, also for numbers that are not finite, for more than MOST_LEVELS levels and for more than MOST_PARTS parts.
    """
    if sum(map(data.count, (b",", b"[", b"{"))) > MOST_PARTS:
        raise NotJson(f"more than {MOST_PARTS} parts")
    value = parse_json(data, "answer", NotJson)
    if sum(map(data.count, (b"[", b"{"))) > MOST_LEVELS and levels(value) > MOST_LEVELS:
        raise NotJson(f"more than {MOST_LEVELS} levels")
    halved = _HALF_CHARACTER.search(data) is not None
    if key is None and not halved:
        return value
    text = json.dumps(value, ensure_ascii=False)
    clean = without_key(text, key)
    if halved:  # half of a pair of UTF-16: no text
        clean = clean.encode("utf-8", "replace").decode()
    return value if clean == text else json.loads(clean)


def levels(value: Any) -> int:
    """Return how deep a value is nested, or MOST_LEVELS + 1 where that is deeper."""
    level, depth = [value], 0
    while level and depth <= MOST_LEVELS:
        inner = [part.values() if isinstance(part, dict) else part for part in level if isinstance(part, dict | list)]
        level, depth = [part for parts in inner for part in parts], depth + 1
    return depth
