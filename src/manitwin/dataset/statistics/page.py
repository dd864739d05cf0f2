"""The report as one HTML page: no request goes out and no script is needed to read it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources

from manitwin.dataset.statistics.query import Column, Query, Result, Row
from manitwin.dataset.statistics.style import Figure, for_page, printable

MISSING = "–"


@dataclass(frozen=True)
class NearPairs:
    """Pairs of twins of nearly one shape and size, the nearest first: some of ``pairs``, which are of ``twins`` twins.

    ``found_by`` is the call that finds them all.
    """

    nearest: list[Row]
    pairs: int
    twins: int
    found_by: str


SectionPart = Result | Figure | tuple[Figure, ...] | NearPairs
"""What a section consists of: a table, a figure, or figures side by side."""

_SHOWN_PAIRS = 40
_PAIR_COLUMNS = (
    Column("first", "twin", "text"),
    Column("second", "and twin", "text"),
    Column("shape_distance", "distance of shapes", "number"),
    Column("size_ratio", "ratio of sizes", "number"),
)


@dataclass(frozen=True)
class ReportSection:
    """A headed part of the page; ``empty`` is said where it has nothing to show."""

    anchor: str
    title: str
    empty: str
    parts: tuple[SectionPart, ...]


class Page:
    """Number tables and figures as they come, and write them."""

    def __init__(self, prelude: str, drawn: dict[str, Query]):
        """Take the SQL that goes before every query, and the queries that are drawn but not shown as tables."""
        self.prelude, self.drawn = prelude, drawn
        self.tables = self.figures = 0

    def html(self, title: str, lead: Sequence[str], sections: Sequence[ReportSection]) -> str:
        """Return the whole page."""
        style = resources.files("manitwin.dataset.statistics").joinpath("report.css").read_text(encoding="utf-8")
        links = "".join(f'<li><a href="#{s.anchor}">{escape(s.title)}</a></li>' for s in sections)
        return (
            f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
            f"<style>\n{style}</style>\n</head>\n<body>\n<header>\n<h1>{escape(title)}</h1>\n"
            + "".join(f"<p>{escape(line)}</p>\n" for line in lead)
            + f'<nav aria-label="Sections"><ul>{links}</ul></nav>\n</header>\n<main>\n'
            + "".join(self._section(section) for section in sections)
            + f"{self._reproduce()}</main>\n</body>\n</html>\n"
        )

    def _section(self, section: ReportSection) -> str:
        body = "".join(self._part(part) for part in section.parts) or f'<p class="none">{escape(section.empty)}</p>\n'
        return f'<section id="{section.anchor}">\n<h2>{escape(section.title)}</h2>\n{body}</section>\n'

    def _part(self, part: SectionPart) -> str:
        if isinstance(part, Result):
            return self._table(part)
        if isinstance(part, Figure):
            return self._figure(part)
        if isinstance(part, NearPairs):
            return self._near_pairs(part)
        return f'<div class="pair">\n{"".join(self._figure(figure) for figure in part)}</div>\n' if part else ""

    def _table(self, result: Result) -> str:
        query, rows = result.query, result.rows[: result.query.shown]
        if not rows:
            return ""
        more = len(result.rows) - len(rows)
        note = " ".join(filter(None, (query.note, f"{more:,} more rows are in statistics.json." if more else "")))
        return f"<div>\n{self._rows(query.name, query.caption, query.columns, rows, note)}{_sql(query)}</div>\n"

    def _rows(self, name: str, caption: str, columns: Sequence[Column], rows: Sequence[Row], note: str) -> str:
        self.tables += 1
        heads = "".join(f'<th scope="col" class="{c.kind}">{escape(c.heading)}</th>' for c in columns)
        body = "".join(f"<tr>{''.join(_cells(columns, row))}</tr>\n" for row in rows)
        return (
            f'<div class="scroll"><table id="table-{name}">\n'
            f"<caption><b>Table {self.tables}.</b> {escape(caption)}</caption>\n"
            f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{body}</tbody>\n</table></div>\n"
            + (f'<p class="note">{escape(note)}</p>\n' if note else "")
        )

    def _near_pairs(self, near: NearPairs) -> str:
        if not near.pairs:
            none = f"Near-duplicates: no two twins have nearly one shape and size. Looked for by {near.found_by}."
            return f'<p class="note">{escape(none)}</p>\n'
        shown = near.nearest[:_SHOWN_PAIRS]
        caption = f"Near-duplicates: {near.pairs:,} pairs of {near.twins:,} twins with nearly one shape and size."
        note = (
            f"The {len(shown)} nearest. Found by {near.found_by}."
            if near.pairs > len(shown)
            else f"Found by {near.found_by}."
        )
        return f"<div>\n{self._rows('near_duplicates', caption, _PAIR_COLUMNS, shown, note)}</div>\n"

    def _figure(self, figure: Figure) -> str:
        self.figures += 1
        sql = "".join(_sql(self.drawn[name]) for name in figure.queries if name in self.drawn)
        return (
            f'<figure id="figure-{figure.name}">\n{for_page(figure.svg)}\n'
            f"<figcaption><b>Figure {self.figures}.</b> {escape(figure.caption)}</figcaption>\n{sql}</figure>\n"
        )

    def _reproduce(self) -> str:
        return (
            '<section id="reproduce">\n<h2>Every number again</h2>\n<p>Each table and figure has its SQL below it '
            "(DuckDB); statistics.json has the same SQL with all its rows. It asks the views twins, points, grasps, "
            "placements, rejections and stages of the data set’s index, after these macros:</p>\n"
            f"<pre><code>{escape(self.prelude)}</code></pre>\n</section>\n"
        )


def _sql(query: Query) -> str:
    return (
        f"<details><summary>SQL: {escape(query.name)}</summary><pre><code>{escape(query.sql)}</code></pre></details>\n"
    )


def _cells(columns: Sequence[Column], row: Row) -> list[str]:
    first = columns[0]
    head = f'<th scope="row" class="{first.kind}">{written(first, row)}</th>'
    return [head, *(f'<td class="{column.kind}">{written(column, row)}</td>' for column in columns[1:])]


def written(column: Column, row: Row) -> str:
    """Return a cell's content as HTML."""
    value = row[column.name]
    if value is None:
        return MISSING
    text = escape(_plain(column, value))
    if column.interval is None or row[column.interval[0]] is None:
        return text
    low, high = (100 * row[name] for name in column.interval)
    return f'{text} <span class="interval">[{low:.1f}, {high:.1f}]</span>'


def _plain(column: Column, value: object) -> str:
    if isinstance(value, str):
        return printable(value)
    if not isinstance(value, (int, float)):
        raise AssertionError(f"{column.name}: a cell is text or a number, not {type(value).__name__}")
    match column.kind:
        case "share":
            return f"{100 * value:.1f} %"
        case "usd":
            return f"{value:,.2f}"
        case "signed":
            return f"{value:.2f}"
        case "count":
            return f"{value:,.0f}"
        case "given":
            return f"{value:,.0f}" if value == round(value) else f"{value:g}"
        case _:
            return _number(float(value))


def _number(value: float) -> str:
    """Write three digits that count; whole numbers whole."""
    if value == round(value) or abs(value) >= 1000:
        return f"{value:,.0f}"
    return f"{value:#.3g}".rstrip(".")
