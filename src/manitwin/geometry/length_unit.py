"""The unit of a mesh: what the user states, else what the format declares, else what makes its size that of such a thing."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

PLAUSIBLE_M = (0.005, 1.0)
"""Longest axes that an object held in one hand or on a table can have (the paper's objects: 3 to 50 cm)."""

StatedUnit = Literal["m", "cm", "mm", "none", "auto"]
"""What a person says of a mesh's unit; ``none``: its numbers are no lengths, as those of many game assets."""

UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres of the units that a person can state."""

_GUESSES_M = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}  # in the order in which they are common
_SHARES = {"millimetres": 0.5, "centimetres": 0.35, "inches": 0.1}
# STL holds no unit: CAD programs write millimetres, every slicer reads them so, and 3MF, its successor, has them as its default
_STL_SHARES = {"millimetres": 0.85, "centimetres": 0.05, "inches": 0.05}
_NO_UNIT_SHARE = 0.05  # furniture in metres, and meshes of no scale at all
_SURE = 0.9
_ANYTHING_M = (0.02, 0.6)  # the usual longest axis of a thing that nobody has named
_OTHER_SIZE_SHARE = 0.1  # toys, samples and giants of a kind
_DEVIATIONS_ACROSS = 3.29  # a usual interval holds nine of ten
_NORMALISED = (1.0, 2.0)  # the longest axis of meshes that a generator or a viewer scaled to a unit cube
_MADE_TO_SIZE = frozenset({"step", "3mf"})
"""Formats of what is designed to be made: their unit is part of the design, and no viewer scales it."""
_CHOICE_OF_UNIT = frozenset({"dae", "fbx", "usdz"})
"""Formats that let their writer say any unit, and whose viewers do not care; glTF has metres alone, which many ignore."""
_SLACK = 2.0  # a size outside the usual interval by more than this speaks against the unit


@dataclass(frozen=True)
class LengthUnit:
    """The unit of a mesh and who said so.

    ``factor`` turns the file's numbers into metres. ``metric`` tells whether the size can be believed; if not, only
    proportions can. ``source``: 'user' | 'declared' by the format | 'assumed' (nothing said, plausible as metres) |
    'guessed' (from the size) | 'unknown'. ``finding`` is one sentence for a person where the size spoke against the
    file.
    """

    factor: float
    metric: bool
    source: Literal["user", "declared", "assumed", "guessed", "unknown"]
    finding: str | None


def decide_unit(
    longest_axis: float,
    *,
    user: StatedUnit = "auto",
    file_unit_m: float | None = None,
    expected_m: tuple[float, float] | None = None,
    file_format: str | None = None,
) -> LengthUnit:
    """Decide the unit of a mesh whose longest side has the length ``longest_axis`` in the file's numbers.

    ``file_unit_m`` is the unit that the format declares (None: it does not). ``expected_m`` is the usual interval of
    the longest axis of such a thing (None: unknown); it decides between guesses, and against sizes nobody declared.
    ``file_format`` ('stl', 'obj', ...) tells which units are common in such files.
    """
    declared = file_unit_m is not None
    factor = 1.0 if file_unit_m is None else file_unit_m
    if user == "none":
        return LengthUnit(factor, False, "user", None)
    if user != "auto":
        return LengthUnit(UNITS_M[user], True, "user", None)
    if declared and file_format in _MADE_TO_SIZE:
        return LengthUnit(factor, True, "declared", None)
    size_m = longest_axis * factor
    if expected_m is not None and _usual(size_m, expected_m):
        return LengthUnit(factor, True, "declared" if declared else "assumed", None)
    if _is_normalised(size_m):
        return _not_believed(factor, f"its longest side of {size_m:.3g} looks scaled to a unit cube")
    if PLAUSIBLE_M[0] <= size_m <= PLAUSIBLE_M[1]:
        if expected_m is not None and not declared:
            return _not_believed(factor, f"its longest side of {size_m:.3g} m is not that of such a thing")
        return LengthUnit(factor, True, "declared" if declared else "assumed", None)
    return _guessed(longest_axis, factor, declared, expected_m, file_format)


def _guessed(
    longest_axis: float,
    factor: float,
    declared: bool,
    expected_m: tuple[float, float] | None,
    file_format: str | None,
) -> LengthUnit:
    size_m = longest_axis * factor
    said = f"{longest_axis:.4g} units are {size_m:.4g} m as {'declared' if declared else 'metres'}"
    fitting = {n: u for n, u in _GUESSES_M.items() if PLAUSIBLE_M[0] <= longest_axis * u <= PLAUSIBLE_M[1]}
    if not fitting:
        # kept as it is, so that the gate refuses it for its size
        source: Literal["declared", "assumed"] = "declared" if declared else "assumed"
        return LengthUnit(factor, True, source, f"{said}, and no usual unit makes that plausible; give --units")
    shares = _STL_SHARES if file_format == "stl" else _SHARES
    weights = {n: shares[n] * _density(longest_axis * u, expected_m or _ANYTHING_M) for n, u in fitting.items()}
    best = max(weights, key=lambda name: weights[name])
    # a unit that somebody chose is no other one because it is wrong: the file may as well mean none, or a large thing
    contradicts = declared and file_format in _CHOICE_OF_UNIT and expected_m is None
    if not contradicts and weights[best] >= _SURE * (sum(weights.values()) + _NO_UNIT_SHARE * _any_density()):
        finding = f"{said}, which is implausible; read as {best}: {longest_axis * fitting[best]:.3g} m"
        return LengthUnit(fitting[best], True, "guessed", finding)
    usual = {
        n: u for n, u in fitting.items() if expected_m is not None and _usual(longest_axis * u, expected_m)
    } or fitting
    may = f"{', '.join(usual)} would {'all fit' if len(usual) > 1 else 'fit, as would no unit at all'}"
    finding = f"{said}, which is implausible; {may}: its scale was not believed; give --units"
    return LengthUnit(next(iter(usual.values())), False, "guessed", finding)


def _not_believed(factor: float, cause: str) -> LengthUnit:
    return LengthUnit(factor, False, "unknown", f"{cause}; its scale was not believed; give --units")


def _density(size_m: float, usual_m: tuple[float, float]) -> float:
    """Return the density of the logarithm of a longest axis: nine of ten are within the usual interval, one in ten has any."""
    middle, deviation = math.log(usual_m[0] * usual_m[1]) / 2, math.log(usual_m[1] / usual_m[0]) / _DEVIATIONS_ACROSS
    deviation = max(deviation, 0.05)
    own = math.exp(-0.5 * ((math.log(size_m) - middle) / deviation) ** 2) / (deviation * math.sqrt(2 * math.pi))
    return (1 - _OTHER_SIZE_SHARE) * own + _OTHER_SIZE_SHARE * _any_density()


def _any_density() -> float:
    return 1 / math.log(PLAUSIBLE_M[1] / PLAUSIBLE_M[0])


def _usual(size_m: float, expected_m: tuple[float, float]) -> bool:
    return expected_m[0] / _SLACK <= size_m <= expected_m[1] * _SLACK


def _is_normalised(size_m: float) -> bool:
    return any(abs(size_m / unit - 1) < 2e-3 for unit in _NORMALISED)
