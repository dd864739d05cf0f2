"""Reader of PyTorch checkpoints from before version 1.6, without PyTorch: a pickle restricted to tensors, and raw storages.

Layout (torch/serialization.py, ``_legacy_save``): pickles of a magic number, the protocol version, the writer's sizes, the
object, and the keys of the storages; then each storage as a 64-bit count and its elements.
"""

from __future__ import annotations

import io
import math
import pickle
import struct
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from manitwin.formats.bounded_file import Refusal
from manitwin.formats.printable import printable_line

MAGIC = 0x1950A86A20F9469CFC6C
PROTOCOL = 1001
MOST_TENSORS = 4096
MOST_DIMENSIONS = 8
_DTYPES = {
    "FloatStorage": "<f4",
    "DoubleStorage": "<f8",
    "HalfStorage": "<f2",
    "LongStorage": "<i8",
    "IntStorage": "<i4",
}
_CAUSES = (pickle.UnpicklingError, EOFError, ValueError, TypeError, AttributeError, IndexError, KeyError, OverflowError)


@dataclass(frozen=True)
class _Storage:
    key: str
    dtype: str


@dataclass(frozen=True)
class _Tensor:
    storage: _Storage
    offset: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]


class _TensorUnpickler(pickle.Unpickler):
    """Unpickler that creates only numbers, strings, ordered dictionaries and descriptions of tensors, and calls nothing else."""

    def find_class(self, module: str, name: str) -> Any:
        if module == "torch" and name in _DTYPES:
            return _DTYPES[name]
        if (module, name) == ("torch._utils", "_rebuild_tensor_v2"):
            return _described
        if (module, name) == ("collections", "OrderedDict"):
            return OrderedDict
        raise pickle.UnpicklingError(f"it names {module}.{name}")

    def persistent_load(self, pid: Any) -> _Storage:
        kind, dtype, key, *_ = pid
        if kind != "storage" or dtype not in _DTYPES.values():
            raise pickle.UnpicklingError("it has a storage of an unknown kind")
        return _Storage(str(key), dtype)


def _described(storage: Any, offset: Any, shape: Any, strides: Any, *_: Any) -> _Tensor:
    whole = [offset, *shape, *strides]
    if not isinstance(storage, _Storage) or not all(type(number) is int and number >= 0 for number in whole):
        raise pickle.UnpicklingError("it has a tensor without a storage, or of no sizes")
    if len(shape) != len(strides) or len(shape) > MOST_DIMENSIONS:
        raise pickle.UnpicklingError("it has a tensor whose strides are not those of its shape")
    return _Tensor(storage, offset, tuple(shape), tuple(strides))


def parse_torch_checkpoint(content: bytes, name: str, refuse: Refusal) -> dict[str, np.ndarray]:
    """Return the tensors of a state dictionary by name, each a contiguous array with its own shape and type.

    Raises the error that ``refuse`` makes of a line starting with ``name``: for another format, a pickle that names anything
    but storages, tensors and ordered dictionaries, and a tensor that exceeds its storage.
    """
    called = printable_line(name)
    stream = io.BytesIO(content)
    try:
        if (_TensorUnpickler(stream).load(), _TensorUnpickler(stream).load()) != (MAGIC, PROTOCOL):
            raise ValueError("another magic number or protocol")
        _TensorUnpickler(stream).load()
        state, keys = _TensorUnpickler(stream).load(), _TensorUnpickler(stream).load()
        tensors = {str(key): value for key, value in state.items() if isinstance(value, _Tensor)}
        if not isinstance(keys, list) or not 0 < len(tensors) <= MOST_TENSORS:
            raise ValueError(f"it holds {len(tensors)} tensors")
        storages = _storages(stream, keys, {t.storage.key: t.storage.dtype for t in tensors.values()})
        return {key: _strided(storages[tensor.storage.key], tensor) for key, tensor in tensors.items()}
    except _CAUSES as error:
        cause = printable_line(str(error), max_characters=120) or type(error).__name__
        raise refuse(f"{called}: no PyTorch checkpoint of tensors ({cause}); install its package again") from error


def _storages(stream: io.BytesIO, keys: list[Any], dtypes: dict[str, str]) -> dict[str, np.ndarray]:
    storages = {}
    for key in map(str, keys):
        (count,) = struct.unpack("<q", _read_exactly(stream.read, 8))
        dtype = np.dtype(dtypes[key])
        if not 0 <= count <= len(stream.getbuffer()) // dtype.itemsize:
            raise ValueError(f"a storage of {count} elements")
        storages[key] = np.frombuffer(_read_exactly(stream.read, count * dtype.itemsize), dtype)
    return storages


def _read_exactly(read: Callable[[int], bytes], count: int) -> bytes:
    content = read(count)
    if len(content) != count:
        raise EOFError("it ends early")
    return content


def _strided(storage: np.ndarray, tensor: _Tensor) -> np.ndarray:
    """Return the elements of a tensor in axis order; transposed weights are stored in another order."""
    if 0 in tensor.shape:
        return np.zeros(tensor.shape, storage.dtype)
    last = tensor.offset + sum((side - 1) * stride for side, stride in zip(tensor.shape, tensor.strides, strict=True))
    if last >= len(storage) or math.prod(tensor.shape) > len(storage):
        raise ValueError("a tensor reaches beyond its storage")
    steps = [stride * storage.itemsize for stride in tensor.strides]
    view = np.lib.stride_tricks.as_strided(storage[tensor.offset :], tensor.shape, steps, writeable=False)
    return np.ascontiguousarray(view)
