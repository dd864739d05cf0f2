"""The report as a self-contained HTML page without scripts, with its figures and numbers as separate files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources
from pathlib import Path

from manitwin.dataset.statistics.query import Column, Query, Result, Row
from manitwin.dataset.statistics.style import Figure, themed_svg
from manitwin.formats.markdown import one_line
from manitwin.twin.store import canonical_json, write_bytes_atomically

FOLDER, REPORT, NUMBERS, FIGURES = "statistics", "report.html", "statistics.json", "figures"
SCHEMA_VERSION = 1
MISSING = "–"


@dataclass(frozen=True)
class NearPairs:
    """The nearest near-duplicate pairs, out of ``pairs`` pairs among ``twins`` twins.

    ``found_by`` is the call that finds all of them.
    """

    nearest: list[Row]
    pairs: int
    twins: int
    found_by: str


SectionPart = Result | Figure | tuple[Figure, ...] | NearPairs
"""A part of a section: a table, a figure, or several figures side by side."""

_SHOWN_PAIRS = 40
_PAIR_COLUMNS = (
    Column("first", "twin", "text"),
    Column("second", "and twin", "text"),
    Column("shape_distance", "distance of shapes", "number"),
    Column("size_ratio", "ratio of sizes", "number"),
)


@dataclass(frozen=True)
class ReportSection:
    """A section of the page; ``empty`` is shown if it has no content."""

    anchor: str
    title: str
    empty: str
    parts: tuple[SectionPart, ...]


def report_section(
    results: Mapping[str, Result],
    figures: Mapping[str, Figure | None],
    anchor: str,
    title: str,
    *parts: str | tuple[str, ...],
    empty: str,
) -> ReportSection:
    """Return a section of results and figures by name: ``lengths``, ``figure:lengths``, or a tuple of figures side by side."""
    chosen: list[SectionPart] = []
    for part in parts:
        if isinstance(part, tuple):
            chosen.append(tuple(figure for name in part if (figure := figures[name])))
        elif not part.startswith("figure:"):
            chosen.append(results[part])
        elif figure := figures[part.removeprefix("figure:")]:
            chosen.append(figure)
    return ReportSection(anchor, title, empty, tuple(chosen))


@dataclass(frozen=True)
class Report:
    """A report to write: ``lead`` are its first sentences, ``prelude`` the SQL macros before every query.

    ``views`` names, as HTML, the tables that the SQL queries. A figure is None if there is nothing to draw.
    """

    title: str
    lead: Sequence[str]
    prelude: str
    views: str
    results: Mapping[str, Result]
    figures: Mapping[str, Figure | None]
    sections: Sequence[ReportSection]

    def write(self, out: Path, **more: object) -> None:
        """Write ``out/report.html``, ``out/statistics.json`` (including ``more``) and ``out/figures/*.svg``.

        Equal reports give equal bytes. Figures of an earlier report that this one lacks are removed.
        """
        (out / FIGURES).mkdir(parents=True, exist_ok=True)
        for name, figure in self.figures.items():
            write_or_remove(out / FIGURES / f"{name}.svg", figure.svg.encode() if figure else None)
        queries = {
            name: {"caption": result.query.caption, "sql": result.query.sql, "rows": result.rows}
            for name, result in self.results.items()
        }
        told = {"schema_version": SCHEMA_VERSION, "prelude": self.prelude, "queries": queries, **more}
        write_bytes_atomically(out / NUMBERS, canonical_json(told).encode())
        write_bytes_atomically(out / REPORT, _Page(self).html().encode())


def write_or_remove(path: Path, content: bytes | None) -> None:
    """Write a file, or remove it if ``content`` is None."""
    if content is None:
        path.unlink(missing_ok=True)
    else:
        write_bytes_atomically(path, content)


class _Page:
    """Writes the page, and numbers tables and figures in order."""

    def __init__(self, report: Report):
        self.report = report
        self.tables = self.figures = 0

    def html(self) -> str:
        title = self.report.title
        style = resources.files("manitwin.dataset.statistics").joinpath("report.css").read_text(encoding="utf-8")
        links = "".join(f'<li><a href="#{s.anchor}">{escape(s.title)}</a></li>' for s in self.report.sections)
        return (
            f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
            f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
            f"<style>\n{style}</style>\n</head>\n<body>\n<header>\n<h1>{escape(title)}</h1>\n"
            + "".join(f"<p>{escape(line)}</p>\n" for line in self.report.lead)
            + f'<nav aria-label="Sections"><ul>{links}</ul></nav>\n</header>\n<main>\n'
            + "".join(self._section(section) for section in self.report.sections)
            + '<section id="reproduce">\n<h2>Every number again</h2>\n<p>Each table and figure has its SQL below it '
            "(DuckDB); statistics.json has the same SQL with all its rows. It asks "
            f"{self.report.views}, after these macros:</p>\n"
            f"<pre><code>{escape(self.report.prelude)}</code></pre>\n</section>\n</main>\n</body>\n</html>\n"
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
        note = f"The {len(shown)} nearest. " if near.pairs > len(shown) else ""
        note += f"Found by {near.found_by}."
        return f"<div>\n{self._rows('near_duplicates', caption, _PAIR_COLUMNS, shown, note)}</div>\n"

    def _figure(self, figure: Figure) -> str:
        self.figures += 1
        queries = (self.report.results[name].query for name in figure.queries)
        sql = "".join(_sql(query) for query in queries if not query.columns)  # a table shows its own SQL
        return (
            f'<figure id="figure-{figure.name}">\n{themed_svg(figure.svg)}\n'
            f"<figcaption><b>Figure {self.figures}.</b> {escape(figure.caption)}</figcaption>\n{sql}</figure>\n"
        )


def _sql(query: Query) -> str:
    return (
        f"<details><summary>SQL: {escape(query.name)}</summary><pre><code>{escape(query.sql)}</code></pre></details>\n"
    )


def _cells(columns: Sequence[Column], row: Row) -> list[str]:
    first = columns[0]
    head = f'<th scope="row" class="{first.kind}">{html_cell(first, row)}</th>'
    return [head, *(f'<td class="{column.kind}">{html_cell(column, row)}</td>' for column in columns[1:])]


def html_cell(column: Column, row: Row) -> str:
    """Return the content of a cell as HTML."""
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
        return one_line(value)
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
    """Write a number with three significant digits; whole numbers and large numbers without decimals."""
    if value == round(value) or abs(value) >= 1000:
        return f"{value:,.0f}"
    return f"{value:#.3g}".rstrip(".")
