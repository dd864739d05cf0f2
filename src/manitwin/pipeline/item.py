"""One input of the pipeline as the user gave it: the payload of the tasks that make twins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from manitwin.engine.task import Payload


@dataclass(frozen=True)
class Item(Payload):
    """One input as the user gave it.

    ``file`` is an absolute path, or None where ``text`` is given. ``units`` and ``up`` are what the user said ('auto': unsaid).
    ``given`` is the import.json beside an imported mesh: what another tool says of it.
    """

    file: str | None
    text: str | None = None
    name: str | None = None
    units: Literal["m", "cm", "mm", "auto"] = "auto"
    up: Literal["y", "z", "auto"] = "auto"
    license: str | None = None
    attribution: str | None = None
    given: str | None = None

    @property
    def title(self) -> str:
        """The name of the file, or the begin of the text."""
        return Path(self.file).name if self.file else f"'{(self.text or '')[:40]}'"

    def to_json(self) -> dict[str, Any]:
        """Return the fields as a ledger keeps them; of those that came later, only what is said: old rows stay equal."""
        fields = super().to_json()
        return fields if self.given is not None else {name: value for name, value in fields.items() if name != "given"}
