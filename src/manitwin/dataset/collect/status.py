"""Summary of a catalogue: row counts by property, and the inputs that could not be read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from manitwin.dataset.collect.facts import BANDS, GROUPS, UNKNOWN
from manitwin.dataset.collect.store import Catalogue, Refused, counts_by_column
from manitwin.formats.printable import printable_line

STATES = ("ready", "listed", "duplicate", "unreadable")
_SHOWN = 20
_IN_ORDER = {"group": (*GROUPS, UNKNOWN), "status": STATES, "size_band": BANDS}


@dataclass(frozen=True)
class CatalogueStatus:
    """Total number of rows, counts per column value, causes of unreadable rows, and entries that became no row.

    ``licence_known`` counts the ready or listed rows with a known licence.
    """

    rows: int
    licence_known: int
    counts: Mapping[str, dict[str, int]]
    unreadable: dict[str, int]
    refused: list[Refused]

    def document(self) -> dict[str, Any]:
        """Return the document of ``--json`` (docs/json.md)."""
        return {
            "rows": self.rows,
            "licence_known": self.licence_known,
            "by_group": self.counts["group"],
            "by_status": self.counts["status"],
            "by_licence": self.counts["licence"],
            "by_source": self.counts["source"],
            "by_size": self.counts["size_band"],
            "unreadable": self.unreadable,
            "refused": [asdict(each) for each in self.refused],
        }

    def lines(self) -> list[str]:
        """Return the summary as lines of text."""
        lines = [f"{self.rows:,} rows; {self.licence_known:,} that could be used have a licence that is known"]
        for name, counts in self.counts.items():
            shown = list(counts.items())
            more = f", and {len(shown) - _SHOWN} more" if len(shown) > _SHOWN else ""
            told = ", ".join(f"{printable_line(value)} {count:,}" for value, count in shown[:_SHOWN]) or "none"
            lines.append(f"by {name.replace('_band', '')}: {told}{more}")
        lines += [f"{count:,} cannot be read: {cause}" for cause, count in self.unreadable.items()]
        lines += [f"{r.count:,} of {r.list} not added: {r.cause} (the first: {r.example})" for r in self.refused]
        return lines


def catalogue_status(path: Path) -> CatalogueStatus:
    """Return the status of a catalogue; raises UsageError if it is missing or unreadable."""
    with Catalogue(path) as catalogue:
        counts = catalogue.counts()
        usable = sum(
            count for (_, status, licence, *_), count in counts if status in ("ready", "listed") and licence != UNKNOWN
        )
        each = {name: _ordered(name, found) for name, found in counts_by_column(counts).items()}
        return CatalogueStatus(
            rows=sum(count for _, count in counts),
            licence_known=usable,
            counts=each,
            unreadable=catalogue.unreadable_counts(),
            refused=catalogue.refused(),
        )


def _ordered(name: str, counts: dict[str, int]) -> dict[str, int]:
    """Return counts in the fixed order of a column; columns of free text are sorted by descending count."""
    order = _IN_ORDER.get(name)
    if order is not None:
        return {value: counts.get(value, 0) for value in order}
    return dict(sorted(counts.items(), key=lambda pair: (-pair[1], pair[0])))
