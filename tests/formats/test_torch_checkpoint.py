"""Checkpoints written here, byte by byte as PyTorch's ``_legacy_save`` does, are read without it; hostile ones are refused."""

from __future__ import annotations

import io
import pickle
import struct
from collections import OrderedDict
from typing import Any

import numpy as np
import pytest

from manitwin.errors import Unavailable
from manitwin.formats.torch_checkpoint import MAGIC, PROTOCOL, parse_torch_checkpoint


class Named:
    """What a pickle calls by its name, with arguments."""

    def __init__(self, name: str, *arguments: Any):
        self.name, self.arguments = name, arguments


class Pickled(pickle._Pickler):  # type: ignore[name-defined]
    """Writes globals by their names, whether they are installed here or not."""

    def persistent_id(self, value: Any) -> Any:
        if isinstance(value, tuple) and value[:1] == ("storage",):
            return value
        return None

    def save(self, value: Any, save_persistent_id: bool = True) -> None:
        if isinstance(value, Named):
            module, name = value.name.rsplit(".", 1)
            self.write(pickle.GLOBAL + f"{module}\n{name}\n".encode())
            if value.arguments:
                super().save(tuple(value.arguments))
                self.write(pickle.REDUCE)
            return
        super().save(value, save_persistent_id)


def checkpoint(state: Any, storages: dict[str, np.ndarray]) -> bytes:
    stream = io.BytesIO()
    for value in (MAGIC, PROTOCOL, {"little_endian": True}, state, list(storages)):
        Pickled(stream, 2).dump(value)
    for elements in storages.values():
        stream.write(struct.pack("<q", len(elements)) + elements.tobytes())
    return stream.getvalue()


def tensor(key: str, offset: int, shape: tuple[int, ...], strides: tuple[int, ...], kind: str = "Float") -> Named:
    storage = ("storage", Named(f"torch.{kind}Storage"), key, "cpu", 24, None)
    return Named("torch._utils._rebuild_tensor_v2", storage, offset, shape, strides, False, OrderedDict())


def read(content: bytes) -> dict[str, np.ndarray]:
    return parse_torch_checkpoint(content, "net.pth", Unavailable)


def test_tensors_are_read_by_their_strides() -> None:
    numbers = np.arange(24, dtype=np.float32)
    state = {
        "whole": tensor("1", 0, (4, 6), (6, 1)),
        "turned": tensor("1", 2, (3, 4), (1, 6)),
        "n": tensor("2", 0, (), (), "Long"),
    }
    tensors = read(checkpoint(state, {"1": numbers, "2": np.array([7])}))
    assert np.array_equal(tensors["whole"], numbers.reshape(4, 6))
    assert np.array_equal(tensors["turned"], numbers.reshape(4, 6)[:, 2:5].T) and tensors["turned"].flags.c_contiguous
    assert tensors["n"].dtype == np.int64 and tensors["n"] == 7


@pytest.mark.parametrize("name", ["os.system", "builtins.eval", "torch._utils._rebuild_parameter"])
def test_a_pickle_that_names_anything_else_is_refused(name: str) -> None:
    with pytest.raises(Unavailable, match=rf"net.pth: .*it names {name}"):
        read(checkpoint({"w": Named(name, "true")}, {}))


@pytest.mark.parametrize(
    ("offset", "shape", "strides"), [(20, (6,), (1,)), (0, (2, 3), (24, 1)), (0, (1 << 40,), (0,)), (-1, (2,), (1,))]
)
def test_a_tensor_beyond_its_storage_is_refused(offset: int, shape: Any, strides: Any) -> None:
    with pytest.raises(Unavailable, match=r"net.pth: no PyTorch checkpoint"):
        read(checkpoint({"w": tensor("1", offset, shape, strides)}, {"1": np.zeros(24, np.float32)}))


def test_what_ends_early_or_is_something_else_is_refused() -> None:
    whole = checkpoint({"w": tensor("1", 0, (24,), (1,))}, {"1": np.zeros(24, np.float32)})
    for content in (whole[:-1], whole[:40], b"", b"PK\x03\x04", pickle.dumps({"w": 1})):
        with pytest.raises(Unavailable, match=r"net.pth: no PyTorch checkpoint"):
            read(content)
