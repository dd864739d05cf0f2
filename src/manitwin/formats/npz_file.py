"""Safe reader of .npz archives: no pickles, and a size limit whatever the entries claim."""

from __future__ import annotations

import io
import math
import tokenize
import zipfile
import zlib
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from manitwin.formats.bounded_file import Refusal, read_bytes
from manitwin.formats.printable import printable_line

_BROKEN = (
    zipfile.BadZipFile,
    zlib.error,
    EOFError,
    ValueError,
    KeyError,
    NotImplementedError,
    RuntimeError,
    OSError,
    SyntaxError,
    tokenize.TokenError,
)


def read_npz_array(path: Path, names: Sequence[str], limit_bytes: int, refuse: Refusal) -> np.ndarray:
    """Return the first existing array of ``names`` in an archive, of at most ``limit_bytes`` unpacked.

    Raises the error that ``refuse`` makes of a line for anything else.
    """
    content = read_bytes(path, limit_bytes, refuse, name=str(path))
    remedy = f"save it with numpy.savez({path.name!r}, {names[0]}=...)"
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            found = next((f"{name}.npy" for name in names if f"{name}.npy" in archive.namelist()), None)
            if found is None:
                there = printable_line(", ".join(archive.namelist()[:8]), max_characters=120)
                raise refuse(f"{path}: has no array {', '.join(names)} (but {there}); {remedy}")
            with archive.open(found) as stream:
                unpacked = stream.read(limit_bytes + 1)
        if len(unpacked) > limit_bytes:
            raise refuse(f"{path}: {found} is larger than {limit_bytes} bytes; give fewer points")
        return _array(unpacked)
    except _BROKEN as error:
        cause = printable_line(str(error).splitlines()[0] if str(error) else type(error).__name__, max_characters=120)
        raise refuse(f"{path}: is no .npz that can be read ({cause}); {remedy}") from error


def npz_arrays(content: bytes, limit_bytes: int) -> dict[str, np.ndarray]:
    """Return all arrays of an archive by name, of at most ``limit_bytes`` unpacked in total; else raises ValueError."""
    found, left_bytes = {}, limit_bytes
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            for name in archive.namelist():
                with archive.open(name) as stream:
                    unpacked = stream.read(left_bytes + 1)
                left_bytes -= len(unpacked)
                if left_bytes < 0:
                    raise ValueError(f"more than {limit_bytes} bytes")
                found[name.removesuffix(".npy")] = _array(unpacked)
    except _BROKEN as error:
        raise ValueError(f"no .npz that can be read: {error}") from error
    return found


def _array(content: bytes) -> np.ndarray:
    """Return the array of a .npy's content, whose header must match its size; raises ValueError."""
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version != (1, 0):
        raise ValueError(f"version {version} of its header")
    shape, in_columns, dtype = np.lib.format.read_array_header_1_0(stream)
    if dtype.hasobject or dtype.fields is not None or dtype.itemsize == 0:
        raise ValueError("its values are no plain numbers")
    body = content[stream.tell() :]
    if math.prod(shape) * dtype.itemsize != len(body):
        raise ValueError(f"its header says {shape}, its body has {len(body)} bytes")
    return np.frombuffer(body, dtype).reshape(shape, order="F" if in_columns else "C")
