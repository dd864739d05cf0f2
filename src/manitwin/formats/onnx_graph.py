"""Writer of ONNX networks in memory: the protocol buffer messages that a graph with weights needs.

Field numbers are those of onnx.proto (IR version 8): https://github.com/onnx/onnx/blob/main/onnx/onnx.proto
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

IR_VERSION, OPSET = 8, 13
_FLOAT, _INT64 = 1, 7  # TensorProto.DataType
_ATTRIBUTE_FLOAT, _ATTRIBUTE_INT, _ATTRIBUTE_STRING, _ATTRIBUTE_INTS = 1, 2, 3, 7  # AttributeProto.AttributeType
Attribute = float | int | str | list[int]


@dataclass
class OnnxGraph:
    """A graph of named values: nodes in order of execution, and their weights.

    ``input_shape`` is the shape of the only input, ``input_name``, of 32-bit floats or, with ``whole``, of 64-bit integers.
    """

    input_shape: tuple[int, ...]
    input_name: str = "input"
    whole: bool = False
    _nodes: list[bytes] = field(default_factory=list)
    _weights: list[bytes] = field(default_factory=list)

    def weight(self, name: str, value: np.ndarray) -> str:
        """Add a weight as float32, or as int64 if it has an integer type; return its name."""
        whole = np.issubdtype(value.dtype, np.integer)
        raw = np.ascontiguousarray(value, "<i8" if whole else "<f4").tobytes()
        dims = b"".join(_number(1, side) for side in value.shape)
        self._weights.append(dims + _number(2, _INT64 if whole else _FLOAT) + _text(8, name) + _bytes(9, raw))
        return name

    def node(self, operator: str, inputs: list[str], output: str, **attributes: Attribute) -> str:
        """Add a node with one output; return the name of the output."""
        names = b"".join(_text(1, name) for name in inputs) + _text(2, output)
        said = b"".join(_bytes(5, _attribute(name, value)) for name, value in attributes.items())
        self._nodes.append(names + _text(3, output) + _text(4, operator) + said)
        return output

    def to_bytes(self, output: str, shape: tuple[int, ...]) -> bytes:
        """Return the model with the given value, of this shape, as its only output."""
        graph = b"".join(_bytes(1, node) for node in self._nodes) + _text(2, "graph")
        graph += b"".join(_bytes(5, weight) for weight in self._weights)
        graph += _bytes(11, _value(self.input_name, self.input_shape, _INT64 if self.whole else _FLOAT)) + _bytes(
            12, _value(output, shape)
        )
        return _number(1, IR_VERSION) + _bytes(7, graph) + _bytes(8, _number(2, OPSET))


def _value(name: str, shape: tuple[int, ...], element: int = _FLOAT) -> bytes:
    sides = b"".join(_bytes(1, _number(1, side)) for side in shape)
    return _text(1, name) + _bytes(2, _bytes(1, _number(1, element) + _bytes(2, sides)))


def _attribute(name: str, value: Attribute) -> bytes:
    if isinstance(value, list):
        return _text(1, name) + b"".join(_number(8, number) for number in value) + _number(20, _ATTRIBUTE_INTS)
    if isinstance(value, str):
        return _text(1, name) + _text(4, value) + _number(20, _ATTRIBUTE_STRING)
    if isinstance(value, float):
        return _text(1, name) + _key(2, 5) + np.float32(value).tobytes() + _number(20, _ATTRIBUTE_FLOAT)
    return _text(1, name) + _number(3, value) + _number(20, _ATTRIBUTE_INT)


def _varint(value: int) -> bytes:
    content = bytearray()
    value &= (1 << 64) - 1  # a negative number is written as two's complement
    while value > 0x7F:
        content.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes([*content, value])


def _key(number: int, wire: int) -> bytes:
    return _varint(number << 3 | wire)


def _number(number: int, value: int) -> bytes:
    return _key(number, 0) + _varint(value)


def _bytes(number: int, content: bytes) -> bytes:
    return _key(number, 2) + _varint(len(content)) + content


def _text(number: int, text: str) -> bytes:
    return _bytes(number, text.encode())
