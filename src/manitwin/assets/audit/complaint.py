"""A defect that an audit rule finds in an asset."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Complaint:
    """The message, the file concerned (None: the whole asset), and the measured values behind it."""

    message: str
    file: Path | None = None
    values: dict[str, Any] | None = None
