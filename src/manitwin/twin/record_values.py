"""Value types of the schema: file names, finite numbers, vectors, Estimate, Check."""

from __future__ import annotations

import math
import re
from pathlib import PurePosixPath
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator


def _finite(value: float) -> float:
    if not math.isfinite(value):
        raise ValueError("not a finite number")
    return value


CONTROLS = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f\ud800-\udfff]")
"""Characters not allowed in a record's texts: control characters, which XML exports cannot represent, and lone surrogates."""
LARGEST_M, LARGEST_KG = 1e4, 1e6
"""Limits far beyond graspable objects, and safe for the arithmetic of any simulator."""


def _file_below(name: str) -> str:
    parts = PurePosixPath(name).parts
    if not parts or name.startswith("/") or ".." in parts or not name.isprintable():
        raise ValueError(f"{name[:80]!r} is no file below the twin's folder")
    return name


def _folder_name(name: str) -> str:
    if name.startswith(".") or "/" in _file_below(name):
        raise ValueError(f"{name[:80]!r} is no name for a folder")
    return name


FileBelow = Annotated[str, AfterValidator(_file_below)]


def _unit_quaternion(quaternion_wxyz: list[float]) -> list[float]:
    if not any(quaternion_wxyz):
        raise ValueError("a quaternion of zeros is no rotation")
    return quaternion_wxyz


FolderName = Annotated[str, AfterValidator(_folder_name)]
Finite = Annotated[float, AfterValidator(_finite)]
Vector3 = Annotated[list[Finite], Field(min_length=3, max_length=3)]
Vector4 = Annotated[list[Finite], Field(min_length=4, max_length=4)]
Quaternion = Annotated[Vector4, AfterValidator(_unit_quaternion)]
Matrix3 = Annotated[list[Vector3], Field(min_length=3, max_length=3)]
Matrix4 = Annotated[list[Vector4], Field(min_length=4, max_length=4)]
Unit = Annotated[float, Field(ge=0, le=1)]


class Record(BaseModel):
    """Base class of the schema: unknown keys are errors, instances are immutable."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Estimate(Record):
    """A number with its interval and source.

    ``source``: measured | user | human:<annotator> | vlm:<model> | prior:<category> | density*volume | imported:<format> |
    default. Imported values are subject to the same plausibility checks as estimates.
    """

    value: Finite
    low: Finite
    high: Finite
    source: str = Field(min_length=1)

    @model_validator(mode="after")
    def _check_interval(self) -> Estimate:
        if not self.low <= self.value <= self.high:
            raise ValueError(f"{self.value} is outside [{self.low}, {self.high}]")
        return self


class Check(Record):
    """One quality check; ``passed`` is None if it could not be judged."""

    name: str
    passed: bool | None
    value: float | str | None = None
    limit: float | str | None = None
    message: str = ""
