"""Decompression of glTF buffer views compressed by meshoptimizer.

Source: EXT_meshopt_compression (Khronos, ratified), appendix A (bitstream) and B (filters).
"""

from __future__ import annotations

from typing import Any

import numpy as np

MESHOPT = "EXT_meshopt_compression"
_ATTRIBUTES, _TRIANGLES, _INDICES = 0xA0, 0xE1, 0xD1
"""The first byte of each mode's stream."""
_TAIL_BYTES = 32
_GROUP = 16
_TWO_BITS = tuple(bytes((each >> 6, each >> 4 & 3, each >> 2 & 3, each & 3)) for each in range(256))
_FOUR_BITS = tuple(bytes((each >> 4, each & 15)) for each in range(256))
_NO_INDEX = 0xFFFFFFFF


def decompress_view(data: bytes, *, mode: str, filter: str, count: int, stride: int) -> bytes:
    """Return the ``count`` elements of ``stride`` bytes in a compressed buffer view.

    Raises ValueError or IndexError for an invalid stream.
    """
    if mode == "ATTRIBUTES":
        if not 0 < stride <= 256 or stride % 4:
            raise ValueError(f"attributes of {stride} bytes")
        return _apply_filter(decode_attributes(data, count, stride), filter).tobytes()
    if mode not in ("TRIANGLES", "INDICES") or stride not in (2, 4) or filter != "NONE":
        raise ValueError(f"mode {mode[:20]!r}, filter {filter[:20]!r}, {stride} bytes")
    indices = decode_triangles(data, count) if mode == "TRIANGLES" else decode_indices(data, count)
    return indices.astype("<u2" if stride == 2 else "<u4").tobytes()


def decode_attributes(data: bytes, count: int, stride: int) -> np.ndarray:
    """Return the elements (count, stride) uint8 of a stream of mode 0: bytewise differences to the previous element."""
    if not data or data[0] != _ATTRIBUTES:
        raise ValueError("no stream of attributes")
    tail = max(_TAIL_BYTES, stride)
    if len(data) < 1 + tail:
        raise ValueError("a stream without its end")
    end = len(data) - tail
    most = min(8192 // stride & ~(_GROUP - 1), 256)
    last = np.frombuffer(data[-stride:], np.uint8)
    blocks, at = [], 1
    for first in range(0, count, most):
        size = min(most, count - first)
        groups = -(-size // _GROUP)
        deltas = np.empty((stride, groups * _GROUP), np.uint8)
        for byte in range(stride):
            row, at = _decode_groups(data, at, groups, end)
            deltas[byte] = np.frombuffer(row, np.uint8)
        signed = (deltas >> 1) ^ (0 - (deltas & 1))
        block = last + np.cumsum(signed.T[:size], axis=0, dtype=np.uint8)
        blocks.append(block)
        last = block[-1]
    return np.ascontiguousarray(np.concatenate(blocks)) if blocks else np.empty((0, stride), np.uint8)


def _decode_groups(data: bytes, at: int, groups: int, end: int) -> tuple[bytes, int]:
    """Return the zigzag deltas of one byte of a block's elements, and the position after them."""
    head = data[at : at + -(-groups // 4)]
    at += len(head)
    row = []
    for group in range(groups):
        bits = head[group >> 2] >> 2 * (group & 3) & 3
        if bits == 0:
            row.append(bytes(_GROUP))
        elif bits == 3:
            row.append(data[at : at + _GROUP])
            at += _GROUP
        else:
            packed, table, sentinel = (4, _TWO_BITS, 3) if bits == 1 else (8, _FOUR_BITS, 15)
            deltas = bytearray(b"".join([table[each] for each in data[at : at + packed]]))
            at += packed
            if deltas.count(sentinel):  # values that do not fit the bits follow as whole bytes
                for place, delta in enumerate(deltas):
                    if delta == sentinel:
                        deltas[place] = data[at]
                        at += 1
            row.append(bytes(deltas))
        if at > end:
            raise ValueError("a stream that ends early")
    return b"".join(row), at


def decode_triangles(data: bytes, count: int) -> np.ndarray:
    """Return the indices (count,) uint32 of a stream of mode 1: triangles coded by recent edges and vertices."""
    triangles, rest = divmod(count, 3)
    if not data or data[0] != _TRIANGLES or rest or len(data) < 1 + triangles + 16:
        raise ValueError("no stream of triangles")
    stream = _Indices(data, 1 + triangles)
    table = data[-16:]
    edges = [(_NO_INDEX, _NO_INDEX)] * 16
    vertices = [_NO_INDEX] * 16
    edge, vertex, following = 0, 0, 0  # the next position in each queue, and the next new index
    made: list[int] = []
    for code in data[1 : 1 + triangles]:
        high, low = code >> 4, code & 15
        if high < 15:
            a, b = edges[(edge - 1 - high) & 15]
            if low == 0:
                c, following = following, following + 1
            elif low < 13:
                c = vertices[(vertex - 1 - low) & 15]
            else:
                c = stream.adjacent(low == 14) if low < 15 else stream.index()
            is_new = low == 0 or low >= 13
            added = [(c, b), (a, c)]
            fresh = [c] if is_new else []
        else:
            z, w = 15, 15
            if low < 14:
                z, w = table[low] >> 4, table[low] & 15
                a, following = following, following + 1
            else:
                extra = stream.byte()
                z, w = extra >> 4, extra & 15
                if extra == 0:
                    following = 0
                if low == 14:
                    a, following = following, following + 1
                else:
                    a = stream.index()
            seen = []
            for nibble in (z, w):
                if nibble == 0:
                    seen.append(following)
                    following += 1
                else:
                    seen.append(vertices[(vertex - nibble) & 15] if nibble < 15 else stream.index())
            b, c = seen
            added = [(b, a), (c, b), (a, c)]
            fresh = [a, *(each for each, nibble in zip(seen, (z, w), strict=True) if nibble in (0, 15))]
        made += (a, b, c)
        for pair in added:
            edges[edge & 15] = pair
            edge += 1
        for each in fresh:
            vertices[vertex & 15] = each
            vertex += 1
    return np.array(made, np.int64).astype(np.uint32)


def decode_indices(data: bytes, count: int) -> np.ndarray:
    """Return the indices (count,) uint32 of a stream of mode 2: differences to one of two previous indices."""
    if not data or data[0] != _INDICES or len(data) < 1 + count + 4:
        raise ValueError("no stream of indices")
    stream = _Indices(data, 1)
    last, made = [0, 0], []
    for _ in range(count):
        value = stream.number()
        last[value & 1] = (last[value & 1] + _decode_zigzag(value >> 1)) & _NO_INDEX
        made.append(last[value & 1])
    return np.array(made, np.int64).astype(np.uint32)


class _Indices:
    """Reader of numbers outside the codes of a stream; raises IndexError at its end."""

    def __init__(self, data: bytes, at: int):
        self._data, self._at, self._last = data, at, 0

    def byte(self) -> int:
        value = self._data[self._at]
        self._at += 1
        return value

    def number(self) -> int:
        """Return the next number in base 128, low digits first (LEB128)."""
        value = shift = 0
        while True:
            byte = self.byte()
            value |= (byte & 127) << shift
            if byte < 128:
                return value & _NO_INDEX
            shift += 7
            if shift > 28:
                raise ValueError("a number of more than 32 bits")

    def index(self) -> int:
        """Return the next index, coded as difference to the last one of this reader."""
        self._last = (self._last + _decode_zigzag(self.number())) & _NO_INDEX
        return self._last

    def adjacent(self, is_next: bool) -> int:
        """Return the successor or predecessor of the last index of this reader."""
        self._last = (self._last + (1 if is_next else -1)) & _NO_INDEX
        return self._last


def _decode_zigzag(value: int) -> int:
    """Decode a zigzag integer to a signed one."""
    return value >> 1 if value & 1 == 0 else ~(value >> 1)


def _apply_filter(elements: np.ndarray, name: str) -> np.ndarray:
    """Apply a filter to elements (count, stride) uint8 (appendix B)."""
    stride = elements.shape[1]
    if name == "NONE":
        return elements
    if name == "OCTAHEDRAL" and stride in (4, 8):
        return _octahedral(elements.view("i1" if stride == 4 else "<i2"))
    if name == "QUATERNION" and stride == 8:
        return _quaternions(elements.view("<i2"))
    if name == "EXPONENTIAL":
        packed = elements.view("<i4")
        mantissa, exponent = (packed << 8) >> 8, packed >> 24
        with np.errstate(over="ignore"):
            return np.ldexp(mantissa.astype(np.float64), exponent).astype("<f4")
    raise ValueError(f"filter {name[:20]!r} of {stride} bytes")


def _octahedral(packed: np.ndarray) -> np.ndarray:
    one = np.maximum(packed[:, 2].astype(np.float64), 1)
    x, y = packed[:, 0] / one, packed[:, 1] / one
    z = 1 - np.abs(x) - np.abs(y)
    below = np.minimum(z, 0)
    vectors = np.column_stack([x - np.copysign(below, x), y - np.copysign(below, y), z])
    vectors /= np.maximum(np.linalg.norm(vectors, axis=1, keepdims=True), 1e-12)
    out = packed.copy()
    out[:, :3] = np.round(vectors * np.iinfo(packed.dtype).max)
    return out


def _quaternions(packed: np.ndarray) -> np.ndarray:
    one = (packed[:, 3] | 3).astype(np.float64)
    three = packed[:, :3] / one[:, None] / np.sqrt(2)
    largest = np.sqrt(np.maximum(1 - (three**2).sum(axis=1), 0))
    out = np.empty_like(packed)
    places = (packed[:, 3:] & 3) + np.arange(1, 5)
    values = np.round(np.column_stack([three, largest]) * 32767).clip(-32767, 32767)
    np.put_along_axis(out, places.astype(np.int64) % 4, values.astype(packed.dtype), axis=1)
    return out


def is_compressed(view: dict[str, Any]) -> bool:
    """Return whether a buffer view has meshoptimizer's extension."""
    extensions = view.get("extensions")
    return isinstance(extensions, dict) and isinstance(extensions.get(MESHOPT), dict)
