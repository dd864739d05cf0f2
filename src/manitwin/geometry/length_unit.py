"""The length unit of a mesh: stated by the user, else declared by the format, else inferred from the plausible size."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Literal

PLAUSIBLE_M = (0.005, 1.0)
"""Plausible longest axes of an object held in one hand or placed on a table (the paper's objects: 3 to 50 cm)."""

StatedUnit = Literal["m", "cm", "mm", "none", "auto"]
"""A stated unit; ``none``: the numbers are not lengths, as in many game assets."""

UNITS_M = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Metres per stated unit."""

_GUESSES_M = {"millimetres": 0.001, "centimetres": 0.01, "inches": 0.0254}  # in order of how common they are
_SHARES = {"millimetres": 0.5, "centimetres": 0.35, "inches": 0.1}
# STL has no unit: CAD programs write millimetres, slicers read it so, and 3MF, its successor, has them as default
_STL_SHARES = {"millimetres": 0.85, "centimetres": 0.05, "inches": 0.05}
_NO_UNIT_SHARE = 0.05  # furniture in metres, and meshes without scale
_SURE = 0.9
_ANYTHING_M = (0.02, 0.6)  # the usual longest axis of an unnamed object
_PRINTED_M = (0.01, 0.3)  # the same for STL: most are written for 3D printers, whose beds are 20 to 35 cm wide
_OTHER_SIZE_SHARE = 0.1  # toys, samples and oversized specimens
_DEVIATIONS_ACROSS = 3.29  # standard deviations across an interval that contains nine of ten
_NORMALISED = (1.0, 2.0)  # longest axis of meshes normalized to a unit cube by a generator or viewer
_MADE_TO_SIZE = frozenset({"step", "3mf"})
"""Design formats, whose unit is part of the design and which viewers do not rescale."""
_CHOICE_OF_UNIT = frozenset({"dae", "fbx", "usdz"})
"""Formats that may declare any unit, which viewers ignore; glTF always means metres, which many writers ignore."""
_SLACK = 2.0  # factor beyond the usual interval at which a size speaks against the unit


@dataclass(frozen=True)
class LengthUnit:
    """The unit of a mesh and its source.

    ``factor`` converts the file's numbers to metres. ``metric``: whether the size is reliable; if not, only proportions are.
    ``source``: 'user' | 'declared' by the format | 'assumed' (not stated, plausible as metres) | 'guessed' (from the size) |
    'unknown'. ``finding``: a sentence for the report if the size contradicts the file.
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
    """Decide the unit of a mesh whose longest side is ``longest_axis`` in the file's numbers.

    ``file_unit_m``: the unit that the format declares, in metres (None: none). ``expected_m``: the usual interval of such an
    object's longest axis (None: unknown); it selects among guesses, and rejects implausible undeclared sizes. ``file_format``
    ('stl', 'obj', ...) determines which units are common.
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
        return _implausible_unit(factor, f"its longest side of {size_m:.3g} looks scaled to a unit cube")
    if PLAUSIBLE_M[0] <= size_m <= PLAUSIBLE_M[1]:
        if expected_m is not None and not declared:
            return _implausible_unit(factor, f"its longest side of {size_m:.3g} m is not that of such a thing")
        return LengthUnit(factor, True, "declared" if declared else "assumed", None)
    return _infer_unit(longest_axis, factor, declared, expected_m, file_format)


def _infer_unit(
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
        # kept unchanged, so that the gate rejects the size
        source: Literal["declared", "assumed"] = "declared" if declared else "assumed"
        return LengthUnit(factor, True, source, f"{said}, and no usual unit makes that plausible; give --units")
    is_stl = file_format == "stl"
    kinds = [expected_m] if expected_m is not None else [_ANYTHING_M, _PRINTED_M] if is_stl else [_ANYTHING_M]
    sure = [name for kind in kinds if (name := _sure_unit(longest_axis, fitting, kind, is_stl)) is not None]
    # A declared unit that is implausible is not evidence for another unit: the file may have no scale, or be large.
    contradicts = declared and file_format in _CHOICE_OF_UNIT and expected_m is None
    if not contradicts and sure:
        finding = f"{said}, which is implausible; read as {sure[0]}: {longest_axis * fitting[sure[0]]:.3g} m"
        return LengthUnit(fitting[sure[0]], True, "guessed", finding)
    usual = {
        n: u for n, u in fitting.items() if expected_m is not None and _usual(longest_axis * u, expected_m)
    } or fitting
    may = f"{', '.join(usual)} would {'all fit' if len(usual) > 1 else 'fit, as would no unit at all'}"
    finding = f"{said}, which is implausible; {may}: its scale was not believed; give --units"
    return LengthUnit(next(iter(usual.values())), False, "guessed", finding)


def _sure_unit(
    longest_axis: float, fitting: dict[str, float], usual_m: tuple[float, float], is_stl: bool
) -> str | None:
    """Return the unit for which nine tenths speak, of a thing with the usual longest axis ``usual_m``; None where none is."""
    shares = _STL_SHARES if is_stl else _SHARES
    weights = {name: shares[name] * _density(longest_axis * unit_m, usual_m) for name, unit_m in fitting.items()}
    best = max(weights, key=lambda name: weights[name])
    enough = weights[best] >= _SURE * (sum(weights.values()) + _NO_UNIT_SHARE * _any_density())
    return best if enough else None


def _implausible_unit(factor: float, cause: str) -> LengthUnit:
    return LengthUnit(factor, False, "unknown", f"{cause}; its scale was not believed; give --units")


def _density(size_m: float, usual_m: tuple[float, float]) -> float:
    """Return the density of the logarithm of a longest axis: nine of ten within the usual interval, one in ten uniform."""
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
