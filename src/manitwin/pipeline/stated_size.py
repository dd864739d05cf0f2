"""Stated sizes of inputs: a row's value takes precedence over the default, and contradictory statements are errors."""

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
"""Column names that are mistaken for it."""
LEAST_M, MOST_M = 1e-6, 1e6
"""Range of a stated length (m); a mesh scaled beyond it would overflow."""
_NO_UNIT = ("auto", "none")
_SHOWN_CHARACTERS = 60


def with_defaults(said: Mapping[str, str], defaults: Mapping[str, Any]) -> dict[str, Any]:
    """Merge a row's values with the defaults; a row with a unit or a longest side overrides both defaults."""
    row = dict(said)
    if COLUMN in said and "units" not in said:
        row["units"] = "auto"
    elif said.get("units", "auto") not in _NO_UNIT and COLUMN not in said:
        row[COLUMN] = ""
    return {**defaults, **row}


def stated_size_m(values: Mapping[str, Any], where: str) -> float | None:
    """Return the stated longest side (m) of a file; None if there is none.

    Raises UsageError for an invalid length, and if the input states its size itself: a text, or a mesh with a stated unit.
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
