"""Parse the lengths stated in a sentence: '9 cm tall', 'three-inch', '1 ft 2 in', '1/2 inch'."""

from __future__ import annotations

import re
from collections.abc import Sequence
from fractions import Fraction

_UNITS_M = {
    r"millimet(?:re|er)s?": 1e-3, "mm": 1e-3, r"centimet(?:re|er)s?": 1e-2, "cm": 1e-2, r"decimet(?:re|er)s?": 1e-1,
    "dm": 1e-1, r"kilomet(?:re|er)s?": 1e3, "km": 1e3, r"met(?:re|er)s?": 1.0, "m": 1.0,
    r"micromet(?:re|er)s?|microns?|[µμ]m": 1e-6, "inch(?:es)?": 0.0254, "in": 0.0254, "foot|feet|ft": 0.3048,
    "yards?|yds?": 0.9144,
}  # fmt: skip
INCHES = frozenset({"inch", "inches", "in"})
_UNIT = "|".join(_UNITS_M)
_DIGITS = r"(?:\d+(?:\.\d+)?|\.\d+)"
_NUMBER = rf"(?<![\w.]){_DIGITS}"
_AMOUNT = rf"({_NUMBER}) ?({_UNIT})\b\.?"
_MEASURES = "height|width|length|diameter|depth"
LENGTH = re.compile(rf"{_AMOUNT} ?(?:in (?={_MEASURES}))?(\w{{0,12}})")
"""A length in the form of ``normalise_lengths``: number, unit, and the following word, which may be a direction."""
_OF_A_PART = re.compile(
    rf"(?:^| )(with|having|and)( an?) {_AMOUNT}( long)?((?: \w+){{0,3}}?) (\w+)"
    r"(?=$| ?[,;.]| (?:and|with|having|of|in|made|for)\b)"
)
"""'with a 20 cm blade', 'and a 9 cm long wooden handle'; the last word is the part."""
_PART_OF_LENGTH = re.compile(
    rf"(?<= )(with|having|and) (?:an? )?((?:[a-z]+ ){{0,2}}?(?!{_MEASURES}|size)[a-z]+) (?:(?:length )?of |length ){_AMOUNT}"
    r"(?: (?:long|across|in diameter|in length|diameter))?(?=$| ?[,;]| (?:and|with|having|made|for)\b)"
)
"""'with a red handle of 12 cm', 'and blade length 9 cm'."""
_NAMED_LENGTH = re.compile(rf"\b({_MEASURES})(?: of| ?[:=])? ({_AMOUNT})")
_AMOUNT_OR_NUMBER = rf"({_NUMBER})(?: ?({_UNIT})\b\.?)?"
_BY = re.compile(rf"{_AMOUNT_OR_NUMBER} x {_AMOUNT_OR_NUMBER}(?: x {_AMOUNT_OR_NUMBER})?(?: in (?:size|all))?")
"""'30 x 20 x 15 cm'; a number without a unit has that of the last one."""
_TIMES = re.compile(rf"(?<=\d) ?(?:({_UNIT})\.?)? ?(?:x|by|×|\*) ?(?=\.?\d)")
_LETTERS = r"\(?\b([lwhd]) ?[x×] ?([lwhd])(?: ?[x×] ?([lwhd]))?\b\)?"
_SIDES = rf"({_DIGITS}) ?[x×] ?({_DIGITS})(?: ?[x×] ?({_DIGITS}))? ?({_UNIT})\b"
_LETTERS_FIRST = re.compile(rf"{_LETTERS}[ :]*{_SIDES}")
_LETTERS_LAST = re.compile(rf"{_SIDES} ?{_LETTERS}")
"""'(LxWxH): 30x20x10 cm' and '30x20x10 cm (LxWxH)'."""
_ONE_LETTERED = re.compile(rf"\b([lwh])[ :.=]{{1,2}}(?={_DIGITS} ?(?:{_UNIT})\b)")
"""'h 30 cm', a single side."""
_WORD_OF = {"l": "length", "w": "width", "h": "height"}
_LETTERED_SIDE = rf"(?:\b([lwhd])[ :]?)?({_DIGITS}) ?({_UNIT})?\.? ?(?:\(?([lwhd])\b\)?)?"
_LETTERED = re.compile(rf"(?<![\w.]){_LETTERED_SIDE} ?[x×] ?{_LETTERED_SIDE}(?: ?[x×] ?{_LETTERED_SIDE})?(?!\w)")
"""'9 cm (H) x 8 cm (W)', 'L30 x W20 x H10 cm'."""
_RANGE = re.compile(rf"\d ?(?:-|–|—|\.{{2,3}}|(?:{_UNIT})?\.? ?(?:to|or|and)) ?{_AMOUNT}")
_IN_TWO_UNITS = re.compile(rf"{_AMOUNT} ?[/(=] ?{_AMOUNT}\)?")
ROUNDED = 0.04
"""Maximum relative difference of one amount in two units: 12 in is called 30 cm, 16 ft 5 m and 10 in 25 cm."""
DIRECTIONS = {
    "tall": "height", "high": "height", "height": "height", "wide": "width", "width": "width", "broad": "width",
    "diameter": "width", "across": "width", "long": "length", "length": "length", "deep": "depth", "thick": "height",
    "longest": "", "secondside": "second", "diagonal": "diagonal", "diagonally": "diagonal",
}  # fmt: skip
"""``second`` is the second longest side, as of a tray of 30 x 20 cm; ``secondside`` is its form in ``normalise_lengths``."""
_NUMERALS = {
    "one": 1, "two": 2, "three": 3, "four": 4, "five": 5, "six": 6, "seven": 7, "eight": 8, "nine": 9, "ten": 10,
    "eleven": 11, "twelve": 12,
}  # fmt: skip
_SPELT = re.compile(rf"\b({'|'.join(_NUMERALS)})(?= (?:{_UNIT.replace('|in|', '|').replace('|m|', '|')})\b)")
"""Number words before a unit, except 'in' and 'm': 'two in one' is no length."""
_SIGNS = {"½": "1/2", "¼": "1/4", "¾": "3/4", "⅓": "1/3", "⅔": "2/3", "⅛": "1/8", "⅜": "3/8", "⅝": "5/8", "⅞": "7/8"}
_OF_AMOUNTS = r"[mcd]?l|lit(?:re|er)s?|fl\b.*|oz|ounces?|pints?|pt|quarts?|qts?|gallons?|gals?|k?g|lbs?|pounds?"
_FRACTION = re.compile(rf"(?<![\w./])(?:(\d+) )?(\d{{1,3}})/(\d{{1,3}})(?= ?-?(?:{_UNIT}|{_OF_AMOUNTS})\b)")
_COUNT_IN_ONE = re.compile(r"\b(\d+) in (\d+)\b(?! ?/)")
"""'a 3 in 1 pen' is not three inches long."""
_FEET_AND_INCHES = re.compile(rf"({_NUMBER}) ?(?:foot|feet|ft)\.? (?:and )?({_NUMBER}) ?(?:inch(?:es)?|in)\b")


def lengths_in(text: str) -> dict[str, float]:
    """Return the lengths (m) of the whole object stated in a text, by direction; '' is the longest side."""
    return lengths_of_whole(normalise_lengths(text))


def lengths_of_whole(plain: str) -> dict[str, float]:
    """Return the lengths (m) of the whole object in a text in the form of ``normalise_lengths``, by direction."""
    found = LENGTH.findall(without_lengths_of_parts(plain))
    return {DIRECTIONS.get(direction, ""): float(number) * _metres(unit) for number, unit, direction in found}


def lengths_of_parts(plain: str) -> dict[str, float]:
    """Return the lengths (m) of parts in a text in the form of ``normalise_lengths``, by the part's word."""
    return {m[7]: float(m[3]) * _metres(m[4]) for m in _OF_A_PART.finditer(plain) if m[7] not in DIRECTIONS}


def without_lengths_of_parts(plain: str) -> str:
    """Return a text in the form of ``normalise_lengths`` without the lengths of parts: 'with a blade'."""
    return _OF_A_PART.sub(lambda m: m[0] if m[7] in DIRECTIONS else f" {m[1]}{m[2]}{m[6]} {m[7]}", plain)


def has_several_lengths(plain: str) -> bool:
    """Return whether a text in the form of ``normalise_lengths`` states several lengths of one direction, or a range."""
    plain = without_lengths_of_parts(plain)
    return len(LENGTH.findall(plain)) > len(lengths_of_whole(plain)) or _RANGE.search(plain) is not None


def normalise_lengths(text: str) -> str:
    """Return a text in lower case with each length as number, unit and direction: '14 inches long'.

    Decimal commas become points, inch and foot marks become words, number words and fractions become figures. Feet with inches,
    and a length stated in two units ('12 in / 30 cm'), become one length.
    """
    plain = re.sub(r"(?<=\d),(?=\d{3}\b)", "", text.lower())
    plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    for sign, fraction in _SIGNS.items():
        plain = plain.replace(sign, f" {fraction}")
    plain = re.sub(r"(?<=\d) ?(?:\"|″|'')", " inches ", plain)
    plain = re.sub(r"(?<=\d) ?(?:'|′)(?![a-z])", " ft ", plain)  # but not "the 70's"
    plain = re.sub(r"(?<=\d)-(?=\d+/\d)", " ", plain)
    plain = _FRACTION.sub(_fraction_to_decimal, plain)
    plain = re.sub(r"[ø⌀]|\bdiam?\b\.?", " diameter ", plain)
    plain = re.sub(r" [-–—] (?!\.?\d)|(?<!\d) [-–—] ", " , ", plain)
    plain = _LETTERS_FIRST.sub(lambda m: _with_letters(m.groups()[3:], m.groups()[:3]) or m[0], plain)
    plain = _LETTERS_LAST.sub(lambda m: _with_letters(m.groups()[:4], m.groups()[4:]) or m[0], plain)
    plain = _LETTERED.sub(_by_letter, plain)
    plain = _ONE_LETTERED.sub(lambda m: f"{_WORD_OF[m[1]]} ", plain)
    plain = re.sub(r"(?<=\d) ?(?:-|–|—|\.{2,3}) ?(?=\.?\d)", "–", plain)
    plain = _TIMES.sub(lambda m: f" {m[1] or ''} x ", " ".join(plain.replace(",", " , ").replace("-", " ").split()))
    plain = " ".join(plain.split())
    plain = _SPELT.sub(lambda m: str(_NUMERALS[m[1]]), plain)
    plain = _COUNT_IN_ONE.sub(r"\1in\2", plain)
    plain = _FEET_AND_INCHES.sub(lambda m: f"{12 * float(m[1]) + float(m[2]):g} inches", plain)
    plain = _IN_TWO_UNITS.sub(_merge_equal_lengths, plain)
    plain = _BY.sub(_by_direction, plain)
    plain = _PART_OF_LENGTH.sub(lambda m: f"{m[1]} a {m[3]} {m[4]} {m[2]}", plain)
    return _NAMED_LENGTH.sub(lambda m: f"{m[2]} {m[1]}", plain)


def _with_letters(sides: Sequence[str | None], letters: Sequence[str | None]) -> str:
    """Return numbers and unit with each number's letter before it: 'l30 x w20 x h10 cm'; '' if their counts differ."""
    *numbers, unit = sides
    if letters.count(None) != numbers.count(None):
        return ""
    pairs = zip(letters, numbers, strict=True)
    return " x ".join(f"{letter}{number}" for letter, number in pairs if letter) + f" {unit}"


def _by_letter(found: re.Match[str]) -> str:
    """Return sides marked by letters with direction words; unchanged if a letter is missing or repeated.

    D means the diameter if neither width nor length is given, else the depth.
    """
    sides = [found.groups()[at : at + 4] for at in (0, 4, 8) if found.groups()[at + 1]]
    letters = [before or behind for before, _, _, behind in sides]
    units = [unit for _, _, unit, _ in sides]
    if None in letters or len({*letters}) < len(letters) or units[-1] is None:
        return found[0]
    ways = {"l": "long", "w": "wide", "h": "tall", "d": "deep" if {"l", "w"} & {*letters} else "across"}
    said = zip(sides, units, letters, strict=True)
    return " ".join(f"{side[1]} {unit or units[-1]} {ways[letter]}" for side, unit, letter in said if letter)


def _merge_equal_lengths(found: re.Match[str]) -> str:
    """Return the first of two lengths that are equal up to rounding in different units; both otherwise."""
    first, second = (float(found[at]) * _metres(found[at + 1]) for at in (1, 3))
    same = found[2] != found[4] and abs(first - second) <= ROUNDED * max(first, second)
    return f"{found[1]} {found[2]}" if same else found[0]


def _by_direction(found: re.Match[str]) -> str:
    """Return three numbers as length, width and height, two as longest and second side; unchanged without a unit."""
    numbers, units = found.groups()[::2], found.groups()[1::2]
    *_, last = (unit for number, unit in zip(numbers, units, strict=True) if number)
    if last is None:
        return found[0]
    amounts = [(number, unit or last) for number, unit in zip(numbers, units, strict=True) if number]
    if len(amounts) == 3:
        return " ".join(f"{n} {u} {way}" for (n, u), way in zip(amounts, ("long", "wide", "tall"), strict=True))
    amounts.sort(key=lambda amount: float(amount[0]) * _metres(amount[1]), reverse=True)
    return " ".join(f"{n} {u} {way}" for (n, u), way in zip(amounts, ("longest", "secondside"), strict=True))


def _fraction_to_decimal(found: re.Match[str]) -> str:
    whole, above, below = (int(part or 0) for part in found.groups())
    return found[0] if below == 0 else f"{float(whole + Fraction(above, below)):g}"


def _metres(unit: str) -> float:
    return next(metres for spelt, metres in _UNITS_M.items() if re.fullmatch(spelt, unit))
