"""Reader of untrusted Parquet: a regular file with columns of the expected types, within a memory limit.

All Parquet from outside the package is opened by ``open_parquet``, or checked by ``check_parquet`` before DuckDB or pyarrow's
data sets read it. A footer may state false sizes, and a dictionary may repeat a long text a million times; therefore pages are
checked against the limit by their own headers, and texts by their lengths before they are expanded.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, BinaryIO

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from manitwin.formats.bounded_file import Refusal, open_regular, with_remedy
from manitwin.formats.parquet_structure import Footer, footer_of, pages_of
from manitwin.formats.printable import printable_line

MAX_ROWS = 1 << 24
MAX_COLUMNS = 4096
MAX_BYTES = 1 << 30
_CAUSE_CHARACTERS = 160
_FAILURES = (pa.ArrowException, OSError, MemoryError, OverflowError, ValueError, KeyError, IndexError, RecursionError)
"""What pyarrow raises for files that are invalid, truncated, altered, or have unsupported codecs and encodings."""


@dataclass
class _Unreadable:
    """Makes the one-line error with the reason why a file cannot be read, and a remedy."""

    called: str
    refuse: Refusal
    remedy: str

    def __call__(self, cause: object) -> Exception:
        said = printable_line(" ".join(str(cause).split()), max_characters=_CAUSE_CHARACTERS) or type(cause).__name__
        return self.refuse(f"{self.called}: {said}; {self.remedy}")

    @contextmanager
    def failures(self) -> Iterator[None]:
        """Convert exceptions of pyarrow to the one-line error; errors of this package pass through."""
        try:
            yield
        except _FAILURES as error:
            raise self(f"no Parquet file that can be read ({_first_line(error)})") from error


class ParquetTable:
    """An open Parquet file with checked footer, columns and pages; read as a whole or by row groups."""

    def __init__(self, file: pq.ParquetFile, unreadable: _Unreadable, max_bytes: int):
        self._file, self._unreadable, self._max_bytes = file, unreadable, max_bytes
        self.rows: int = file.metadata.num_rows
        self.row_groups: int = file.metadata.num_row_groups
        self.names: list[str] = file.schema_arrow.names
        self.metadata: dict[bytes, bytes] = file.schema_arrow.metadata or {}

    def read(self, columns: Sequence[str] | None = None, *, row_group: int | None = None) -> pa.Table:
        """Return the rows, all or of one row group, with plain types; no extension type is created."""
        with self._unreadable.failures():
            groups = None if row_group is None else [row_group]
            names = self.names if columns is None else list(columns)
            table = (
                self._file.read(columns=names, use_threads=False)
                if groups is None
                else self._file.read_row_groups(groups, columns=names, use_threads=False)
            )
            self._check_text_size(table)
            plain = table.cast(_plain(table.schema))
            plain.validate(full=True)  # checks that texts are UTF-8, which pyarrow otherwise does only on access
            return plain

    def _check_text_size(self, table: pa.Table) -> None:
        """Refuse texts that expand to more than the limit."""
        for name, column in zip(table.column_names, table.columns, strict=True):
            total = sum(_expanded_bytes(chunk) for chunk in column.chunks)
            if total > self._max_bytes:
                raise self._unreadable(f"{name} unfolds to {total} bytes, more than the limit of {self._max_bytes}")


@contextmanager
def open_parquet(
    path: Path | BinaryIO,
    refuse: Refusal,
    *,
    schema: pa.Schema | None = None,
    columns: Sequence[str] | None = None,
    optional: Collection[str] = (),
    remedy: str,
    max_rows: int = MAX_ROWS,
    max_bytes: int = MAX_BYTES,
    inside: Path | None = None,
    name: str | None = None,
) -> Iterator[ParquetTable]:
    """Open a regular Parquet file, or a stream of one, for bounded reading.

    With ``schema``, the file must have all its columns except ``optional`` ones, with these types; further columns are ignored.
    Only ``columns`` (None: those of the schema, or all) are checked and may be read. Raises the error that ``refuse`` makes of
    a line ending in the remedy.
    """
    called = name or str(path)
    stream = (
        open_regular(path, with_remedy(refuse, remedy), inside=inside, name=called) if isinstance(path, Path) else path
    )
    unreadable = _Unreadable(printable_line(called), refuse, remedy)
    with stream:
        with unreadable.failures():
            footer = footer_of(stream)
            wanted = columns if columns is not None else None if schema is None else schema.names
            if wanted is not None and optional:
                there = {leaf.column for leaf in footer.leaves}
                wanted = [name for name in wanted if name in there or name not in optional]
            _check_footer(footer, wanted, unreadable, max_rows)
            _check_pages(stream, footer, wanted, unreadable, max_bytes)
            stream.seek(0)
            texts = [".".join(leaf.path) for leaf in footer.leaves if leaf.is_text]
            # without threads of pyarrow here and in read: one that releases the Python stream while the interpreter ends aborts
            # the process with "terminate called without an active exception" (apache/arrow#34314)
            file = pq.ParquetFile(stream, read_dictionary=texts, arrow_extensions_enabled=False, pre_buffer=False)
            if schema is not None:
                _check_types(file.schema_arrow, schema, wanted or schema.names, unreadable)
        yield ParquetTable(file, unreadable, max_bytes)


def read_parquet(
    path: Path | BinaryIO,
    refuse: Refusal,
    *,
    schema: pa.Schema | None = None,
    columns: Sequence[str] | None = None,
    remedy: str,
    inside: Path | None = None,
    name: str | None = None,
) -> pa.Table:
    """Return the rows of a file, opened like ``open_parquet``; with ``schema``, only its columns, in its order."""
    with open_parquet(path, refuse, schema=schema, columns=columns, remedy=remedy, inside=inside, name=name) as file:
        return file.read(columns if columns is not None else None if schema is None else schema.names)


def check_parquet(path: Path, refuse: Refusal, *, schema: pa.Schema | None = None, remedy: str, **options: Any) -> int:
    """Check a file that another library is to read, like ``open_parquet``; return its number of rows."""
    with open_parquet(path, refuse, schema=schema, remedy=remedy, **options) as file:
        return file.rows


def _check_footer(footer: Footer, columns: Sequence[str] | None, unreadable: _Unreadable, max_rows: int) -> None:
    if footer.rows > max_rows:
        raise unreadable(f"{footer.rows} rows exceed the limit of {max_rows}")
    if len(footer.leaves) > MAX_COLUMNS:
        raise unreadable(f"{len(footer.leaves)} columns exceed the limit of {MAX_COLUMNS}")
    there = {leaf.column for leaf in footer.leaves}
    missing = [name for name in columns or () if name not in there]
    if missing:
        raise unreadable(f"has no column {missing[0]}")


def _check_pages(
    stream: BinaryIO, footer: Footer, columns: Sequence[str] | None, unreadable: _Unreadable, max_bytes: int
) -> None:
    """Check the expanded size of each row group against the limit, by the headers of its pages."""
    for rows, chunks in footer.row_groups:
        total = 0
        for leaf, chunk in zip(footer.leaves, chunks, strict=True):
            if not rows or (columns is not None and leaf.column not in columns):  # without rows there may be no pages
                continue
            for page in pages_of(stream, chunk):
                total += max(page.uncompressed_bytes, page.values * leaf.width_bytes)
                if total > max_bytes:
                    raise unreadable(f"unfolds to {total} bytes or more, the limit is {max_bytes}")


def _check_types(found: pa.Schema, schema: pa.Schema, columns: Sequence[str], unreadable: _Unreadable) -> None:
    plain = _plain(found)
    for name in columns:
        if plain.get_all_field_indices(name) != [plain.get_field_index(name)]:
            raise unreadable(f"has the column {name} more than once")
        kind, wanted = plain.field(name).type, schema.field(name).type
        if kind != wanted:
            raise unreadable(f"{name} is of type {kind}, not {wanted}")


def _plain(schema: pa.Schema) -> pa.Schema:
    """Return a schema with plain text types in place of dictionaries."""
    return pa.schema([field.with_type(_plain_type(field.type)) for field in schema], metadata=schema.metadata)


def _plain_type(kind: pa.DataType) -> pa.DataType:
    if pa.types.is_dictionary(kind):
        return kind.value_type
    if pa.types.is_list(kind):
        return pa.list_(kind.value_field.with_type(_plain_type(kind.value_type)))
    return kind


def _expanded_bytes(array: pa.Array) -> int:
    """Return the size of an array's texts after expanding its dictionaries."""
    if pa.types.is_list(array.type):
        return _expanded_bytes(array.flatten())
    if not pa.types.is_dictionary(array.type):
        return int(array.nbytes)
    lengths = pc.binary_length(array.dictionary).cast(pa.int64())
    return int(pc.sum(pc.take(lengths, array.indices)).as_py() or 0) + 4 * len(array)


def _first_line(error: BaseException) -> str:
    return str(error).strip().split("\n")[0] or type(error).__name__
