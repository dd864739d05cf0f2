"""The size of an input as a person states it: a row's before what holds for all, and nothing that is said twice."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line

COLUMN = "longest_side_m"
MEANT = frozenset(
    f"{word}{unit}" for word in ("size", "length", "longest", "longest_side", "height", "width") for unit in ("", "_m")
)
"""Columns that people give for it."""
LEAST_M, MOST_M = 1e-6, 1e6
"""Of a stated length: numbers beyond are no lengths of things, and a mesh scaled to them has no numbers any more."""
_NO_UNIT = ("auto", "none")
_SHOWN_CHARACTERS = 60


def with_defaults(said: Mapping[str, str], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Return what a row says on top of what holds for all; of unit and longest side the row's counts alone where it has one."""
    row = dict(said)
    if COLUMN in said and "units" not in said:
        row["units"] = "auto"
    elif said.get("units", "auto") not in _NO_UNIT and COLUMN not in said:
        row[COLUMN] = ""
    return {**defaults, **row}


def stated_size_m(values: Mapping[str, Any], where: str) -> float | None:
    """Return the longest side (m) that is said of a file, None where none is.

    Raises UsageError for what is no length, and where the input says its size by itself: a text, or a mesh by its unit.
    """
    said = values[COLUMN]
    if said is None or said == "":
        return None
    try:
        length_m = float(said)
    except ValueError:
        length_m = math.nan
    if not LEAST_M <= length_m <= MOST_M:
        shown = printable_line(str(said), max_characters=_SHOWN_CHARACTERS)
        raise UsageError(f"{where}: {COLUMN} is {shown}; give metres, more than 0, such as 0.12")
    if values.get("text") is not None:
        raise UsageError(
            f"{where}: {COLUMN}: a text states the size in its words, such as 'a mug, 9 cm tall'; move the size"
            f" into the text"
        )
    if values["units"] not in _NO_UNIT:
        raise UsageError(
            f"{where}: {COLUMN}: the unit {values['units']} already determines the size of the mesh; give only one"
            f" of them"
        )
    return length_m
