"""The frozen configuration of a build: one section a stage, the paper's numbers as the defaults.

Every section belongs to one stage and is part of that stage's key: a changed value re-runs that stage and what follows.
"""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A part of the configuration: unknown keys are errors, values do not change."""

    model_config = ConfigDict(extra="forbid", frozen=True)
