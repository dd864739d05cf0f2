"""One input of the pipeline as the user gave it: the payload of the tasks that make twins."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from manitwin.engine.task import Payload
from manitwin.formats.source_files import side_files
from manitwin.twin.store import sha256_of_file, sha256_of_json

ID_DIGITS = 16
"""64 bits: among 100,000 twins two share an id with a probability of 3e-10."""


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


def twin_id(item: Item) -> str:
    """Return the id of the twin that an item makes: a hash of the input's bytes, name, units and up axis, and of nothing else.

    What another tool says of an imported mesh is part of the input. Another configuration is another revision of the same twin.
    """
    if item.file is None:
        content: object = {"text": item.text}
    else:
        path = Path(item.file)
        root = path.parent.resolve()
        sides = {p.relative_to(root).as_posix(): sha256_of_file(p) for p in side_files(path)}
        content = {"suffix": path.suffix.lower(), "sha256": sha256_of_file(path), "side_files": sides}
    if item.given is not None:
        content = {"mesh": content, "given": sha256_of_file(Path(item.given))}
    identity = {"content": content, "name": item.name, "units": item.units, "up": item.up}
    return sha256_of_json(identity)[:ID_DIGITS]
