"""What unit a mesh is in: what the user says, what its format says, or what its size allows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

PLAUSIBLE_M = (0.005, 1.0)
"""Longest axes that an object held in one hand or on a table can have (the paper's objects: 3 to 50 cm)."""

_UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
_GUESSES_M = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}  # in the order in which they are common
_NORMALISED = (1.0, 2.0)  # the longest axis of meshes that a generator or a viewer scaled to a unit cube
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
    user: Literal["m", "cm", "mm", "auto"] = "auto",
    file_unit_m: float | None = None,
    expected_m: tuple[float, float] | None = None,
) -> LengthUnit:
    """Decide the unit of a mesh whose longest side has the length ``longest_axis`` in the file's numbers.

    ``file_unit_m`` is the unit that the format declares (None: it does not). ``expected_m`` is the usual interval of
    the longest axis of such a thing (None: unknown); it decides between guesses, and against sizes nobody declared.
    """
    if user != "auto":
        return LengthUnit(_UNITS_M[user], True, "user", None)
    declared = file_unit_m is not None
    factor = 1.0 if file_unit_m is None else file_unit_m
    size_m = longest_axis * factor
    if expected_m is not None and _usual(size_m, expected_m):
        return LengthUnit(factor, True, "declared" if declared else "assumed", None)
    if _is_normalised(size_m):
        return _not_believed(factor, f"its longest side of {size_m:.3g} looks scaled to a unit cube")
    if PLAUSIBLE_M[0] <= size_m <= PLAUSIBLE_M[1]:
        if expected_m is not None and not declared:
            return _not_believed(factor, f"its longest side of {size_m:.3g} m is not that of such a thing")
        return LengthUnit(factor, True, "declared" if declared else "assumed", None)
    return _guessed(longest_axis, factor, declared, expected_m)


def _guessed(longest_axis: float, factor: float, declared: bool, expected_m: tuple[float, float] | None) -> LengthUnit:
    size_m = longest_axis * factor
    said = f"{longest_axis:.4g} units are {size_m:.4g} m as {'declared' if declared else 'metres'}"
    fitting = {n: u for n, u in _GUESSES_M.items() if PLAUSIBLE_M[0] <= longest_axis * u <= PLAUSIBLE_M[1]}
    if expected_m is not None:
        fitting = {n: u for n, u in fitting.items() if _usual(longest_axis * u, expected_m)} or fitting
    if not fitting:
        # kept as it is, so that the gate refuses it for its size
        source: Literal["declared", "assumed"] = "declared" if declared else "assumed"
        return LengthUnit(factor, True, source, f"{said}, and no usual unit makes that plausible; give --units")
    name, unit_m = next(iter(fitting.items()))
    others = [n for n in fitting if n != name]
    alternatives = f" ({' or '.join(others)} would fit too; give --units to be sure)" if others else ""
    finding = f"{said}, which is implausible; read as {name}: {longest_axis * unit_m:.3g} m{alternatives}"
    return LengthUnit(unit_m, not others, "guessed", finding)


def _not_believed(factor: float, cause: str) -> LengthUnit:
    return LengthUnit(factor, False, "unknown", f"{cause}; its scale was not believed; give --units")


def _usual(size_m: float, expected_m: tuple[float, float]) -> bool:
    return expected_m[0] / _SLACK <= size_m <= expected_m[1] * _SLACK


def _is_normalised(size_m: float) -> bool:
    return any(abs(size_m / unit - 1) < 2e-3 for unit in _NORMALISED)
