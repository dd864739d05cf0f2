"""Matting networks of a few weights, written as ONNX (onnx.proto3) byte by byte: 1x1 convolution, then the logistic function."""

from __future__ import annotations

import struct
from collections.abc import Sequence


def _number(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def field(number: int, content: bytes | str | int) -> bytes:
    """Return a field of a message: text and messages with their length, numbers as varints."""
    if isinstance(content, int):
        return _number(number << 3) + _number(content)
    data = content.encode() if isinstance(content, str) else content
    return _number(number << 3 | 2) + _number(len(data)) + data


def tensor_info(name: str, shape: Sequence[int]) -> bytes:
    """Return the description of an input or output of 32-bit floats."""
    sizes = b"".join(field(1, field(1, size)) for size in shape)
    return field(1, name) + field(2, field(1, field(1, 1) + field(2, sizes)))


def _weights(name: str, shape: Sequence[int], values: Sequence[float], *, outside: bool) -> bytes:
    sizes = b"".join(field(1, size) for size in shape)
    data = field(14, 1) if outside else field(9, struct.pack(f"<{len(values)}f", *values))
    return sizes + field(2, 1) + field(8, name) + data


def _node(kind: str, inputs: Sequence[str], output: str) -> bytes:
    return b"".join(field(1, name) for name in inputs) + field(2, output) + field(3, output) + field(4, kind)


def tiny_network(
    side_px: int = 64,
    *,
    weights: Sequence[float] = (6.0, -3.0, -3.0),
    logistic: bool = True,
    outside: bool = False,
    loop: bool = False,
) -> bytes:
    """Return a network that calls red things objects; its nodes stand in the wrong order, as some converters write them.

    ``outside``: its weights are said to be in another file; ``loop``: its nodes wait for each other.
    """
    nodes = [
        _node("Sigmoid", ["raw"], "mask"),
        _node("Sigmoid", ["raw"], "unused"),
        _node("Conv", ["mask" if loop else "picture", "w", "b"], "raw"),
    ]
    output = "mask" if logistic else "raw"
    graph = b"".join(field(1, node) for node in nodes)
    graph += field(2, "tiny")
    graph += field(5, _weights("w", (1, 3, 1, 1), weights, outside=outside)) + field(
        5, _weights("b", (1,), (0.0,), outside=False)
    )
    graph += field(11, tensor_info("picture", (1, 3, side_px, side_px)))
    graph += field(12, tensor_info(output, (1, 1, side_px, side_px)))
    graph += field(12, tensor_info("unused", (1, 1, side_px, side_px)))
    return field(1, 8) + field(8, field(1, "") + field(2, 13)) + field(7, graph)
