"""Service charges of failed attempts at a stage: stored beside its results, and added to the cost of the attempt that ends."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from manitwin.engine.charges import Bill, record_charges
from manitwin.errors import TwinError
from manitwin.formats.bounded_file import read_bytes
from manitwin.formats.json_file import json_number, parse_json
from manitwin.twin.store import canonical_json, write_bytes_atomically

LOST = "lost_usd.json"
"""The file in a stage's folder with the sum of lost charges in USD."""
MAX_LOST_BYTES = 64


@contextmanager
def keep_lost_charges(stage_folder: Path) -> Iterator[Bill]:
    """Record charges; if the work fails, add them to the stage's lost charges."""
    with record_charges() as bill:
        try:
            yield bill
        except BaseException:
            if bill.usd:
                total = lost_usd(stage_folder) + bill.usd
                write_bytes_atomically(stage_folder / LOST, canonical_json(total).encode())
            raise


def lost_usd(stage_folder: Path) -> float:
    """Return the charges of failed attempts at a stage, in USD."""
    lost = stage_folder / LOST
    if not lost.is_file():
        return 0.0
    said = parse_json(
        read_bytes(lost, MAX_LOST_BYTES, TwinError),
        str(lost),
        TwinError,
        remedy="remove it; it only holds a sum in USD",
    )
    return json_number(said, str(lost))
