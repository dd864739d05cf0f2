"""Storage of twin embeddings in the data set, ``search/<space>/<2 hex>/<twin_id>.parquet``, each computed once per content."""

from __future__ import annotations

import io
from dataclasses import dataclass

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from manitwin.errors import TwinError
from manitwin.formats.parquet_file import read_parquet
from manitwin.twin.dataset_root import DatasetRoot

FOLDER = "search"
MAX_STORED_BYTES = 64 << 20
REMEDY = "remove the folder search/ of the data set"


@dataclass(frozen=True)
class StoredVectors:
    """The vectors ``(V, D) float32`` of a twin at ``revision``; ``content`` is the digest of the data they were computed from."""

    revision: str
    content: str
    vectors: np.ndarray


class VectorStore:
    """The vectors of one space (an embedder and its version), ``length`` numbers each, stored in half precision.

    Files are written atomically, so that an interrupted run can continue.
    """

    def __init__(self, root: DatasetRoot, space: str, length: int | None = None):
        self._root, self.space, self._length = root, space, length

    def file(self, twin_id: str) -> str:
        """Return the name of a twin's file relative to the root."""
        return f"{FOLDER}/{self.space}/{twin_id[:2]}/{twin_id}.parquet"

    def read(self, twin_id: str) -> StoredVectors | None:
        """Return the stored vectors of a twin; None if they are missing or unreadable and must be recomputed."""
        try:
            content = self._root.read_bytes(self.file(twin_id), limit_bytes=MAX_STORED_BYTES)
            table = read_parquet(io.BytesIO(content), TwinError, schema=_SCHEMA, remedy=REMEDY, name=self.file(twin_id))
        except (FileNotFoundError, TwinError):
            return None
        rows = table.to_pydict()
        lengths = {len(row) for row in rows["vector"] if row is not None}
        if not lengths or len(lengths) > 1 or (self._length or min(lengths)) not in lengths or None in rows["vector"]:
            return None
        vectors = np.array(rows["vector"], np.float32)
        if not np.isfinite(vectors).all() or None in (rows["revision"][0], rows["content"][0]):
            return None
        return StoredVectors(rows["revision"][0], rows["content"][0], vectors)

    def write(self, twin_id: str, stored: StoredVectors) -> StoredVectors:
        """Store a twin's vectors and return them rounded as stored. Equal vectors give equal bytes."""
        half = stored.vectors.astype(np.float16).astype(np.float32)
        count = len(half)
        table = pa.table(
            {
                "revision": [stored.revision] * count,
                "content": [stored.content] * count,
                "vector": pa.array(list(half), pa.list_(pa.float32())),
            },
            schema=_SCHEMA,
        )
        stream = io.BytesIO()
        pq.write_table(table, stream, compression="zstd", version="2.6", use_dictionary=["revision", "content"])
        self._root.write_bytes(self.file(twin_id), stream.getvalue())
        return StoredVectors(stored.revision, stored.content, half)


_SCHEMA = pa.schema([("revision", pa.string()), ("content", pa.string()), ("vector", pa.list_(pa.float32()))])
