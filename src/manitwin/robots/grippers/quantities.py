"""Validated quantities of gripper and robot files: valid ranges, and hints at the likely unit of a value out of range."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Annotated

import numpy as np
from pydantic import AfterValidator

MAX_LENGTH_M = 1.0
"""No gripper is larger than the largest object that is accepted (``GateConfig.max_longest_side_m``)."""
MAX_VACUUM_PA = 101_325.0
"""Standard atmosphere: the largest possible pressure difference."""
KILOPASCALS = MAX_VACUUM_PA / 1000
"""A value of at most this number was given in kilopascals."""
UNIT_TOLERANCE = 1e-6
MAX_NAME = 64
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_.-]*")


def _number(least: float, most: float, remedy: str, *, least_too: bool = False) -> Callable[[float], float]:
    """Return a validator for numbers above ``least`` (``least_too``: or equal to it) and at most ``most``."""
    above = f"at least {least:g}" if least_too else f"above {least:g}"
    wanted = above if np.isinf(most) else f"{above} and at most {most:g}"

    def check(value: float) -> float:
        if not (least <= value if least_too else least < value) or value > most:
            raise ValueError(f"is {value:g}, it must be {wanted}: {remedy if value > most else _SENSE}")
        return value

    return check


def _position(value: float) -> float:
    if abs(value) > MAX_LENGTH_M:
        raise ValueError(f"is {value:g}, it must be within {MAX_LENGTH_M:g} of the grasp frame's origin: {_METRES}")
    return value


def _vacuum(value: float) -> float:
    if not KILOPASCALS < value <= MAX_VACUUM_PA:
        wanted = f"above {KILOPASCALS:g} and at most {MAX_VACUUM_PA:g}, the atmosphere"
        raise ValueError(
            f"is {value:g}, it must be {wanted}: give pascals (60 kPa are 60000), as a positive difference"
        )
    return value


def _unit_quaternion(value: tuple[float, ...]) -> tuple[float, ...]:
    if abs(np.linalg.norm(value) - 1) > UNIT_TOLERANCE:
        raise ValueError("a rotation is a quaternion wxyz of length 1")
    return value


def _name(value: str) -> str:
    if not _NAME.fullmatch(value) or len(value) > MAX_NAME:
        wanted = f"letters, digits, '_', '-' and '.', at most {MAX_NAME}, the first a letter or digit"
        raise ValueError(f"is {value[:MAX_NAME]!r}, it must be {wanted}: files and columns are named by it")
    return value


def _source_text(value: str) -> str:
    if not value.strip():
        raise ValueError("is empty: give the source of the numbers; it is stored with every twin")
    return value


_METRES = "give metres, not millimetres"
_SENSE = "give its size, without a sign"
_RADIANS = "give radians, not degrees"

Length = Annotated[float, AfterValidator(_number(0, MAX_LENGTH_M, _METRES))]
"""Positive length in metres."""
Gap = Annotated[float, AfterValidator(_number(0, MAX_LENGTH_M, _METRES, least_too=True))]
"""Non-negative length in metres."""
Position = Annotated[float, AfterValidator(_position)]
"""Coordinate in metres."""
Rotation = Annotated[tuple[float, float, float, float], AfterValidator(_unit_quaternion)]
"""Unit quaternion wxyz."""
Positive = Annotated[float, AfterValidator(_number(0, np.inf, _SENSE))]
"""Positive number: a force, a friction coefficient, a gain or a speed."""
NotNegative = Annotated[float, AfterValidator(_number(0, np.inf, _SENSE, least_too=True))]
Turn = Annotated[float, AfterValidator(_number(-2 * np.pi, 2 * np.pi, _RADIANS, least_too=True))]
"""Angle in radians."""
Slope = Annotated[float, AfterValidator(_number(0, np.pi / 2, _RADIANS, least_too=True))]
"""Angle in radians from horizontal (0) to vertical (pi / 2)."""
Vacuum = Annotated[float, AfterValidator(_vacuum)]
"""Pressure difference in pascals."""
Name = Annotated[str, AfterValidator(_name)]
Source = Annotated[str, AfterValidator(_source_text)]
