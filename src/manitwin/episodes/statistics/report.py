"""Statistics report of an episodes folder, as terminal text or as an HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from html import unescape
from pathlib import Path

from manitwin.dataset.index.conditions import sql_text
from manitwin.dataset.statistics.page import (
    FIGURES,
    REPORT,
    Report,
    ReportSection,
    html_cell,
    report_section,
    write_or_remove,
)
from manitwin.dataset.statistics.query import Column, ReportTables, Result, Row
from manitwin.dataset.statistics.style import Figure, report_style
from manitwin.episodes.attempts import ATTEMPTS, REMEDY, SCHEMA
from manitwin.episodes.statistics import figures as drawn
from manitwin.episodes.statistics import queries as q
from manitwin.episodes.statistics.joint_ranges import joint_ranges
from manitwin.errors import EpisodesError
from manitwin.formats.parquet_file import check_parquet

_WIDEST, _MOST_ROWS, _BAR = 110, 20, 40

LENGTHS_PICTURE = "lengths.png"
VIEWS = (
    "the view <code>attempts</code>, which is attempts.parquet, and <code>joints</code>, whose rows are read out of the "
    "recorded episodes"
)
EPISODE_FILES = "batches/*/*/episodes.h5"
_MERGED = "maniskill/trajectory.h5"
_PRINTED = (
    *(
        "funnel",
        "outcomes",
        "plan_failures",
        "by_skill",
        "by_robot",
        "by_category",
        "never_kept",
        "by_grasp_type",
        "by_others",
    ),
    *("placement", "joints", "grasps", "beside_the_paper"),
)


def table_text(result: Result) -> str:
    """Return a table as plain text with caption, header, rows and note of omitted rows; empty if there are no rows."""
    columns, rows = result.query.columns, result.rows[:_MOST_ROWS]
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
    """Return a histogram as plain text with a bar of # for each label."""
    if not rows:
        return ""
    most, width = max(count for _, count in rows), max(len(label) for label, _ in rows)
    bars = [f"{label.rjust(width)}  {'#' * -(-_BAR * count // most)} {count:,}" for label, count in rows]
    return "\n".join([caption, *bars]) + "\n"


def _cell(column: Column, row: Row) -> str:
    html = html_cell(column, row)
    plain = unescape(html.replace('<span class="interval">', "").replace("</span>", ""))
    return plain if len(plain) <= _WIDEST else plain[: _WIDEST - 1] + "…"


@dataclass(frozen=True)
class EpisodeReport:
    """Results of all queries by name."""

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
        """Return the tables and the length histogram for a terminal."""
        counted = {row["step"]: row["episodes"] for row in self.results[q.LENGTH_HISTOGRAM.name].rows}
        every = range(min(counted, default=0), max(counted, default=-1) + 1)
        steps = [(f"{step * q.LENGTH_STEP_S:.1f} s", counted.get(step, 0)) for step in every]
        tables = [table_text(self.results[name]) for name in _PRINTED]
        tables.insert(-3, histogram_text(q.LENGTH_HISTOGRAM.caption, steps))
        return "\n".join([self.summary + "\n", *filter(None, tables)])

    def write(self, out: Path) -> Path:
        """Write ``report.html``, ``statistics.json`` and ``figures/`` into a folder; return the path of the page."""
        with report_style():
            figures, lengths_png = self._draw()
        lead, sections = [self.summary], self._sections(figures)
        Report(self.title, lead, q.PRELUDE, VIEWS, self.results, figures, sections).write(out)
        write_or_remove(out / FIGURES / LENGTHS_PICTURE, lengths_png)
        return out / REPORT

    def _draw(self) -> tuple[dict[str, Figure | None], bytes | None]:
        of = self.results.__getitem__
        lengths, lengths_png = drawn.lengths(of("length_histogram"), of("lengths")) or (None, None)
        figures = {
            "outcomes": drawn.outcomes(of("outcomes")),
            "categories": drawn.categories(of("by_category")),
            "lengths": lengths,
            "placement": drawn.placement(of("placement_histogram"), of("placement")),
        }
        return figures, lengths_png

    def _sections(self, figures: dict[str, Figure | None]) -> list[ReportSection]:
        section = partial(report_section, self.results, figures, empty="There is nothing to count.")
        return [
            section("attempts", "Attempts", "funnel", "figure:outcomes", "outcomes", "plan_failures"),
            section("paper", "Beside the paper", "beside_the_paper"),
            section(
                *(
                    "success",
                    "Success",
                    "by_skill",
                    "by_robot",
                    "figure:categories",
                    "by_category",
                    "by_grasp_type",
                    "by_others",
                ),
                "by_object",
            ),
            section("never", "Objects without a kept episode", "never_kept", empty="Every object has one."),
            section(
                *("episodes", "Lengths, placement and joints"),
                *(("lengths", "placement"), "lengths", "placement", "joints"),
                empty="No episode was kept.",
            ),
            section("grasps", "Grasps", "grasps", "failed_grasps"),
        ]


_REMEDY = f"run manitwin trajectories again, or {REMEDY}"


def episode_statistics(folder: Path) -> EpisodeReport:
    """Run all queries on an episodes folder; raises EpisodesError if it has no table of attempts."""
    attempts = folder / ATTEMPTS
    if not attempts.is_file():
        raise EpisodesError(
            f"{folder}: no {ATTEMPTS}, so this is not a folder of finished episodes; run manitwin trajectories"
        )
    files = sorted(folder.glob(EPISODE_FILES)) or [path for path in [folder / _MERGED] if path.is_file()]
    check_parquet(attempts, EpisodesError, schema=SCHEMA, remedy=_REMEDY, inside=folder)
    views = {"attempts": f"read_parquet({sql_text(str(attempts))})", "joints": joint_ranges(files)}
    tables = ReportTables(views, prelude=q.PRELUDE, remedy=_REMEDY)
    title = f"Statistics of the episodes in {folder.resolve().name}"
    return EpisodeReport(title, {query.name: tables.result(query) for query in q.QUERIES})
