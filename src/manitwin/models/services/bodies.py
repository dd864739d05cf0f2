"""Bodies of HTTP answers: decompressed in bounded pieces, and parsed as JSON of bounded size with the key removed."""

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
MOST_PARTS = 2_000_000  # values of a JSON answer: bounds the memory after parsing, about 100 bytes per value
MOST_LEVELS = 100  # levels of nesting: code that reads an answer may be recursive
_HALF_CHARACTER = re.compile(rb"\\u[dD][89a-fA-F]")


class TooLarge(Exception):
    """A body exceeds the size limit."""


def decompressed_chunks(answer: httpx2.Response, max_bytes: int) -> Iterator[bytes]:
    """Yield the decompressed body of an answer while it is received, in pieces of at most 1 MiB.

    The limit applies both to the received and to the decompressed bytes. Raises TooLarge, and httpx2.DecodingError for a body
    that is not in its declared encoding; supported are none, gzip and deflate, applied once.
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
    """Decompress gzip or zlib (RFC 1952, RFC 1950), at most one piece at a time."""

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
    return b"".join(decompressed_chunks(answer, max_bytes))


class NotJson(Exception):
    """A body is not JSON, or exceeds the limits of parsed answers."""


def parsed(data: bytes, key: str | None) -> Any:
    """Return the value of a JSON answer, with the key removed and all strings valid as UTF-8.

    Raises NotJson, also for non-finite numbers, more than MOST_LEVELS levels or more than MOST_PARTS values.
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
    if halved:  # lone UTF-16 surrogates are not valid text
        clean = clean.encode("utf-8", "replace").decode()
    return value if clean == text else json.loads(clean)


def levels(value: Any) -> int:
    """Return the nesting depth of a value, at most MOST_LEVELS + 1."""
    level, depth = [value], 0
    while level and depth <= MOST_LEVELS:
        inner = [part.values() if isinstance(part, dict) else part for part in level if isinstance(part, dict | list)]
        level, depth = [part for parts in inner for part in parts], depth + 1
    return depth
