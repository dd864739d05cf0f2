"""Buffers, buffer views and accessors of glTF 2.0, with every size checked before use."""

from __future__ import annotations

import base64
import binascii
import struct
from typing import Any

import numpy as np

from manitwin.formats.meshes.gltf_meshopt import MESHOPT, decompress_view, is_compressed
from manitwin.formats.meshes.source import Buffer, MeshSource

# glTF 2.0, section 3.6.2.2
_DTYPES = {5120: np.int8, 5121: np.uint8, 5122: np.int16, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}
_COLUMNS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
_GLB_JSON, _GLB_BIN = 0x4E4F534A, 0x004E4942
_REMEDY = "download or export it again"
_VALUES_PER_VERTEX = 16  # position, normal, texture coordinates, colour, and its share of the indices: 13


def split_glb(data: bytes, source: MeshSource) -> tuple[bytes, memoryview | None]:
    """Return the JSON and a view of the binary chunk of a GLB container (glTF 2.0, section 4); raises InputError."""
    if len(data) < 20:
        raise source.unreadable("the GLB ends inside its header", _REMEDY)
    _, version, length = struct.unpack_from("<III", data)
    if version != 2:
        raise source.unreadable(f"GLB version {version}, only version 2 is supported", "export it as glTF 2.0")
    if length > len(data):
        raise source.unreadable(f"truncated: the GLB declares {length} bytes but has {len(data)}", _REMEDY)
    chunks: list[tuple[int, memoryview]] = []
    offset = 12
    while offset + 8 <= length and len(chunks) < 2:  # a reader may use only two chunks
        size, kind = struct.unpack_from("<II", data, offset)
        if offset + 8 + size > length:
            raise source.unreadable("a GLB chunk is longer than the file", _REMEDY)
        chunks.append((kind, memoryview(data)[offset + 8 : offset + 8 + size]))
        offset += 8 + size
    if not chunks or chunks[0][0] != _GLB_JSON:
        raise source.unreadable("the GLB has no JSON chunk", _REMEDY)
    return bytes(chunks[0][1]), next((chunk for kind, chunk in chunks[1:] if kind == _GLB_BIN), None)


class Accessors:
    """Arrays of a glTF document by accessor index; raises InputError ``unreadable`` for inconsistent data."""

    def __init__(self, tree: dict[str, Any], binary: Buffer | None, source: MeshSource):
        self._tree, self._binary, self._source = tree, binary, source
        self._buffers: dict[int, Buffer] = {}
        self._values = 0
        self._arrays: dict[int, np.ndarray] = {}
        self._decompressed: dict[int, bytes] = {}
        self._decompressed_bytes = 0

    def array(self, index: Any) -> np.ndarray:
        """Return accessor ``index`` as ``(count, columns)``; normalised integers become float32 in -1..1."""
        position = self._checked(index, "accessors")
        if position not in self._arrays:
            self._arrays[position] = self._read(self._tree["accessors"][position])
        return self._arrays[position]

    def has_data(self, index: Any) -> bool:
        """Return whether accessor ``index`` has data in a buffer."""
        accessor = self._tree["accessors"][self._checked(index, "accessors")]
        return "bufferView" in accessor or "sparse" in accessor

    def is_filled(self, index: Any) -> bool:
        """Return whether the array of accessor ``index`` has been set."""
        return self._checked(index, "accessors") in self._arrays

    def count(self, index: Any) -> int:
        """Return the element count that accessor ``index`` states."""
        return self._count(self._tree["accessors"][self._checked(index, "accessors")].get("count"))

    def fill(self, index: Any, values: np.ndarray) -> None:
        """Set the values ``(count, columns)`` of accessor ``index`` from decompressed data; see ``array``."""
        position = self._checked(index, "accessors")
        self._arrays[position] = _normalized(values, self._tree["accessors"][position])

    def view(self, index: Any) -> memoryview:
        """Return the bytes of buffer view ``index``, decompressed if meshoptimizer compressed it."""
        position = self._checked(index, "bufferViews")
        view = self._tree["bufferViews"][position]
        if is_compressed(view):
            if position not in self._decompressed:
                self._decompressed[position] = self._decompress(view)
            return memoryview(self._decompressed[position])
        return self._range(view, f"buffer view {position}")

    def _range(self, view: dict[str, Any], what: str) -> memoryview:
        start, length = self._count(view.get("byteOffset", 0)), self._count(view.get("byteLength"))
        data = self._buffer(self._checked(view.get("buffer"), "buffers"))
        if start + length > len(data):
            raise self._source.unreadable(f"truncated: {what} ends at {start + length} of {len(data)} bytes", _REMEDY)
        return memoryview(data)[start : start + length]

    def _decompress(self, view: dict[str, Any]) -> bytes:
        told = view["extensions"][MESHOPT]
        count, stride = self._count(told.get("count")), self._count(told.get("byteStride"))
        self._source.check_vertices(count)
        self._decompressed_bytes += count * stride
        if self._decompressed_bytes > self._source.limits.max_bytes:
            raise self._source.too_large(f"it decompresses to more than {self._source.limits.max_bytes} bytes")
        mode, filter = str(told.get("mode")), str(told.get("filter", "NONE"))
        try:
            return decompress_view(
                bytes(self._range(told, "a compressed view")), mode=mode, filter=filter, count=count, stride=stride
            )
        except (ValueError, IndexError) as error:
            raise self._source.unreadable(f"its {MESHOPT} data is broken ({str(error)[:60]})", _REMEDY) from error

    def uri(self, uri: str, what: str) -> bytes | None:
        """Return the content of a data or file URI, or None with a finding if it is broken or unsafe."""
        if not uri.startswith("data:"):
            return self._source.sibling(uri, what)
        head, _, body = uri.partition(",")
        if not head.endswith(";base64"):
            self._source.add_finding(f"{what} is a data URI that is not base64; carried on without it")
            return None
        try:
            return base64.b64decode(body, validate=True)
        except (binascii.Error, ValueError):
            self._source.add_finding(f"{what} is a broken data URI; carried on without it")
            return None

    def _buffer(self, index: int) -> Buffer:
        if index not in self._buffers:
            entry = self._tree["buffers"][index]
            uri = entry.get("uri")
            data: Buffer | None = self._binary if uri is None and index == 0 else self.uri(str(uri), "buffer")
            if data is None:
                raise self._source.unreadable(
                    f"buffer {str(uri)[:80]!r} cannot be read",
                    "put the .bin beside the .gltf, or pack both as one .glb",
                )
            declared = self._count(entry.get("byteLength"))
            if declared > len(data):
                raise self._source.unreadable(
                    f"truncated: buffer {index} declares {declared} bytes but has {len(data)}", _REMEDY
                )
            self._buffers[index] = data
        return self._buffers[index]

    def _read(self, accessor: dict[str, Any]) -> np.ndarray:
        count = self._count(accessor.get("count"))
        self._source.check_vertices(count)
        kind, columns = _DTYPES.get(accessor.get("componentType", 0)), _COLUMNS.get(accessor.get("type", ""))
        if kind is None or columns is None:
            raise self._source.unreadable("an accessor has an unknown type", "export it again as glTF 2.0")
        # accessors may share a view, or have none, so that they can request more than the file holds
        self._values += count * columns
        limit = _VALUES_PER_VERTEX * self._source.limits.max_vertices
        if self._values > limit:
            raise self._source.too_large(f"its accessors need more than {limit} numbers")
        dtype = np.dtype(kind).newbyteorder("<")
        if "bufferView" in accessor:
            values = self._strided(accessor["bufferView"], accessor.get("byteOffset", 0), count, columns, dtype)
        else:
            values = np.zeros((count, columns), dtype=dtype)
        if "sparse" in accessor:
            values = self._apply_sparse(values, accessor["sparse"], columns, dtype)
        return _normalized(values, accessor)

    def _strided(self, view_index: Any, offset: Any, count: int, columns: int, dtype: np.dtype) -> np.ndarray:
        data = self.view(view_index)
        row = columns * dtype.itemsize
        stride = self._count(self._tree["bufferViews"][view_index].get("byteStride", row))
        start = self._count(offset)
        if stride < row or (count and start + stride * (count - 1) + row > len(data)):
            raise self._source.unreadable(f"an accessor of {count} elements does not fit its buffer view", _REMEDY)
        strided = np.ndarray(
            (count, columns), dtype, buffer=data, offset=start if count else 0, strides=(stride, dtype.itemsize)
        )
        return np.ascontiguousarray(strided)

    def _apply_sparse(self, values: np.ndarray, sparse: dict[str, Any], columns: int, dtype: np.dtype) -> np.ndarray:
        count = self._count(sparse.get("count"))
        places, news = sparse.get("indices", {}), sparse.get("values", {})
        kind = np.dtype(_DTYPES.get(places.get("componentType", 0), np.uint32))
        if kind.kind != "u":
            raise self._source.unreadable("a sparse accessor has indices of the wrong type", _REMEDY)
        index_type = kind.newbyteorder("<")
        where = self._strided(places.get("bufferView"), places.get("byteOffset", 0), count, 1, index_type)[:, 0]
        if count and int(where.max()) >= len(values):
            raise self._source.unreadable("a sparse accessor points outside its array", _REMEDY)
        values = values.copy()
        values[where] = self._strided(news.get("bufferView"), news.get("byteOffset", 0), count, columns, dtype)
        return values

    def _checked(self, index: Any, table: str) -> int:
        if isinstance(index, bool) or not isinstance(index, int) or not 0 <= index < len(self._tree.get(table, [])):
            raise self._source.unreadable(f"index {str(index)[:40]} is not among its {table}", _REMEDY)
        return index

    def _count(self, value: Any) -> int:
        if isinstance(value, bool) or not isinstance(value, int) or value < 0:
            raise self._source.unreadable(f"a size in it is {str(value)[:40]}, not a count", _REMEDY)
        return value


def _normalized(values: np.ndarray, accessor: dict[str, Any]) -> np.ndarray:
    if accessor.get("normalized") and values.dtype.kind in "iu":
        # section 3.6.2.2: signed values map to max(c / limit, -1)
        return np.maximum(values.astype(np.float32) / np.iinfo(values.dtype.str).max, -1.0)
    return values
