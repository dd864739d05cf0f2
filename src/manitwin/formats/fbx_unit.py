"""Length unit of an FBX file."""

from __future__ import annotations

import math
import re
import struct

_CENTIMETRE_M = 0.01
_KEY = b"UnitScaleFactor"
_BINARY_KEY = b"S" + len(_KEY).to_bytes(4, "little") + _KEY
_TEXT_VALUE = re.compile(rb'"UnitScaleFactor"(?:\s*,\s*"[^"\n]*"){0,3}\s*,\s*([-+.0-9eE]+)')
_MOST_WORDS, _LENGTH_BYTES = 3, 4
_NUMBERS = {b"D": "<d", b"F": "<f", b"I": "<i", b"L": "<q"}


def fbx_unit_m(data: bytes) -> float:
    """Return the length in metres of one unit of an FBX file: its UnitScaleFactor, which is in centimetres.

    The default, also for invalid values, is one centimetre, as in other readers.
    """
    said = _binary(data)
    if said is None:
        text = _TEXT_VALUE.search(data)
        said = _number(text[1]) if text is not None else None
    return _CENTIMETRE_M * (said if said is not None and math.isfinite(said) and said > 0 else 1.0)


def _binary(data: bytes) -> float | None:
    """Return the number after the property's name and its words (type, label, flags); None if there is none."""
    at = data.find(_BINARY_KEY)
    if at < 0:
        return None
    at += len(_BINARY_KEY)
    for _ in range(_MOST_WORDS):
        if data[at : at + 1] != b"S":
            break
        at += 1 + _LENGTH_BYTES + int.from_bytes(data[at + 1 : at + 1 + _LENGTH_BYTES], "little")
    form = _NUMBERS.get(data[at : at + 1])
    if form is None or at + 1 + struct.calcsize(form) > len(data):
        return None
    return float(struct.unpack_from(form, data, at + 1)[0])


def _number(digits: bytes) -> float | None:
    try:
        return float(digits)
    except ValueError:
        return None
