"""Parsing of a gallery's URL, and the index queries that answer it, one page at a time."""

from __future__ import annotations

import math
import os
import threading
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any
from urllib.parse import urlencode

import pyarrow as pa

from manitwin.dataset.index.conditions import sql_text
from manitwin.dataset.index.part_list import PARTS
from manitwin.dataset.index.query import Index
from manitwin.errors import UsageError, unknown_name_message
from manitwin.twin.dataset_root import DatasetRoot
from manitwin.web.card_tables import TABLES, WORDS, CardTables

PAGE_CARDS = 48
"""Divisible by 2, 3, 4 and 6, so that rows of cards are full at most widths."""
TIMEOUT_S, MEMORY_GB = 10.0, 0.25
"""Limits on a user's SQL condition."""
MOST_WORDS = 12
LONGEST_TEXT = 2_000
"""Maximum number of characters of a URL field."""

SORTS = {
    "accepted": (
        "name",
        "category",
        "-verified",
        "-robustness_median",
        "-longest_m",
        "longest_m",
        "-mass_kg",
        "mass_kg",
    ),
    "rejected": ("name", "stage", "reason"),
}
_BOUNDS = {
    "longest_min": ("longest_m", ">="), "longest_max": ("longest_m", "<="), "mass_min": ("mass_kg", ">="),
    "mass_max": ("mass_kg", "<="), "verified_min": ("verified", ">="), "robustness_min": ("robustness_median", ">="),
}  # fmt: skip
"""Numeric URL fields with their column and comparison; metres, kilograms, number of grasps, share."""


@dataclass(frozen=True)
class View:
    """A view of the gallery as encoded in its URL: ``of`` parses, ``query`` writes it.

    ``q`` are words that must all occur, ``where`` is a condition as in ``manitwin query``, ``sort`` a column (descending with
    ``-``), and ``page`` counts from 1. Bounds are None if not set.
    """

    status: str = "accepted"
    q: str = ""
    category: str = ""
    stage: str = ""
    reason: str = ""
    longest_min: float | None = None
    longest_max: float | None = None
    mass_min: float | None = None
    mass_max: float | None = None
    verified_min: float | None = None
    robustness_min: float | None = None
    where: str = ""
    sort: str = ""
    page: int = 1

    @classmethod
    def from_url_fields(cls, asked: Mapping[str, str]) -> View:
        """Return the view of a URL's fields; raises UsageError for an unknown field or an invalid value."""
        given: dict[str, Any] = {}
        names = [each.name for each in fields(cls)]
        for name, value in asked.items():
            if name not in names:
                raise UsageError(unknown_name_message("filter", name, names))
            if len(value) > LONGEST_TEXT:
                raise UsageError(f"{name}: {len(value)} characters; give at most {LONGEST_TEXT}")
            if value.strip():
                given[name] = _number(name, value) if name in _BOUNDS or name == "page" else value.strip()
        view = cls(**{**given, "page": int(given.get("page", 1))})
        if view.status not in TABLES:
            raise UsageError(unknown_name_message("status", view.status, TABLES))
        if view.sort and view.sort not in SORTS[view.status]:
            raise UsageError(unknown_name_message("order", view.sort, SORTS[view.status]))
        if not 1 <= view.page <= 10**6:
            raise UsageError(f"page is {view.page}; give 1 or more")
        return view

    def query(self, **changes: Any) -> str:
        """Return the URL fields of this view, with changes: the values other than defaults, in a fixed order."""
        view = replace(self, **changes)
        said = [
            (each.name, getattr(view, each.name)) for each in fields(view) if getattr(view, each.name) != each.default
        ]
        return urlencode([(name, decimal(value) if isinstance(value, float) else value) for name, value in said])

    def conditions(self) -> list[str]:
        """Return the SQL conditions on the view's cards (``CardTables``), without ``where``."""
        found = [f"contains({WORDS}, {sql_text(word.lower())})" for word in self.q.split()[:MOST_WORDS]]
        if self.status == "accepted":
            found += [f"category = {sql_text(self.category)}"] if self.category else []
            bounds = ((column, sign, getattr(self, name)) for name, (column, sign) in _BOUNDS.items())
            return found + [f"{column} {sign} {value!r}" for column, sign, value in bounds if value is not None]
        return found + [
            f"{name} = {sql_text(getattr(self, name))}" for name in ("stage", "reason") if getattr(self, name)
        ]


def decimal(value: float) -> str:
    """Return a number as text for a URL or input field, exact to 15 digits."""
    return f"{value:.15g}"


def _number(name: str, value: str) -> float:
    try:
        number = float(value)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise UsageError(f"{name}: {value[:40]!r} is no number; give one such as 0.25")
    return number


@dataclass(frozen=True)
class GalleryPage:
    """The cards of one page, the total number, and the facets.

    ``counts`` is the number of twins per status; ``categories``, ``stages`` and ``reasons`` count their values, most frequent
    first.
    """

    view: View
    rows: list[dict[str, Any]]
    total: int
    counts: dict[str, int]
    categories: dict[str, int]
    stages: dict[str, int]
    reasons: dict[str, int]

    @property
    def pages(self) -> int:
        """The number of pages, at least 1."""
        return max(1, math.ceil(self.total / PAGE_CARDS))


class Gallery:
    """Paged access to the index of a data set. Thread-safe by locking. A rewritten index is reopened.

    Raises UsageError if there is no index.
    """

    def __init__(self, root: DatasetRoot):
        self.root = root
        self._lock = threading.Lock()
        self._stamp: tuple[int, int] | None = None
        self._open_tables()

    def find(self, view: View) -> GalleryPage:
        """Return a page of the view; raises UsageError for an invalid condition."""
        with self._lock:
            cards, among = self._open_tables(), self._condition_twins(view)
            rows = cards.rows(
                view.status,
                view.conditions(),
                sort=view.sort,
                limit=PAGE_CARDS,
                offset=PAGE_CARDS * (view.page - 1),
                among=among,
            )
            return GalleryPage(view, rows, cards.count(view.status, view.conditions(), among), **self._facets)

    def all_rows(self, view: View) -> list[dict[str, Any]]:
        """Return all rows of the view with their searched words."""
        with self._lock:
            cards, among = self._open_tables(), self._condition_twins(view)
            return cards.rows(view.status, view.conditions(), sort=view.sort, among=among, with_words=True)

    def _condition_twins(self, view: View) -> pa.Table | None:
        """Return the twins that satisfy the SQL condition, evaluated by the index, whose tables it may read; None without a
        condition.
        """
        return self._index.select(TABLES[view.status], view.where, columns=["twin_id"]) if view.where else None

    def _open_tables(self) -> CardTables:
        stamp = self._index_stamp()
        if self._stamp is None or stamp != self._stamp:
            self._index = Index(self.root, timeout_s=TIMEOUT_S, memory_gb=MEMORY_GB)
            self._cards = CardTables(self._index)
            self._facets: dict[str, Any] = {
                "counts": {status: self._cards.count(status) for status in TABLES},
                "categories": self._cards.value_counts("accepted", "category"),
                "stages": self._cards.value_counts("rejected", "stage"),
                "reasons": self._cards.value_counts("rejected", "reason"),
            }
            self._stamp = stamp
        return self._cards

    def _index_stamp(self) -> tuple[int, int]:
        if self.root.local is None:
            return (0, 0)  # the index of a data set at a URL is not reloaded
        try:
            about = os.stat(self.root.full(PARTS))
        except OSError:
            return (0, 0)
        return (about.st_mtime_ns, about.st_size)
