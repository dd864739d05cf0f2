"""Parser of a Parquet file's footer and page headers, which libraries may crash on if they are false.

Source: the format's parquet.thrift (FileMetaData, SchemaElement, RowGroup, ColumnMetaData, PageHeader) and the specification of
Thrift's compact protocol (doc/specs/thrift-compact-protocol.md). pyarrow 26 crashes the process if a row group has fewer
columns than the schema.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

MAGIC = b"PAR1"
MAX_FOOTER_BYTES = 64 << 20
_HEADER_BYTES = 1 << 16
"""A page header has some tens of bytes; with statistics of long texts, some thousands."""

_BYTE_ARRAY = 6
_WIDTHS = {0: 1, 1: 4, 2: 8, 3: 12, 4: 4, 5: 8, _BYTE_ARRAY: 4}
"""Bytes for each value by physical type; texts are first read as dictionary indices."""

_STOP, _TRUE, _FALSE, _BYTE, _DOUBLE, _BINARY, _LIST, _SET, _STRUCT = 0, 1, 2, 3, 7, 8, 9, 10, 12
_INTEGERS = (4, 5, 6)
_DEPTH = 16


class BadStructure(ValueError):
    """A footer or header that is invalid, or contradicts itself or the file."""


@dataclass(frozen=True)
class Leaf:
    """A schema column that holds values; ``path`` starts with the column of the table."""

    path: tuple[str, ...]
    physical_type: int
    width_bytes: int

    @property
    def column(self) -> str:
        """The column of the table to which it belongs."""
        return self.path[0]

    @property
    def is_text(self) -> bool:
        """True for texts and other values without a fixed length."""
        return self.physical_type == _BYTE_ARRAY


@dataclass(frozen=True)
class Chunk:
    """The byte range of a leaf in a row group."""

    start: int
    length: int


@dataclass(frozen=True)
class Footer:
    """A parsed footer; ``row_groups`` gives the number of rows of each, and its chunks in the order of the leaves."""

    rows: int
    leaves: tuple[Leaf, ...]
    row_groups: tuple[tuple[int, tuple[Chunk, ...]], ...]


@dataclass(frozen=True)
class Page:
    """Sizes that a page header states."""

    values: int
    uncompressed_bytes: int


def footer_of(stream: BinaryIO) -> Footer:
    """Read a file's footer; raises BadStructure."""
    size = stream.seek(0, os.SEEK_END)
    stream.seek(max(0, size - 8))
    ending = stream.read(8)
    if size < 12 or ending[4:] != MAGIC:
        raise BadStructure("it does not end as Parquet does: cut off, or another format")
    (length,) = struct.unpack("<I", ending[:4])
    if length > min(MAX_FOOTER_BYTES, size - 12):
        raise BadStructure(f"a footer of {length} bytes in a file of {size}")
    stream.seek(size - 8 - length)
    said = _Compact(stream.read(length)).struct()
    leaves = _leaves(_list(said, 2))
    groups = [_row_group(each, leaves, size - 8 - length) for each in _list(said, 4)]
    rows = _size(said.get(3))
    if sum(count for count, _ in groups) != rows:
        raise BadStructure(f"{rows} rows, and its row groups have {sum(count for count, _ in groups)}")
    return Footer(rows, leaves, tuple(groups))


def _leaves(elements: list[Any]) -> tuple[Leaf, ...]:
    """Return the leaves of a schema, which is a tree in preorder."""
    leaves: list[Leaf] = []
    place = 1

    def below(path: tuple[str, ...], children: int, depth: int) -> None:
        nonlocal place
        for _ in range(children):
            if place >= len(elements) or depth > _DEPTH:
                raise BadStructure("the tree of its schema is not whole, or too deep")
            element, place = _struct(elements[place]), place + 1
            name = (*path, _text(element.get(4)))
            if 5 in element and (inner := _size(element[5])):
                below(name, inner, depth + 1)
            else:
                kind = _size(element.get(1))
                width = _WIDTHS.get(kind) or _size(element.get(2))  # for the last type, its length is stored here
                leaves.append(Leaf(name, kind, width))

    below((), _size(_struct(elements[0]).get(5, 0)) if elements else 0, 0)
    if place != max(1, len(elements)) or not leaves:
        raise BadStructure("the tree of its schema is not whole")
    return tuple(leaves)


def _row_group(said: Any, leaves: tuple[Leaf, ...], end: int) -> tuple[int, tuple[Chunk, ...]]:
    columns, rows = _list(_struct(said), 1), _size(_struct(said).get(3))
    if len(columns) != len(leaves):
        raise BadStructure(f"a row group of {len(columns)} columns, its schema has {len(leaves)}")
    return rows, tuple(_chunk(column, leaf, rows, end) for column, leaf in zip(columns, leaves, strict=True))


def _chunk(column: Any, leaf: Leaf, rows: int, end: int) -> Chunk:
    column = _struct(column)
    about = _struct(column.get(3))
    if 1 in column:
        raise BadStructure("a column in another file")
    if tuple(map(_text, _list(about, 3))) != leaf.path or about.get(1) != leaf.physical_type:
        raise BadStructure(f"the column {'.'.join(leaf.path)} is not where its schema has it")
    _size(about.get(5))
    # a dictionary precedes the data; files of Arrow before 2.0 state 0 if there is none
    start = min(_size(about.get(9)), _size(about.get(11)) or end if 11 in about else end)
    length = _size(about.get(7))
    if rows and (start < 4 or start + length > end):
        raise BadStructure(f"the column {'.'.join(leaf.path)} leaves the file")
    return Chunk(start, length)


def pages_of(stream: BinaryIO, chunk: Chunk) -> Iterator[Page]:
    """Yield the pages of a chunk, reading only their headers. Raises BadStructure."""
    place, end = chunk.start, chunk.start + chunk.length
    while place < end:
        stream.seek(place)
        reader = _Compact(stream.read(min(_HEADER_BYTES, end - place)))
        header = reader.struct()
        # of data, of data in the second version, of a dictionary; an index has no values
        about = next((header[number] for number in (5, 8, 7) if number in header), {1: 0})
        page = Page(_size(_struct(about).get(1)), _size(header.get(2)))
        place += reader.place + _size(header.get(3))
        if place > end:
            raise BadStructure("a page is longer than its column")
        yield page


def _size(said: Any) -> int:
    if not isinstance(said, int) or said < 0:
        raise BadStructure("a size is missing or negative")
    return said


def _struct(said: Any) -> dict[int, Any]:
    if not isinstance(said, dict):
        raise BadStructure("a part of its structure is missing")
    return said


def _list(said: dict[int, Any], number: int) -> list[Any]:
    value = said.get(number)
    if not isinstance(value, list):
        raise BadStructure("a list of its structure is missing")
    return value


def _text(said: Any) -> str:
    try:
        return bytes(said).decode()
    except (TypeError, ValueError) as error:
        raise BadStructure("a name is missing or not UTF-8") from error


class _Compact:
    """Parser of a struct in Thrift's compact protocol: numbers, texts, lists and structs by field number."""

    def __init__(self, content: bytes):
        self.content, self.place = content, 0

    def struct(self, depth: int = 0) -> dict[int, Any]:
        if depth > _DEPTH:
            raise BadStructure("its structure is nested too deep")
        fields: dict[int, Any] = {}
        number = 0
        while (kind := self._byte()) != _STOP:
            number = number + (kind >> 4) if kind >> 4 else self._zigzag()
            kind &= 15
            fields[number] = self._zigzag() if kind in _INTEGERS else self._value(kind, depth, in_list=False)
        return fields

    def _byte(self) -> int:
        if self.place >= len(self.content):
            raise BadStructure("its structure is cut off")
        self.place += 1
        return self.content[self.place - 1]

    def _varint(self) -> int:
        if self.place < len(self.content) and (byte := self.content[self.place]) < 128:  # most are this short
            self.place += 1
            return byte
        value = shift = 0
        while True:
            byte = self._byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value
            shift += 7
            if shift > 63:
                raise BadStructure("a number is too long")

    def _zigzag(self) -> int:
        value = self._varint()
        return (value >> 1) ^ -(value & 1)

    def _bytes(self, count: int) -> bytes:
        if count > len(self.content) - self.place:
            raise BadStructure("its structure is cut off")
        self.place += count
        return self.content[self.place - count : self.place]

    def _value(self, kind: int, depth: int, *, in_list: bool) -> Any:
        if kind in (_TRUE, _FALSE):
            return self._byte() == _TRUE if in_list else kind == _TRUE
        if kind == _BYTE:
            return self._byte()
        if kind in _INTEGERS:
            return self._zigzag()
        if kind == _DOUBLE:
            return self._bytes(8)
        if kind == _BINARY:
            return self._bytes(self._varint())
        if kind in (_LIST, _SET):
            return self._values(depth + 1)
        if kind == _STRUCT:
            return self.struct(depth + 1)
        raise BadStructure("its structure has an unknown field")  # no struct of the format has a map

    def _values(self, depth: int) -> list[Any]:
        head = self._byte()
        count = head >> 4 if head >> 4 < 15 else self._varint()
        if count > len(self.content) - self.place or depth > _DEPTH:  # each value takes at least a byte
            raise BadStructure("its structure is cut off")
        return [self._value(head & 15, depth, in_list=True) for _ in range(count)]
