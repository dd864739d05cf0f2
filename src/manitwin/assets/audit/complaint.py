"""What a rule of the audit has to say of an asset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Complaint:
    """The message, where, and the numbers behind it."""

    message: str
    file: Path | None = None
    values: dict[str, Any] | None = None
