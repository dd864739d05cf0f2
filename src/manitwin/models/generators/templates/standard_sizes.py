"""Named standard sizes: paper A5, an envelope C5, an AAA battery, an M8 x 40 bolt, a toy brick of 2 x 4 studs."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from manitwin.errors import UsageError

_MM, _INCH = 1e-3, 0.0254
_SERIES_MM = {"a": (1189, 841), "b": (1414, 1000), "c": (1297, 917)}
"""ISO 216 (A, B) and ISO 269 (C): sheet number 0; each next one is half, rounded down to whole millimetres."""
_LEAST_SHEET = 8
_SHEETS_M = {
    "dl": (220 * _MM, 110 * _MM), "letter-size": (11 * _INCH, 8.5 * _INCH), "legal-size": (14 * _INCH, 8.5 * _INCH),
    "tabloid-size": (17 * _INCH, 11 * _INCH), "#9": (8.875 * _INCH, 3.875 * _INCH), "#10": (9.5 * _INCH, 4.125 * _INCH),
}  # fmt: skip
"""DL of ISO 269, the sheets of ANSI Y14.1 and of stationers, and the two commonest envelopes of the United States."""
_OF_SHEET_SIZE = frozenset({"notebook", "book", "envelope"})
"""Categories as large as their sheet; clipboards and folders are larger, by no standard."""
_CELLS_M = {
    "aaaa": (0.0425, 0.0083), "aaa": (0.0445, 0.0105), "aa": (0.0505, 0.0145), "c": (0.05, 0.0262), "d": (0.0615, 0.0342),
}  # fmt: skip
"""Maximum length and diameter of IEC 60086-2."""
_BOLTS_MM = {
    3: (5.5, 2.0), 4: (7.0, 2.8), 5: (8.0, 3.5), 6: (10.0, 4.0), 8: (13.0, 5.3), 10: (16.0, 6.4), 12: (18.0, 7.5),
    16: (24.0, 10.0), 20: (30.0, 12.5),
}  # fmt: skip
"""Width across flats and head height by thread diameter, ISO 4014 and 4017."""
_NUTS_MM = {
    3: (5.5, 2.4), 4: (7.0, 3.2), 5: (8.0, 4.7), 6: (10.0, 5.2), 8: (13.0, 6.8), 10: (16.0, 8.4), 12: (18.0, 10.8),
    16: (24.0, 14.8), 20: (30.0, 18.0),
}  # fmt: skip
"""Width across flats and height, ISO 4032."""
_WASHERS_MM = {
    3: (3.2, 7.0, 0.5), 4: (4.3, 9.0, 0.8), 5: (5.3, 10.0, 1.0), 6: (6.4, 12.0, 1.6), 8: (8.4, 16.0, 1.6),
    10: (10.5, 20.0, 2.0), 12: (13.0, 24.0, 2.5), 16: (17.0, 30.0, 3.0), 20: (21.0, 37.0, 3.0),
}  # fmt: skip
"""Bore, outer diameter and thickness, ISO 7089."""
STUD_PITCH_M, BRICK_HEIGHT_M, BRICK_GAP_M = 0.008, 0.0096, 0.0002
"""Common toy bricks: studs 8 mm apart, 9.6 mm high without studs, and 0.2 mm smaller than their grid cells."""
_BRICK_STUDS = "2x4"
"""The studs of the template."""
_CORNERS = float(1 / np.cos(np.pi / 6))
"""Width across corners of a hexagon relative to its width across flats."""
_THREAD = re.compile(r"m(\d+)(?:x(\d+(?:\.\d+)?))?")
_REWRITTEN = (
    (r"\b(?:us |ansi )?(letter|legal|tabloid) (?:sized?|format|paper)\b", r"\1-size"),
    (r"\b(legal|tabloid)\b(?!-)", r"\1-size"),
    (r"\b(?:us|ansi) (letter|legal|tabloid)\b", r"\1-size"),
    (r"\b(?:din |iso )?([abc]\d{1,2}|dl)(?: sized?| format)?\b", r"\1"),
    (r"# (\d+)\b", r"#\1"),
    (r"(?<![\w.])9 ?v(?:olts?)? (?:block )?(?=batter)", "9v "),
    (r"\b(?:size )?(aaaa|aaa|aa|c|d)(?: size| cell)? (?=batter)", r"\1 "),
    (r"(?<=battery )(?:size |type )?(aaaa|aaa|aa|c|d)(?: size| cell)?\b", r"\1"),
    (r"\b(m\d+) ?x (\d+(?:\.\d+)?)(?: ?mm\b)?(?! x)", r"\1x\2"),
    (r"(?<![\w.#])(\d[\d.]*) x (\d[\d.]*)(?: x (\d[\d.]*))?(?![\w.])", r"\1x\2x\3"),
    (r"(?<=\d)x(?= |$)", ""),
    (r"(?<=screwdriver )((?:ph|pz|sl|tx|t|h)\d+) x (\d+)(?: mm\b)?", r"\1 with a \2 mm shaft"),
)


@dataclass(frozen=True)
class StandardSize:
    """A named size ``code`` as measures of its template (metres and ratios), or lengths (m) by direction."""

    code: str
    measures: Mapping[str, float] = field(default_factory=dict)
    lengths_m: Mapping[str, float] = field(default_factory=dict)


def join_size_codes(plain: str) -> str:
    """Return a text in the form of ``normalise_lengths`` with each named size as one word: 'letter-size', 'm8x40', '2x4'."""
    for spelt, code in _REWRITTEN:
        plain = re.sub(spelt, code, plain)
    return plain


def is_size_code(word: str) -> bool:
    """Return whether a word in the form of ``join_size_codes`` is a named size and nothing else."""
    return word in _SHEETS_M or word in _CELLS_M


def standard_size(category: str, words: Sequence[str]) -> StandardSize | None:
    """Return the first named size that applies to a category, among words in the form of ``join_size_codes``, or None.

    Raises UsageError for a toy brick with other studs than the template's.
    """
    found = (_size(category, word) for word in words)
    return next((size for size in found if size is not None), None)


def _size(category: str, word: str) -> StandardSize | None:
    if category == "envelope" and word[0] == "a":
        return None  # US envelopes of these names are larger than the sheets
    if category in _OF_SHEET_SIZE and (sheet_m := _sheet_m(word)) is not None:
        return StandardSize(word, lengths_m={"": sheet_m[0], "second": sheet_m[1]})
    if category == "battery" and word in _CELLS_M:
        length_m, width_m = _CELLS_M[word]
        return StandardSize(word, {"length_m": length_m, "width": width_m / length_m})
    if category == "building block" and word == _BRICK_STUDS:
        length_m = 4 * STUD_PITCH_M - BRICK_GAP_M
        return StandardSize(word, {"length_m": length_m, "height": BRICK_HEIGHT_M / length_m})
    if category == "building block" and re.fullmatch(r"\d+x\d+", word):
        raise UsageError(
            f"there are building blocks of {_BRICK_STUDS} studs here, none of {word}; say {_BRICK_STUDS} or a length"
        )
    thread = _THREAD.fullmatch(word)
    return None if thread is None else _fastener(category, word, int(thread[1]), thread[2])


def _fastener(category: str, code: str, thread_mm: int, length_mm: str | None) -> StandardSize | None:
    """Return the measures of a bolt, nut or washer of a metric thread; a bolt without a stated length gets the usual one."""
    if category == "washer" and thread_mm in _WASHERS_MM:
        bore, width, thick = _WASHERS_MM[thread_mm]
        return StandardSize(code, {"width_m": width * _MM, "hole": bore / width, "thick": thick / width})
    if category == "nut" and thread_mm in _NUTS_MM:
        flats, high = _NUTS_MM[thread_mm]
        wide = flats * _CORNERS
        return StandardSize(code, {"width_m": wide * _MM, "height": high / wide, "hole": thread_mm / wide})
    if category == "bolt" and thread_mm in _BOLTS_MM:
        flats, high = _BOLTS_MM[thread_mm]
        wide, shank_mm = flats * _CORNERS, float(length_mm) if length_mm else USUAL_SHANKS * thread_mm
        length_m = (shank_mm + high) * _MM
        ratios = {"width": wide * _MM / length_m, "head": high / wide, "shank": thread_mm / wide}
        return StandardSize(code, {"length_m": length_m, **ratios})
    return None


USUAL_SHANKS = 5.0
"""Shank length of a bolt without a stated length, in thread diameters; ISO 4017 lists it for every thread."""


def _sheet_m(word: str) -> tuple[float, float] | None:
    """Return the long and short side of a named sheet or envelope; None if the name is unknown."""
    if word in _SHEETS_M:
        return _SHEETS_M[word]
    if not re.fullmatch(rf"[abc][0-{_LEAST_SHEET}]", word):
        return None
    long, short = _SERIES_MM[word[0]]
    for _ in range(int(word[1])):
        long, short = short, long // 2
    return long * _MM, short * _MM
