"""Parse the volume or mass stated in a sentence: '500 ml', 'half a litre', '12 oz', '2 kg'."""

from __future__ import annotations

import re
from dataclasses import dataclass

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.generators.templates.stated_lengths import ROUNDED

_VOLUMES_M3 = {
    r"millilit(?:re|er)s?|ml": 1e-6, r"centilit(?:re|er)s?|cl": 1e-5, r"decilit(?:re|er)s?|dl": 1e-4,
    r"lit(?:re|er)s?|l": 1e-3, r"fl(?:uid)?\.? ?(?:ounces?|oz)": 29.5735e-6, r"pints?|pt": 473.176e-6,
    r"(?:fl(?:uid)? )?drams?": 3.69669e-6,
    r"quarts?|qts?": 946.353e-6, r"gallons?|gals?": 3.785412e-3, r"cubic centimet(?:re|er)s?|ccm?|cm3|cm³": 1e-6,
    r"(?:uk|imperial|imp\.?|british) fl(?:uid)?\.? ?(?:ounces?|oz)": 28.4131e-6,
    r"(?:uk|imperial|imp\.?|british) (?:pints?|pt)": 568.261e-6,
    r"(?:uk|imperial|imp\.?|british) (?:quarts?|qts?)": 1136.523e-6,
    r"(?:uk|imperial|imp\.?|british) (?:gallons?|gals?)": 4.54609e-3,
}  # fmt: skip
"""US units unless stated otherwise; British units have the same names."""
_MASSES_KG = {
    r"kilograms?|kilogrammes?|kilos?|kg": 1.0, r"grams?|grammes?|g": 1e-3, r"pounds?|lbs?": 0.45359237,
}  # fmt: skip
_OUNCE_M3, _OUNCE_KG = 29.5735e-6, 0.0283495
"""Fluid ounce and avoirdupois ounce."""
_UNITS = "|".join([*_VOLUMES_M3, *_MASSES_KG, "ounces?|oz"])
_NUMERALS = {"half": 0.5, "quarter": 0.25, "one": 1.0, "two": 2.0, "three": 3.0, "four": 4.0, "five": 5.0, "ten": 10.0}
_AMOUNT = re.compile(
    rf"(?:\b(?:weighing|of|holding|holds|weighs) )?(?:about )?(?<![\w.])(\d+(?:\.\d+)?|\.\d+|{'|'.join(_NUMERALS)}) ?(?:an? )?"
    rf"({_UNITS})\b\.?(?: (?:capacity|in weight|in volume|heavy))?"
)
_OR_SO = frozenset({"/", "(", "="})
"""Separators between two expressions of one amount in different units."""
_RANGE = re.compile(rf"[\d.]+ ?(?:–|to|or) ?\d[\d.]* ?(?:{_UNITS})\b")


@dataclass(frozen=True)
class Amount:
    """A stated capacity (m^3) or mass (kg); ``said`` is its wording."""

    said: str
    volume_m3: float | None = None
    mass_kg: float | None = None


def amounts_in(plain: str, prior: Prior) -> list[Amount]:
    """Return the volumes and masses in a text in the form of ``normalise_lengths``; ounces of a container are fluid ounces.

    Raises UsageError for a range of amounts.
    """
    if (between := _RANGE.search(plain)) is not None:
        raise UsageError(f"{between[0]!r} states a range; give one amount")
    holds = prior.vessel or prior.container
    found = list[Amount]()
    end = -1
    for match in _AMOUNT.finditer(plain):
        beside, end = plain[end : match.start()].strip() if end >= 0 else "", match.end()
        number = _NUMERALS[match[1]] if match[1] in _NUMERALS else float(match[1])
        said = f"{match[1]} {match[2]}"
        volume_m3, mass_kg = _size(match[2], _VOLUMES_M3), _size(match[2], _MASSES_KG)
        if volume_m3 is None and mass_kg is None:  # ounces
            volume_m3, mass_kg = (_OUNCE_M3, None) if holds else (None, _OUNCE_KG)
        if volume_m3 is not None:
            amount = Amount(said, volume_m3=number * volume_m3)
        elif mass_kg is not None:
            amount = Amount(said, mass_kg=number * mass_kg)
        if not (beside in _OR_SO and found and _is_rounded(found[-1], amount)):
            found.append(amount)
    return found


def _is_rounded(one: Amount, other: Amount) -> bool:
    """Return whether two amounts are equal up to rounding in different units: '16 oz (473 ml)'."""
    pairs = ((one.volume_m3, other.volume_m3), (one.mass_kg, other.mass_kg))
    same = [abs(a - b) <= ROUNDED * max(a, b) for a, b in pairs if a is not None and b is not None]
    return one.said.split()[-1] != other.said.split()[-1] and same == [True]


def _size(unit: str, units: dict[str, float]) -> float | None:
    return next((size for spelt, size in units.items() if re.fullmatch(spelt, unit)), None)


def without_amounts(plain: str) -> str:
    """Return a text in the form of ``normalise_lengths`` without volumes and masses."""
    return " ".join(_AMOUNT.sub(" ", plain).split())
