"""Paged table of all attempts of a run, including unrecorded ones with the reason."""

from __future__ import annotations

from collections import Counter
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from manitwin.episodes.attempts import MERGED_SCHEMA, OUTCOMES
from manitwin.errors import EpisodesError
from manitwin.formats.parquet_file import ParquetTable, open_parquet

_SHOWN = ("episode_id", "skill", "category", "outcome", "length_s", "instructions", "goal", "failure", "plan_failures")
_REMEDY = "run the episodes again"
_OTHER = len(OUTCOMES)


@dataclass(frozen=True)
class AttemptRow:
    """An attempt as shown in a list; ``number`` is that of its recording, None if it was not kept."""

    number: int | None
    episode_id: str
    skill: str
    category: str
    outcome: str
    length_s: float | None
    instruction: str
    goal: str | None
    failure: str | None
    plan_failures: str | None


class AttemptRows:
    """The rows of an ``attempts.parquet``; raises EpisodesError if the file or its outcomes are invalid.

    ``outcomes`` counts the attempts per outcome. The outcomes of all rows are kept in memory, one byte each; a page reads only
    the row groups that it needs.
    """

    def __init__(self, path: Path):
        self._path = path
        codes = {outcome: code for code, outcome in enumerate(OUTCOMES)}
        found: list[np.ndarray] = []
        with self._open() as table:
            for group in range(table.row_groups):
                read = table.read(["outcome"], row_group=group)["outcome"].to_pylist()
                found.append(np.array([codes.get(each, _OTHER) for each in read], np.uint8))
        self._starts = np.cumsum([0, *map(len, found)])
        self._codes = np.concatenate([np.zeros(0, np.uint8), *found])
        if (self._codes == _OTHER).any():
            raise EpisodesError(f"{path}: outcomes that this version does not know; {_REMEDY}")
        counts = Counter(self._codes.tolist())
        self.outcomes = {name: counts[code] for code, name in enumerate(OUTCOMES) if counts[code]}
        self.kept = self.outcomes.get("kept", 0)

    def count(self, outcome: str = "") -> int:
        """Return the number of attempts with an outcome, or of all."""
        return self.outcomes.get(outcome, 0) if outcome else len(self._codes)

    def page(self, start: int, count: int, outcome: str = "") -> list[AttemptRow]:
        """Return ``count`` attempts with an outcome, or of all, beginning with the ``start``-th."""
        places = np.flatnonzero(self._codes == OUTCOMES.index(outcome)) if outcome else np.arange(len(self._codes))
        chosen = places[start : start + count]
        groups = np.searchsorted(self._starts, chosen, side="right") - 1
        rows: list[AttemptRow] = []
        with self._open() as table:
            if table.rows != len(self._codes):
                raise EpisodesError(f"{self._path}: has changed since it was opened; start manitwin view again")
            for group in np.unique(groups).tolist():
                rows += self._rows(table, group, chosen[groups == group])
        return rows

    def _rows(self, table: ParquetTable, group: int, places: np.ndarray) -> list[AttemptRow]:
        kept_before = int((self._codes[: self._starts[group]] == 0).sum())
        numbers = np.cumsum(self._codes[self._starts[group] : self._starts[group + 1]] == 0) - 1 + kept_before
        inside = places - self._starts[group]
        read = table.read(_SHOWN, row_group=group).take(inside.tolist()).to_pylist()
        return [
            _row(int(numbers[place]) if row["outcome"] == "kept" else None, row)
            for place, row in zip(inside.tolist(), read, strict=True)
        ]

    def _open(self) -> AbstractContextManager[ParquetTable]:
        return open_parquet(self._path, EpisodesError, schema=MERGED_SCHEMA, remedy=_REMEDY, inside=self._path.parent)


def _row(number: int | None, row: dict[str, Any]) -> AttemptRow:
    instructions = row["instructions"] or [""]
    return AttemptRow(
        number, row["episode_id"] or "", row["skill"] or "", row["category"] or "", row["outcome"], row["length_s"],
        instructions[0] or "", row["goal"], row["failure"], row["plan_failures"],
    )  # fmt: skip
