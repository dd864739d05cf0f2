"""One-dimensional arrays of 8-bit labels in NumPy's format; reading is safe for untrusted files."""

from __future__ import annotations

import io
import re

import numpy as np

from manitwin.formats.bounded_file import Refusal
from manitwin.formats.printable import printable_line

MAX_LABEL_BYTES = 64 << 20
_MAGIC = b"\x93NUMPY\x01\x00"
_HEADER = re.compile(rb"\{'descr': '\|u1', 'fortran_order': False, 'shape': \((\d{1,9}),\), \} *\n")
"""The only header that ``labels_to_npy`` writes (NumPy enhancement proposal 1, version 1.0)."""


def labels_to_npy(labels: np.ndarray) -> bytes:
    """Return labels ``(N,) uint8`` as the content of a .npy file, deterministically."""
    stream = io.BytesIO()
    np.lib.format.write_array(stream, np.ascontiguousarray(labels, dtype=np.uint8), version=(1, 0), allow_pickle=False)
    return stream.getvalue()


def parse_labels(content: bytes, name: str, refuse: Refusal, *, remedy: str) -> np.ndarray:
    """Return the labels ``(N,) uint8`` of a .npy file's content; raises the error that ``refuse`` makes of a line.

    Anything but one row of as many bytes as the header states is refused, and the header is never evaluated.
    """
    called = printable_line(name)
    length = int.from_bytes(content[len(_MAGIC) : len(_MAGIC) + 2], "little")
    start = len(_MAGIC) + 2
    header = _HEADER.fullmatch(content[start : start + length])
    if not content.startswith(_MAGIC) or header is None:
        raise refuse(f"{called}: no NumPy file of one row of 8-bit numbers; {remedy}")
    said, found = int(header[1]), len(content) - start - length
    if said != found:
        raise refuse(f"{called}: says {said} numbers and holds {found}; {remedy}")
    return np.frombuffer(content, np.uint8, offset=start + length)
