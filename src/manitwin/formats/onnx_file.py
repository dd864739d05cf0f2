"""Reader of untrusted ONNX networks: size limits, input and output shapes, topological order of nodes.

ONNX is protocol buffers (onnx.proto3, the parts without operators). Only what decides whether a network can be run is parsed:
inputs, outputs and the names that connect the nodes of the graph; weights are skipped. The standard requires nodes in
topological order; some converters violate it, and readers such as OpenCV's then refuse the file.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

from manitwin.formats.bounded_file import Refusal
from manitwin.formats.printable import printable_line

MAX_ONNX_BYTES = 1 << 30
MAX_NODES = 50_000
MAX_FIELDS = 500_000
_MODEL_GRAPH, _GRAPH_NODE, _GRAPH_INITIALIZER, _GRAPH_INPUT, _GRAPH_OUTPUT = 7, 1, 5, 11, 12
_NODE_INPUT, _NODE_OUTPUT, _TENSOR_NAME, _TENSOR_EXTERNAL, _TENSOR_LOCATION = 1, 2, 8, 13, 14
_VARINT, _FIXED64, _BYTES, _FIXED32 = 0, 1, 2, 5
_MORE = "give a network exported whole to one ONNX file"


@dataclass(frozen=True)
class OnnxTensor:
    """An input or output: name, element type (1 float32, 10 float16), and shape with None for variable dimensions."""

    name: str
    element: int
    shape: tuple[int | None, ...]


@dataclass(frozen=True)
class OnnxFile:
    """A parsed network: ``content`` is the part needed for one output, nodes in topological order; ``inputs`` exclude weights."""

    content: bytes
    inputs: tuple[OnnxTensor, ...]
    outputs: tuple[OnnxTensor, ...]


class _Broken(Exception):
    pass


def parse_onnx(content: bytes, name: str, refuse: Refusal, *, output: str | None = None) -> OnnxFile:
    """Parse a network as far as needed; error messages start with ``name``.

    Of several outputs, the one called ``output`` is kept, or else the first.
    """
    called = printable_line(name, max_characters=200)
    try:
        return _parsed(memoryview(content), output)
    except (_Broken, UnicodeDecodeError) as error:
        cause = str(error) if isinstance(error, _Broken) else "a name that is no text"
        raise refuse(f"{called}: no ONNX network that can be read ({cause}); {_MORE}") from error


def _parsed(content: memoryview, wanted: str | None) -> OnnxFile:
    top = list(_fields(content))
    graphs = [(value, span) for number, kind, value, span in top if (number, kind) == (_MODEL_GRAPH, _BYTES)]
    if len(graphs) != 1:
        raise _Broken("it has no graph")
    graph, (begin, end) = graphs[0]
    nodes: list[tuple[list[str], list[str], memoryview]] = []
    others: list[memoryview] = []
    told: list[memoryview] = []
    weights: set[str] = set()
    tensors: dict[int, list[OnnxTensor]] = {_GRAPH_INPUT: [], _GRAPH_OUTPUT: []}
    for number, kind, value, span in _fields(graph):
        whole = graph[span[0] : span[1]]
        if number == _GRAPH_NODE and kind == _BYTES:
            nodes.append((_texts(value, _NODE_INPUT), _texts(value, _NODE_OUTPUT), whole))
            if len(nodes) > MAX_NODES:
                raise _Broken(f"more than {MAX_NODES} nodes")
            continue
        if number == _GRAPH_OUTPUT and kind == _BYTES:
            told.append(whole)
            tensors[_GRAPH_OUTPUT].append(_tensor(value))
            continue
        others.append(whole)
        if number == _GRAPH_INITIALIZER and kind == _BYTES:
            weights.add(_weight(value))
        elif number in tensors and kind == _BYTES:
            tensors[number].append(_tensor(value))
    if not nodes or not tensors[_GRAPH_OUTPUT]:
        raise _Broken("it has no nodes or no output")
    names = [tensor.name for tensor in tensors[_GRAPH_OUTPUT]]
    kept = names.index(wanted) if wanted in names else 0
    body = [*_sort_topologically(nodes, names[kept]), *others, told[kept]]
    head = _varint_bytes(_MODEL_GRAPH << 3 | _BYTES) + _varint_bytes(sum(len(part) for part in body))
    parts: list[Any] = [content[:begin], head, *body, content[end:]]
    inputs = tuple(tensor for tensor in tensors[_GRAPH_INPUT] if tensor.name not in weights)
    return OnnxFile(b"".join(parts), inputs, tuple(tensors[_GRAPH_OUTPUT]))


def _sort_topologically(nodes: list[tuple[list[str], list[str], memoryview]], output: str) -> list[memoryview]:
    """Return the nodes that ``output`` needs in topological order, otherwise keeping their order (Kahn 1962)."""
    maker = {name: index for index, (_, outputs, _) in enumerate(nodes) for name in outputs if name}
    waits = [
        {maker[name] for name in inputs if maker.get(name, index) != index}
        for index, (inputs, _, _) in enumerate(nodes)
    ]
    used, open_ = set[int](), [maker[output]] if output in maker else []
    while open_:
        index = open_.pop()
        if index not in used:
            used.add(index)
            open_ += waits[index]
    takers: dict[int, list[int]] = {}
    for index in used:
        for other in waits[index]:
            takers.setdefault(other, []).append(index)
    ready = [index for index, needed in enumerate(waits) if not needed and index in used]
    heapq.heapify(ready)
    ordered: list[memoryview] = []
    while ready:
        index = heapq.heappop(ready)
        ordered.append(nodes[index][2])
        for taker in takers.get(index, []):
            waits[taker].discard(index)
            if not waits[taker]:
                heapq.heappush(ready, taker)
    if not used or len(ordered) < len(used):
        raise _Broken("its nodes wait for each other, or none makes its output")
    return ordered


def _weight(tensor: memoryview) -> str:
    name = ""
    for number, kind, value, _ in _fields(tensor):
        if number == _TENSOR_NAME and kind == _BYTES:
            name = bytes(value).decode()
        if number == _TENSOR_EXTERNAL or (number == _TENSOR_LOCATION and value == 1):
            raise _Broken("its weights are in another file")
    return name


def _tensor(value: memoryview) -> OnnxTensor:
    """Parse a ValueInfoProto: name 1, type 2; TypeProto: tensor 1; its element 1, shape 2; dimensions 1, each a value 1."""
    name = (_texts(value, 1) or [""])[0]
    element = 0
    shape: list[int | None] = []
    for kind_of in _messages(value, 2):
        for tensor in _messages(kind_of, 1):
            for number, kind, part, _ in _fields(tensor):
                if number == 1 and kind == _VARINT:
                    element = part
                elif number == 2 and kind == _BYTES:
                    for dimension in _messages(part, 1):
                        sizes = [v for n, k, v, _ in _fields(dimension) if (n, k) == (1, _VARINT)]
                        shape.append(sizes[0] if sizes and 0 < sizes[0] < 1 << 31 else None)
    return OnnxTensor(name, int(element), tuple(shape))


def _messages(value: memoryview, wanted: int) -> list[memoryview]:
    return [part for number, kind, part, _ in _fields(value) if (number, kind) == (wanted, _BYTES)]


def _texts(value: memoryview, wanted: int) -> list[str]:
    return [bytes(part).decode() for part in _messages(value, wanted)]


def _fields(data: memoryview) -> Iterator[tuple[int, int, Any, tuple[int, int]]]:
    """Yield number, wire type, value (an integer for a varint, else bytes) and span of each field of a message."""
    at, end, count = 0, len(data), 0
    while at < end:
        begin = at
        key, at = _varint(data, at)
        kind = key & 7
        value: Any
        if kind == _VARINT:
            value, at = _varint(data, at)
        else:
            if kind == _BYTES:
                size, at = _varint(data, at)
            elif kind in (_FIXED64, _FIXED32):
                size = 8 if kind == _FIXED64 else 4
            else:
                raise _Broken(f"a field of kind {kind}")
            if size > end - at:
                raise _Broken("it ends too early")
            value, at = data[at : at + size], at + size
        count += 1
        if count > MAX_FIELDS:
            raise _Broken(f"more than {MAX_FIELDS} fields")
        yield key >> 3, kind, value, (begin, at)


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    value = 0
    for shift in range(0, 70, 7):
        if at >= len(data):
            raise _Broken("it ends too early")
        byte = data[at]
        at += 1
        value |= (byte & 127) << shift
        if not byte & 128:
            return value, at
    raise _Broken("a number without end")


def _varint_bytes(value: int) -> bytes:
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    out.append(value)
    return bytes(out)
