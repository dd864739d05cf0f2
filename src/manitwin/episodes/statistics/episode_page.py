"""The report as one HTML page, in the style of the statistics of a set of twins, and as text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape, unescape

from manitwin.dataset.statistics.page import Page, written
from manitwin.dataset.statistics.query import Column, Result, Row

_WIDEST = 110
_BAR = 40


class EpisodePage(Page):
    """The page of a folder of episodes: its last section says where these numbers come from."""

    def _reproduce(self) -> str:
        return (
            '<section id="reproduce">\n<h2>Every number again</h2>\n<p>Each table and figure has its SQL below it '
            "(DuckDB); statistics.json has the same SQL with all its rows. It asks the view <code>attempts</code>, which is "
            "attempts.parquet, and <code>joints</code>, whose rows are read out of the recorded episodes, after these "
            f"macros:</p>\n<pre><code>{escape(self.prelude)}</code></pre>\n</section>\n"
        )


def table_text(result: Result, most: int = 20) -> str:
    """Return a table as plain text: its caption, its head, its rows, its note; empty where there are no rows."""
    columns, rows = result.query.columns, result.rows[:most]
    if not columns or not rows:
        return ""
    cells = [[column.heading for column in columns], *([_cell(column, row) for column in columns] for row in rows)]
    widths = [max(len(row[place]) for row in cells) for place in range(len(columns))]
    lines = [
        "  ".join(
            cell.ljust(width) if column.kind == "text" else cell.rjust(width)
            for cell, width, column in zip(row, widths, columns, strict=True)
        ).rstrip()
        for row in cells
    ]
    more = len(result.rows) - len(rows)
    last = [f"... and {more:,} more"] if more else []
    return "\n".join([result.query.caption, lines[0], "-" * len(lines[0]), *lines[1:], *last]) + "\n"


def histogram_text(caption: str, rows: Sequence[tuple[str, int]]) -> str:
    """Return a histogram as plain text: a bar of # for every label."""
    if not rows:
        return ""
    most, width = max(count for _, count in rows), max(len(label) for label, _ in rows)
    bars = [f"{label.rjust(width)}  {'#' * -(-_BAR * count // most)} {count:,}" for label, count in rows]
    return "\n".join([caption, *bars]) + "\n"


def _cell(column: Column, row: Row) -> str:
    html = written(column, row)
    plain = unescape(html.replace('<span class="interval">', "").replace("</span>", ""))
    return plain if len(plain) <= _WIDEST else plain[: _WIDEST - 1] + "…"
