"""Read the lengths that a sentence states: '9 cm tall', 'three-inch', '1 ft 2 in', '1/2 inch'."""

from __future__ import annotations

import re
from fractions import Fraction

_UNITS_M = {
    r"millimet(?:re|er)s?": 1e-3, "mm": 1e-3, r"centimet(?:re|er)s?": 1e-2, "cm": 1e-2, r"decimet(?:re|er)s?": 1e-1,
    "dm": 1e-1, r"kilomet(?:re|er)s?": 1e3, "km": 1e3, r"met(?:re|er)s?": 1.0, "m": 1.0,
    r"micromet(?:re|er)s?|microns?|[µμ]m": 1e-6, "inch(?:es)?": 0.0254, "in": 0.0254, "foot|feet|ft": 0.3048,
    "yards?|yds?": 0.9144,
}  # fmt: skip
_UNIT = "|".join(_UNITS_M)
_NUMBER = r"(?<![\w.])(?:\d+(?:\.\d+)?|\.\d+)"
_AMOUNT = rf"({_NUMBER}) ?({_UNIT})\b\.?"
_MEASURES = "height|width|length|diameter|depth"
LENGTH = re.compile(rf"{_AMOUNT} ?(?:in (?={_MEASURES}))?(\w{{0,12}})")
"""A length as ``in_figures`` writes it: number, unit, and the word behind it, which may be a direction."""
_NAMED_LENGTH = re.compile(rf"\b({_MEASURES})(?: of)? ({_AMOUNT})")
_BY = re.compile(rf"\d ?(?:x|by|×) ?[\d.]+ ?(?:{_UNIT})\b")
_RANGE = re.compile(rf"\d ?(?:-|–|—|\.{{2,3}}|(?:{_UNIT})?\.? ?(?:to|or|and)) ?{_AMOUNT}")
DIRECTIONS = {
    "tall": "height", "high": "height", "height": "height", "wide": "width", "width": "width", "broad": "width",
    "diameter": "width", "across": "width", "long": "length", "length": "length", "deep": "depth", "thick": "height",
}  # fmt: skip
_NUMERALS = {
    "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "eleven": 11, "twelve": 12,
}  # fmt: skip
_SPELT = re.compile(rf"\b({'|'.join(_NUMERALS)})(?= (?:{_UNIT.replace('|in|', '|').replace('|m|', '|')})\b)")
"""Numbers in words before a unit, but for 'in' and 'm': 'two in one' is no length."""
_SIGNS = {"½": "1/2", "¼": "1/4", "¾": "3/4", "⅓": "1/3", "⅔": "2/3", "⅛": "1/8", "⅜": "3/8", "⅝": "5/8", "⅞": "7/8"}
_FRACTION = re.compile(rf"(?<![\w./])(?:(\d+) )?(\d{{1,3}})/(\d{{1,3}})(?= ?-?(?:{_UNIT})\b)")
_FEET_AND_INCHES = re.compile(rf"({_NUMBER}) ?(?:foot|feet|ft)\.? (?:and )?({_NUMBER}) ?(?:inch(?:es)?|in)\b")


def lengths_in(text: str) -> dict[str, float]:
    """Return the lengths (m) that a text states by their direction, '' for the longest."""
    found = LENGTH.findall(in_figures(text))
    return {DIRECTIONS.get(direction, ""): float(number) * _metres(unit) for number, unit, direction in found}


def several_lengths(text: str) -> bool:
    """Tell whether a text states more than one length, or from which to which one is."""
    plain = in_figures(text)
    return len(LENGTH.findall(plain)) > 1 or any(each.search(plain) for each in (_BY, _RANGE))


def in_figures(text: str) -> str:
    """Return the words in lower case with each length as one number, its unit and then what it is of: '14 inches long'.

    A decimal comma is a point, marks of inches and feet are words, numbers and fractions are figures, feet and inches are one
    length.
    """
    plain = re.sub(r"(?<=\d),(?=\d{3}\b)", "", text.lower())
    plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    for sign, fraction in _SIGNS.items():
        plain = plain.replace(sign, f" {fraction}")
    plain = re.sub(r"(?<=\d) ?(?:\"|″|'')", " inches ", plain)
    plain = re.sub(r"(?<=\d) ?(?:'|′)(?![a-z])", " ft ", plain)  # the 70's are no feet
    plain = re.sub(r"(?<=\d)-(?=\d+/\d)", " ", plain)
    plain = _FRACTION.sub(_in_decimals, plain)
    plain = re.sub(r"(?<=\d) ?(?:-|–|—|\.{2,3}) ?(?=\.?\d)", "–", plain)
    plain = " ".join(plain.replace(",", " , ").replace("-", " ").split())
    plain = _SPELT.sub(lambda m: str(_NUMERALS[m[1]]), plain)
    plain = _FEET_AND_INCHES.sub(lambda m: f"{12 * float(m[1]) + float(m[2]):g} inches", plain)
    return _NAMED_LENGTH.sub(lambda m: f"{m[2]} {m[1]}", plain)


def _in_decimals(found: re.Match[str]) -> str:
    whole, above, below = (int(part or 0) for part in found.groups())
    return found[0] if below == 0 else f"{float(whole + Fraction(above, below)):g}"


def _metres(unit: str) -> float:
    return next(metres for spelt, metres in _UNITS_M.items() if re.fullmatch(spelt, unit))
