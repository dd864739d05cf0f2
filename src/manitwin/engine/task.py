"""A task of a run, and what it asks for: the engine carries payloads between processes and never looks into them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Generic, Self, TypeVar


@dataclass(frozen=True)
class Payload(ABC):
    """The content of a task: a frozen dataclass of JSON values, so that it is hashable, picklable and kept in a ledger."""

    @property
    @abstractmethod
    def title(self) -> str:
        """A short name for a person."""

    @property
    def modified_at(self) -> float | None:
        """When what it names was last changed, in seconds since the epoch; None where nothing of it can change."""
        return None

    def to_json(self) -> dict[str, Any]:
        """Return the fields as a ledger keeps them: the same payload gives the same ones in every version."""
        return {field.name: getattr(self, field.name) for field in fields(self)}

    @classmethod
    def from_json(cls, fields: Mapping[str, Any]) -> Self:
        """Return the payload that a ledger of this version or an earlier one keeps."""
        return cls(**fields)


PayloadT = TypeVar("PayloadT", bound=Payload)


@dataclass(frozen=True)
class Task(Generic[PayloadT]):
    """One item of a run by its number in the ledger; ``item_id`` names what it makes, and is empty until that is known."""

    number: int
    payload: PayloadT
    item_id: str = ""
