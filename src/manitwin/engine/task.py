"""Tasks of a run and their payloads. The engine passes payloads between processes without inspecting them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Generic, Self, TypeVar


@dataclass(frozen=True)
class Payload(ABC):
    """The content of a task: a frozen dataclass of JSON values, which is hashable, picklable and stored in the ledger."""

    @property
    @abstractmethod
    def title(self) -> str:
        """A short name for messages."""

    @property
    def modified_at(self) -> float | None:
        """When the input was last modified, in seconds since the epoch; None if it cannot change."""
        return None

    def to_json(self) -> dict[str, Any]:
        """Return the fields as stored in the ledger; the same payload must give the same fields in every version."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the payload from a ledger of this version or an earlier one."""
        return cls(**fields)


PayloadT = TypeVar("PayloadT", bound=Payload)


@dataclass(frozen=True)
class Task(Generic[PayloadT]):
    """One item of a run by its number in the ledger; ``item_id`` is empty until it is known."""

    number: int
    payload: PayloadT
    item_id: str = ""
