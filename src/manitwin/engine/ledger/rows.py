"""The rows of a ledger as others get them, and the states that they know."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

ItemState = Literal["open", "accepted", "rejected", "failed", "duplicate"]
StageState = Literal["running", "done", "rejected", "waiting", "failed"]
ITEM_STATES = ("open", "accepted", "rejected", "failed", "duplicate")


@dataclass(frozen=True)
class OpenItem:
    """An item that has not ended, with the JSON of its payload and how often each of its stages was tried."""

    number: int
    payload: dict[str, Any]
    attempts: dict[str, int]


@dataclass(frozen=True)
class ItemRow:
    """One item as the ledger keeps it; ``detail`` of an open one says what it waits for."""

    number: int
    payload: dict[str, Any]
    item_id: str
    state: ItemState
    reason: str | None
    detail: str
