"""Row types of a ledger, and the states of items and stages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

ItemState = Literal["open", "accepted", "rejected", "failed", "duplicate"]
StageState = Literal["running", "done", "rejected", "waiting", "failed"]
ITEM_STATES = ("open", "accepted", "rejected", "failed", "duplicate")


@dataclass(frozen=True)
class OpenItem:
    """An open item, with its payload as JSON and the number of attempts at each stage."""

    number: int
    payload: dict[str, Any]
    attempts: dict[str, int]


@dataclass(frozen=True)
class ItemRow:
    """One item of the ledger; ``detail`` of an open item says what it waits for."""

    number: int
    payload: dict[str, Any]
    item_id: str
    state: ItemState
    reason: str | None
    detail: str
