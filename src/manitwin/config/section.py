"""The base class of all settings sections, and value types that several sections share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, model_validator

AbsolutePath = Annotated[Path, AfterValidator(Path.absolute)]
"""A path that is made absolute, so that it does not depend on the working directory."""

LARGEST_SEED = 2**63 - 1
"""The largest seed that ledgers, tables and random number generators store in 64 bits."""
LARGEST_COUNT = 10**9

Seed = Annotated[int, Field(ge=0, le=LARGEST_SEED)]


class Section(BaseModel):
    """A frozen section of the configuration: unknown keys are errors, floats are finite, and integers are bounded."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @model_validator(mode="after")
    def _bounded(self) -> Self:
        for name, value in self:
            if isinstance(value, int) and name not in _OF_ANY_SIZE and abs(value) > LARGEST_COUNT:
                raise ValueError(f"{name} is larger than {LARGEST_COUNT}")
        return self


_OF_ANY_SIZE = frozenset({"seed", "max_bytes"})

NO_SETTINGS = Section()
"""The settings of a stage that has no settings."""
