"""Rows of PLY elements, ASCII and binary, with header counts checked against the file size before allocation."""

from __future__ import annotations

from array import array
from dataclasses import dataclass

import numpy as np

from manitwin.formats.meshes.source import MeshSource

REMEDY = "download or export it again"
_BLOCK_BYTES = 1 << 20
_BLOCK_ROWS = 1 << 16
_LONGEST_WORD = 4096
_VALUES_PER_VERTEX = 16


@dataclass(frozen=True)
class Property:
    """A property of an element; ``count_dtype`` is the type of a list's length, None for a single value."""

    name: str
    dtype: str
    count_dtype: str | None = None


@dataclass(frozen=True)
class Element:
    """An element of the header, with its number of rows and its properties in order."""

    name: str
    count: int
    properties: tuple[Property, ...]


@dataclass(frozen=True)
class Lists:
    """A list property of all rows: ``sizes (N,)`` and the concatenated ``values``."""

    sizes: np.ndarray
    values: np.ndarray


Columns = dict[str, np.ndarray | Lists]


def check_rows(element: Element, body_bytes: int, source: MeshSource) -> None:
    """Refuse an element with more rows or values than the file holds or the limits allow; raises InputError.

    Each row takes at least a byte. Rows without properties take none, and are never iterated.
    """
    if not element.properties:
        return
    if element.count > body_bytes:
        cause = f"truncated: it declares {element.count} {element.name} rows but has {body_bytes} bytes"
        raise source.unreadable(cause, REMEDY)
    if element.name == "face":
        source.check_faces(element.count)
    source.check_vertices(element.count)
    limit = _VALUES_PER_VERTEX * source.limits.max_vertices
    if element.count * len(element.properties) > limit:
        raise source.too_large(f"its {element.name} rows have more than {limit} values")


class Words:
    """Reads the numbers of an ASCII body in order, parsing at most a block beyond the requested numbers."""

    def __init__(self, data: bytes, offset: int):
        self._data, self._at = data, offset
        self._ahead = np.empty(0)

    def peek(self, count: int) -> np.ndarray:
        """Return the next numbers ``(count,) float64`` without consuming them; raises ValueError if there are fewer."""
        if count > len(self._ahead):
            # a number takes at least one byte, and a byte separates it from the next
            if 2 * (count - len(self._ahead)) - 1 > len(self._data) - self._at:
                raise ValueError(count)
            blocks, have = [self._ahead], len(self._ahead)
            while have < count:
                blocks.append(self._block())
                have += len(blocks[-1])
            self._ahead = np.concatenate(blocks)
        return self._ahead[:count]

    def take(self, count: int) -> np.ndarray:
        """Return the next ``count`` numbers and consume them."""
        values = self.peek(count)
        self._ahead = self._ahead[count:]
        return values

    def _block(self) -> np.ndarray:
        if self._at >= len(self._data):
            raise ValueError("no more numbers")
        end = self._at + _BLOCK_BYTES
        if end < len(self._data):
            tail = self._data[end : end + _LONGEST_WORD].split(None, 1)
            # the rest of a word that the end of the block splits
            cut = not (self._data[end - 1 : end].isspace() or self._data[end : end + 1].isspace())
            if cut and tail:
                end += len(tail[0])
                if len(tail[0]) == _LONGEST_WORD:
                    raise ValueError("a word that is too long for a number")
        values = np.array(self._data[self._at : end].split(), dtype=np.float64)
        self._at = end
        return values


def ascii_rows(element: Element, words: Words, source: MeshSource) -> Columns:
    """Read an element's rows from the numbers of an ASCII body; raises InputError ``unreadable``."""
    try:
        if all(p.count_dtype is None for p in element.properties):
            columns = len(element.properties)
            if not columns:
                return {}
            table = words.take(element.count * columns).reshape(element.count, columns)
            return {p.name: table[:, i] for i, p in enumerate(element.properties)}
        return _ascii_lists(element, words, source)
    except (ValueError, IndexError, OverflowError) as error:
        raise source.unreadable(
            f"truncated or broken: its {element.name} rows do not match its header", REMEDY
        ) from error


def _ascii_lists(element: Element, words: Words, source: MeshSource) -> Columns:
    collected: dict[str, list[np.ndarray]] = {p.name: [] for p in element.properties}
    sizes: dict[str, list[np.ndarray]] = {p.name: [] for p in element.properties}
    values, limit = 0, _VALUES_PER_VERTEX * source.limits.max_vertices
    for start in range(0, element.count, _BLOCK_ROWS):
        rows = min(_BLOCK_ROWS, element.count - start)
        block = _equal_lists(element, words, rows) or _unequal_lists(element, words, rows)
        for p in element.properties:
            sizes[p.name].append(block[p.name].sizes)
            collected[p.name].append(block[p.name].values)
            values += len(block[p.name].values)
        if values > limit:
            raise source.too_large(f"its {element.name} rows have more than {limit} values")
    found: Columns = {}
    for p in element.properties:
        table = np.concatenate([np.empty(0), *collected[p.name]])
        counts = np.concatenate([np.empty(0, np.int64), *sizes[p.name]])
        found[p.name] = table if p.count_dtype is None else Lists(counts, table)
    return found


def _equal_lists(element: Element, words: Words, rows: int) -> dict[str, Lists] | None:
    """Read rows whose lists all have the lengths of the first row, as in most files; return None if they do not."""
    at, places, sizes = 0, [], []
    for p in element.properties:
        size = 1 if p.count_dtype is None else _size(words.peek(at + 1)[at])
        at += p.count_dtype is not None
        places.append(at)
        sizes.append(size)
        at += size
    try:
        table = words.peek(rows * at).reshape(rows, at)
    except ValueError:
        return None
    for p, place, size in zip(element.properties, places, sizes, strict=True):
        if p.count_dtype is not None and (table[:, place - 1] != size).any():
            return None
    words.take(rows * at)
    return {
        p.name: Lists(np.full(rows, size, np.int64), table[:, place : place + size].reshape(-1))
        for p, place, size in zip(element.properties, places, sizes, strict=True)
    }


def _unequal_lists(element: Element, words: Words, rows: int) -> dict[str, Lists]:
    sizes = {p.name: array("q") for p in element.properties}
    values: dict[str, list[np.ndarray]] = {p.name: [] for p in element.properties}
    for _ in range(rows):
        for p in element.properties:
            size = 1 if p.count_dtype is None else _size(words.take(1)[0])
            sizes[p.name].append(size)
            values[p.name].append(words.take(size))
    return {name: Lists(np.array(sizes[name], np.int64), np.concatenate(values[name])) for name in sizes}


def _size(number: float) -> int:
    size = int(number)
    if size < 0 or size != number:
        raise ValueError(number)
    return size


def binary_rows(element: Element, data: bytes, offset: int, order: str, source: MeshSource) -> tuple[Columns, int]:
    """Read an element's rows from a binary body; return them and the offset after them.

    Rows whose lists all have the lengths of the first row are read at once, others one by one. ``order`` is numpy's sign of the
    byte order, ``<`` or ``>``. Raises InputError ``unreadable`` if the file ends early.
    """
    fields: list[tuple[str, str] | tuple[str, str, tuple[int, ...]]] = []
    at = offset
    short = source.unreadable(f"truncated: its {element.name} rows end early", REMEDY)
    if element.count == 0 or not element.properties:
        return {
            p.name: np.empty(0) if p.count_dtype is None else Lists(np.empty(0, np.int64), np.empty(0))
            for p in element.properties
        }, at
    for i, p in enumerate(element.properties):
        size = 1
        if p.count_dtype is not None:
            counted = np.dtype(order + p.count_dtype)
            if at + counted.itemsize > len(data):
                raise short
            size = int(np.frombuffer(data, counted, 1, at)[0])
            fields.append((f"n{i}", order + p.count_dtype))
            at += counted.itemsize
        at += size * np.dtype(p.dtype).itemsize
        if size < 0 or at > len(data):
            raise short
        fields.append((f"p{i}", order + p.dtype, (size,)))
    row = np.dtype(fields)
    if offset + element.count * row.itemsize <= len(data):
        rows = np.frombuffer(data, row, element.count, offset)
        lists = [i for i, p in enumerate(element.properties) if p.count_dtype is not None]
        if all((rows[f"n{i}"] == rows[f"n{i}"][0]).all() for i in lists):
            columns: Columns = {}
            for i, p in enumerate(element.properties):
                values = rows[f"p{i}"]
                columns[p.name] = (
                    Lists(rows[f"n{i}"].astype(np.int64), values.reshape(-1)) if i in lists else values[:, 0]
                )
            return columns, offset + element.count * row.itemsize
    return _binary_lists(element, data, offset, order, short)


def _binary_lists(element: Element, data: bytes, offset: int, order: str, short: Exception) -> tuple[Columns, int]:
    joined: dict[str, list[np.ndarray]] = {p.name: [] for p in element.properties}
    fresh: dict[str, list[np.ndarray]] = {p.name: [] for p in element.properties}
    sizes: dict[str, array[int]] = {p.name: array("q") for p in element.properties}
    at = offset
    for row in range(element.count):
        for p in element.properties:
            size = 1
            try:
                if p.count_dtype is not None:
                    counted = np.dtype(order + p.count_dtype)
                    size = int(np.frombuffer(data, counted, 1, at)[0])
                    at += counted.itemsize
                if size < 0:
                    raise short
                if size:
                    fresh[p.name].append(np.frombuffer(data, order + p.dtype, size, at))
            except ValueError as error:
                raise short from error
            sizes[p.name].append(size)
            at += size * np.dtype(p.dtype).itemsize
        if row % _BLOCK_ROWS == _BLOCK_ROWS - 1:  # many small arrays take many times the bytes of their rows
            _join(joined, fresh)
    _join(joined, fresh)
    columns: Columns = {}
    for p in element.properties:
        values = np.concatenate([np.empty(0, order + p.dtype), *joined[p.name]])
        columns[p.name] = values if p.count_dtype is None else Lists(np.array(sizes[p.name], np.int64), values)
    return columns, at


def _join(joined: dict[str, list[np.ndarray]], fresh: dict[str, list[np.ndarray]]) -> None:
    for name, blocks in fresh.items():
        if blocks:
            joined[name].append(np.concatenate(blocks))
            blocks.clear()
