"""The statistics of a folder of episodes: asked once, printed as text or written as a page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape, unescape
from pathlib import Path
from typing import Any

from manitwin.dataset.index.query import sql_text
from manitwin.dataset.statistics.page import Page, ReportSection, SectionPart, written
from manitwin.dataset.statistics.query import Column, ReportTables, Result, Row
from manitwin.dataset.statistics.style import Figure, drawing
from manitwin.episodes.attempts import ATTEMPTS
from manitwin.episodes.statistics import figures as drawn
from manitwin.episodes.statistics import queries as q
from manitwin.episodes.statistics.joint_ranges import joint_ranges
from manitwin.errors import EpisodesError
from manitwin.twin.store import canonical_json, write_bytes_atomically

_WIDEST = 110
_BAR = 40

FOLDER, PAGE, NUMBERS, FIGURES = "statistics", "report.html", "statistics.json", "figures"
LENGTHS_PICTURE = "lengths.png"
SCHEMA_VERSION = 1
EPISODE_FILES = "batches/*/*/episodes.h5"
_MERGED = "maniskill/trajectory.h5"
_PRINTED = (
    *("funnel", "outcomes", "plan_failures", "by_robot", "by_category", "never_kept", "by_grasp_type", "by_others"),
    *("placement", "joints", "grasps", "beside_the_paper"),
)


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


@dataclass(frozen=True)
class EpisodeReport:
    """The result of every query by its name."""

    title: str
    results: dict[str, Result]

    @property
    def summary(self) -> str:
        """The report in one sentence."""
        steps = {row["step"]: row["attempts"] for row in self.results["funnel"].rows}
        if not steps["attempted"]:
            return "No episode was attempted: there is nothing to count."
        executed, succeeded = steps["planned and executed"], steps["succeeded"]
        rate = f" ({100 * succeeded / executed:.1f} %)" if executed else ""
        never = len(self.results["never_kept"].rows)
        without = f"; {never:,} objects have no kept episode" if never else "; every object has a kept episode"
        return (
            f"{steps['attempted']:,} episodes attempted, {executed:,} planned and executed, {succeeded:,} of these succeeded"
            f"{rate}, {steps['kept']:,} kept{without}."
        )

    def text(self) -> str:
        """Return all that fits a terminal: tables, and the histogram of lengths."""
        counted = {row["step"]: row["episodes"] for row in self.results[q.LENGTH_HISTOGRAM.name].rows}
        every = range(min(counted, default=0), max(counted, default=-1) + 1)
        steps = [(f"{step * q.LENGTH_STEP_S:.1f} s", counted.get(step, 0)) for step in every]
        tables = [table_text(self.results[name]) for name in _PRINTED]
        tables.insert(-3, histogram_text(q.LENGTH_HISTOGRAM.caption, steps))
        return "\n".join([self.summary + "\n", *filter(None, tables)])

    def numbers(self) -> dict[str, Any]:
        """Return what statistics.json holds: every query with its SQL and all its rows."""
        told = {
            name: {"caption": result.query.caption, "sql": result.query.sql, "rows": result.rows}
            for name, result in self.results.items()
        }
        return {"schema_version": SCHEMA_VERSION, "prelude": q.PRELUDE, "queries": told}

    def write(self, out: Path) -> Path:
        """Write ``report.html``, ``statistics.json`` and ``figures/`` into a folder; return the page.

        The same results give the same bytes. Figures of an earlier report that this one does not have are removed.
        """
        with drawing():
            figures, lengths_png = self._draw()
        (out / FIGURES).mkdir(parents=True, exist_ok=True)
        files = {f"{name}.svg": figure.svg.encode() if figure else None for name, figure in figures.items()}
        for name, content in {**files, LENGTHS_PICTURE: lengths_png}.items():
            if content is None:
                (out / FIGURES / name).unlink(missing_ok=True)
            else:
                write_bytes_atomically(out / FIGURES / name, content)
        undrawn = {name: result.query for name, result in self.results.items() if not result.query.columns}
        page = EpisodePage(q.PRELUDE, undrawn).html(self.title, [self.summary], self._sections(figures))
        write_bytes_atomically(out / NUMBERS, canonical_json(self.numbers()).encode())
        write_bytes_atomically(out / PAGE, page.encode())
        return out / PAGE

    def _draw(self) -> tuple[dict[str, Figure | None], bytes | None]:
        of = self.results.__getitem__
        lengths = drawn.lengths(of("length_histogram"), of("lengths"))
        figures = {
            "outcomes": drawn.outcomes(of("outcomes")),
            "categories": drawn.categories(of("by_category")),
            "lengths": lengths[0] if lengths else None,
            "placement": drawn.placement(of("placement_histogram"), of("placement")),
        }
        return figures, lengths[1] if lengths else None

    def _sections(self, figures: dict[str, Figure | None]) -> list[ReportSection]:
        def parts(*names: str) -> tuple[SectionPart, ...]:
            found: list[SectionPart] = []
            for name in names:
                if not name.startswith("figure:"):
                    found.append(self.results[name])
                elif figure := figures[name.removeprefix("figure:")]:
                    found.append(figure)
            return tuple(found)

        beside = tuple(figure for name in ("lengths", "placement") if (figure := figures[name]))
        nothing = "There is nothing to count."
        return [
            ReportSection(
                "attempts", "Attempts", nothing, parts("funnel", "figure:outcomes", "outcomes", "plan_failures")
            ),
            ReportSection("paper", "Beside the paper", nothing, parts("beside_the_paper")),
            ReportSection(
                *("success", "Success", nothing),
                parts(*("by_robot", "figure:categories", "by_category", "by_grasp_type", "by_others", "by_object")),
            ),
            ReportSection(
                "never", "Objects without a kept episode", "Every object has one.", _filled(parts("never_kept"))
            ),
            ReportSection(
                *("episodes", "Lengths, placement and joints", "No episode was kept."),
                (*((beside,) if beside else ()), *parts("lengths", "placement", "joints")),
            ),
            ReportSection("grasps", "Grasps", nothing, parts("grasps", "failed_grasps")),
        ]


def _filled(parts: Sequence[SectionPart]) -> tuple[SectionPart, ...]:
    return tuple(part for part in parts if not isinstance(part, Result) or part.rows)


def episode_statistics(folder: Path) -> EpisodeReport:
    """Ask everything of a folder of episodes; raises EpisodesError where it has no table of attempts."""
    attempts = folder / ATTEMPTS
    if not attempts.is_file():
        raise EpisodesError(
            f"{folder}: no {ATTEMPTS}, so this is no folder of finished episodes; run manitwin trajectories"
        )
    files = sorted(folder.glob(EPISODE_FILES)) or [path for path in [folder / _MERGED] if path.is_file()]
    views = {"attempts": f"read_parquet({sql_text(str(attempts))})", "joints": joint_ranges(files)}
    tables = ReportTables(views, prelude=q.PRELUDE)
    title = f"Statistics of the episodes in {folder.resolve().name}"
    return EpisodeReport(title, {query.name: tables.result(query) for query in q.QUERIES})
