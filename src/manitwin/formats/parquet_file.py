"""Parquet that others wrote: a regular file, its columns of the types that they should be, no larger in memory than a limit.

All Parquet from outside the package is opened here: by ``open_parquet``, or, before DuckDB or pyarrow's data sets read it, looked
at by ``check_parquet``. A footer may lie about sizes and a dictionary may repeat a long text a million times, so that pages are
held against the limit by their own headers, and texts by their lengths before they are unfolded.
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
"""What pyarrow raises for files that are none, cut off, altered, or of codecs and encodings that it has not."""


@dataclass
class _Unreadable:
    """Makes the one line that says why a file cannot be read, and what to do."""

    called: str
    refuse: Refusal
    remedy: str

    def __call__(self, cause: object) -> Exception:
        said = printable_line(" ".join(str(cause).split()), max_characters=_CAUSE_CHARACTERS) or type(cause).__name__
        return self.refuse(f"{self.called}: {said}; {self.remedy}")

    @contextmanager
    def failures(self) -> Iterator[None]:
        """Turn what pyarrow raises into the one line; errors of this package pass."""
        try:
            yield
        except _FAILURES as error:
            raise self(f"no Parquet file that can be read ({_first_line(error)})") from error


class ParquetTable:
    """An open Parquet file whose footer, columns and pages have been looked at; read by row groups or whole."""

    def __init__(self, file: pq.ParquetFile, unreadable: _Unreadable, max_bytes: int):
        self._file, self._unreadable, self._max_bytes = file, unreadable, max_bytes
        self.rows: int = file.metadata.num_rows
        self.row_groups: int = file.metadata.num_row_groups
        self.names: list[str] = file.schema_arrow.names
        self.metadata: dict[bytes, bytes] = file.schema_arrow.metadata or {}

    def read(self, columns: Sequence[str] | None = None, *, row_group: int | None = None) -> pa.Table:
        """Return rows, all or of one row group, with their own types; no extension type is made."""
        with self._unreadable.failures():
            groups = None if row_group is None else [row_group]
            names = self.names if columns is None else list(columns)
            table = (
                self._file.read(columns=names, use_threads=False)
                if groups is None
                else self._file.read_row_groups(groups, columns=names, use_threads=False)
            )
            self._hold_texts(table)
            plain = table.cast(_plain(table.schema))
            plain.validate(full=True)  # that texts are UTF-8: pyarrow itself looks only where one is asked for
            return plain

    def _hold_texts(self, table: pa.Table) -> None:
        """Refuse texts that unfold to more than the limit."""
        for name, column in zip(table.column_names, table.columns, strict=True):
            total = sum(_unfolded_bytes(chunk) for chunk in column.chunks)
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
    """Open a regular Parquet file, or a stream of one; what of it is read later is bounded.

    With ``schema`` it has all these columns but for ``optional`` ones, of these types; more are let be. Only ``columns`` (None:
    those of the schema, or all) are looked at, and may be read. Raises what ``refuse`` makes of one line, which ends in the
    remedy.
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
            # without threads of pyarrow's own, here and in read: one that lets go of the Python stream while the interpreter
            # ends takes the process down, "terminate called without an active exception" (apache/arrow#34314)
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
    """Return the rows of a file as ``open_parquet`` opens it: with ``schema`` its columns alone, in its order."""
    with open_parquet(path, refuse, schema=schema, columns=columns, remedy=remedy, inside=inside, name=name) as file:
        return file.read(columns if columns is not None else None if schema is None else schema.names)


def check_parquet(path: Path, refuse: Refusal, *, schema: pa.Schema | None = None, remedy: str, **options: Any) -> int:
    """Look at a file that another library is to read, as ``open_parquet`` does; returns its number of rows."""
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
    """Hold what each row group unfolds to against the limit, by the headers of its pages."""
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
    """Return a schema whose texts are read as texts, not as dictionaries."""
    return pa.schema([field.with_type(_plain_type(field.type)) for field in schema], metadata=schema.metadata)


def _plain_type(kind: pa.DataType) -> pa.DataType:
    if pa.types.is_dictionary(kind):
        return kind.value_type
    if pa.types.is_list(kind):
        return pa.list_(kind.value_field.with_type(_plain_type(kind.value_type)))
    return kind


def _unfolded_bytes(array: pa.Array) -> int:
    """Return the bytes of an array's texts once its dictionaries are unfolded."""
    if pa.types.is_list(array.type):
        return _unfolded_bytes(array.flatten())
    if not pa.types.is_dictionary(array.type):
        return int(array.nbytes)
    lengths = pc.binary_length(array.dictionary).cast(pa.int64())
    return int(pc.sum(pc.take(lengths, array.indices)).as_py() or 0) + 4 * len(array)


def _first_line(error: BaseException) -> str:
    return str(error).strip().split("\n")[0] or type(error).__name__
