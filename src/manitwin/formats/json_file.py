"""Parser of untrusted JSON with bounded size and depth and only finite numbers; all JSON from outside is read here."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.errors import AssetError
from manitwin.formats.bounded_file import Refusal, decode_text, read_bytes, with_remedy
from manitwin.formats.printable import printable_line
from manitwin.formats.xml_file import MAX_NUMBER

MAX_JSON_BYTES = 64 << 20
MEND = "mend it"
MAX_JSON_VALUES = 5_000_000  # a value takes up to 250 bytes of memory for three bytes of text
_CAUSE_CHARACTERS = 120


def parse_json(
    content: bytes | str, name: str, refuse: Refusal, *, remedy: str = MEND, file_names: bool = False
) -> Any:
    """Return the value of a JSON text (RFC 8259) with finite numbers; ``remedy`` ends the error messages.

    ``file_names``: texts may name files with bytes that are not UTF-8, in Python's encoding (PEP 383).

    Raises the error that ``refuse`` makes of a line starting with ``name``: broken or not UTF-8, nested too deep, NaN,
    Infinity, numbers with more digits than Python converts or larger than a double, and more than ``MAX_JSON_VALUES`` values.
    """
    called = printable_line(name, max_characters=_CAUSE_CHARACTERS)
    text = decode_text(content, name, refuse) if isinstance(content, bytes) else content
    # each value but the first follows one of these; those inside strings count too
    if sum(text.count(mark) for mark in ",[{") > MAX_JSON_VALUES:
        raise refuse(f"{called}: its JSON has more than {MAX_JSON_VALUES} values; simplify it")
    try:
        value = json.loads(text, parse_float=_finite, parse_constant=_finite)
        if not file_names and (
            "\\ud" in text or "\\uD" in text
        ):  # an unpaired surrogate is no text that could be written again
            json.dumps(value, ensure_ascii=False).encode()
        return value
    except RecursionError as error:
        raise refuse(f"{called}: its JSON is nested too deeply; {remedy}") from error
    except ValueError as error:
        cause = printable_line(str(error).split(";")[0], max_characters=_CAUSE_CHARACTERS)
        raise refuse(f"{called}: its JSON is broken ({cause}); {remedy}") from error


def parse_json_object(
    content: bytes | str, name: str, refuse: Refusal, *, remedy: str = MEND, file_names: bool = False
) -> dict[str, Any]:
    """Return the object in a JSON text, like ``parse_json``; other values are refused."""
    value = parse_json(content, name, refuse, remedy=remedy, file_names=file_names)
    if not isinstance(value, dict):
        called = printable_line(name, max_characters=_CAUSE_CHARACTERS)
        raise refuse(f"{called}: contains a JSON {type(value).__name__}, not an object; {remedy}")
    return value


def read_json_object(
    path: Path,
    refuse: Refusal = AssetError,
    *,
    limit_bytes: int = MAX_JSON_BYTES,
    inside: Path | None = None,
    name: str | None = None,
    remedy: str = MEND,
) -> dict[str, Any]:
    """Read a regular file of at most ``limit_bytes`` with one JSON object; opened like ``bounded_file.open_regular``."""
    opened = refuse if remedy == MEND else with_remedy(refuse, remedy)
    content = read_bytes(path, limit_bytes, opened, inside=inside, name=name)
    return parse_json_object(content, path.name if name is None else name, refuse, remedy=remedy)


def _finite(text: str) -> float:
    value = float(text)
    if not math.isfinite(value):
        raise ValueError(f"{text[:40]} is not a finite number")
    return value


def json_number(value: Any, what: str) -> float:
    """Return a finite number; raises AssetError naming ``what`` it is."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise AssetError(f"{what}: {str(value)[:40]!r} is not a number")
    if abs(value) > MAX_NUMBER or not math.isfinite(value):  # an integer may exceed any double
        raise AssetError(f"{what}: {str(value)[:40]} is out of range for an object")
    return float(value)


def json_vector(value: Any, count: int, what: str) -> np.ndarray:
    """Return exactly ``count`` finite numbers ``(count,)``; raises AssetError naming ``what`` they are."""
    if not isinstance(value, list) or len(value) != count:
        raise AssetError(f"{what}: {str(value)[:40]!r} are not {count} numbers")
    return np.array([json_number(entry, what) for entry in value])


def json_object(value: Any, what: str) -> dict[str, Any]:
    """Return a JSON object, an empty one for None; raises AssetError naming ``what`` it is."""
    if value is None:
        return {}
    if not isinstance(value, dict):
        raise AssetError(f"{what}: {str(value)[:40]!r} is not a JSON object")
    return value
