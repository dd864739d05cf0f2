"""The items of a ledger that were not accepted, each with what was said of it."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

UnacceptedState = Literal["rejected", "failed", "waiting", "unfinished"]


@dataclass(frozen=True)
class Unaccepted:
    """One item: ``which`` names it to a person, ``reason`` is a code, ``message`` says in words what happened.

    The message of an error begins with its class, behind the stage and the attempts where these are told.

    ``waiting`` is open and had to wait for a service as the run ended; ``unfinished`` is what ``build`` calls an item that has
    not ended.
    """

    which: str
    state: UnacceptedState
    reason: str | None
    message: str


def read_unaccepted(connection: sqlite3.Connection) -> Iterator[Unaccepted]:
    """Yield the items that were rejected or failed, then those that wait."""
    for row in connection.execute(
        "SELECT number, state, reason, detail FROM items WHERE state IN ('rejected', 'failed') ORDER BY number"
    ):
        yield Unaccepted(str(row["number"]), row["state"], row["reason"], row["detail"])
    for row in connection.execute(
        "SELECT s.number, s.error FROM stages s JOIN items i ON i.number = s.number"
        " WHERE i.state = 'open' AND s.state = 'waiting' AND s.error IS NOT NULL ORDER BY s.number"
    ):
        yield Unaccepted(str(row["number"]), "waiting", None, row["error"])
