"""Figures of the statistics report: lengths, placement errors, outcomes, and success by category."""

from __future__ import annotations

import io

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Canvas

from manitwin.dataset.statistics.query import Result
from manitwin.dataset.statistics.style import (
    BLUE,
    GREY,
    HALF_IN,
    INK,
    RED,
    Figure,
    canvas,
    count_axis,
    export_figure,
    label_bar,
    legend_above,
    row_canvas,
    shortened,
)
from manitwin.episodes.statistics.queries import LENGTH_STEP_S

PAPER_LENGTH_S = 7.6
_HEIGHT_IN = 2.4
_PIXELS_PER_INCH = 150
_MOST_CATEGORIES = 40


def lengths(histogram: Result, summary: Result) -> tuple[Figure, bytes] | None:
    """Plot the lengths of kept episodes with the paper's mean; return a figure of the page and a PNG."""
    if not histogram.rows:
        return None
    figure, axis = _histogram(histogram, LENGTH_STEP_S)
    (row,) = (row for row in summary.rows if row["quantity"] == "length, s")
    for value, color, label in ((row["mean"], INK, "mean"), (PAPER_LENGTH_S, RED, "paper's mean")):
        axis.axvline(value, color=color, linewidth=1.2, linestyle=(0, (4, 2)), label=f"{label} {value:.1f} s")
    axis.set_xlim(0, None)
    axis.set_xlabel("length, s")
    count_axis(axis, "y", "kept episodes")
    legend_above(axis, 2, handlelength=1.5)
    caption = f"Lengths of kept episodes in steps of {LENGTH_STEP_S} s."
    alt = (
        f"Histogram of the lengths of {row['objects']} kept episodes, from {row['min']:.3g} to {row['max']:.3g} s, "
        f"mean {row['mean']:.3g} s, median {row['median']:.3g} s."
    )
    return export_figure(figure, "lengths", caption, alt, histogram), _png(figure)


def placement(histogram: Result, summary: Result) -> Figure | None:
    """Plot the position errors of succeeded attempts."""
    if not histogram.rows:
        return None
    figure, axis = _histogram(histogram, 1.0)
    axis.set_xlim(0, max(5, max(row["step"] for row in histogram.rows) + 1))
    axis.set_xlabel("position error, mm")
    count_axis(axis, "y", "episodes that succeeded")
    (row,) = (row for row in summary.rows if row["quantity"] == "position error, mm")
    axis.axvline(row["median"], color=INK, linewidth=1.2, linestyle=(0, (4, 2)), label=f"median {row['median']:.2g} mm")
    legend_above(axis, 1, handlelength=1.5)
    alt = (
        f"Histogram of the position errors of {row['objects']} episodes, median {row['median']:.3g} mm, 90 % below "
        f"{row['p90']:.3g} mm, largest {row['max']:.3g} mm."
    )
    caption = "Position errors of objects that were placed, in steps of 1 mm."
    return export_figure(figure, "placement", caption, alt, histogram)


def outcomes(result: Result) -> Figure | None:
    """Plot the attempts by outcome."""
    rows = [row for row in result.rows if row["attempts"]]
    if not rows:
        return None
    figure, axis = row_canvas([shortened(row["outcome"].replace("_", " ")) for row in rows])
    colors = [BLUE if row["outcome"] == "kept" else RED for row in rows]
    axis.barh(np.arange(len(rows)), [row["attempts"] for row in rows], color=colors, height=0.7)
    for y, row in enumerate(rows):
        label_bar(axis, row["attempts"], y, f"{row['attempts']:,} ({100 * row['share']:.1f} %)")
    axis.margins(x=0.15)
    count_axis(axis, "x", "attempts")
    alt = "Bars of attempts by outcome: " + "; ".join(f"{row['outcome']} {row['attempts']}" for row in rows) + "."
    return export_figure(figure, "outcomes", "What became of the attempts.", alt, result)


def categories(result: Result) -> Figure | None:
    """Plot attempted and kept episodes for the most attempted categories."""
    rows = result.rows[:_MOST_CATEGORIES]
    if not rows:
        return None
    figure, axis = row_canvas([shortened(row["category"].replace("_", " ")) for row in rows])
    where = np.arange(len(rows))
    axis.barh(where, [row["attempted"] for row in rows], color=GREY, alpha=0.45, height=0.7, label="attempted")
    axis.barh(where, [row["kept"] for row in rows], color=BLUE, height=0.7, label="kept")
    for y, row in enumerate(rows):
        label_bar(axis, row["attempted"], y, f"{100 * row['kept_share']:.0f} %")
    axis.margins(x=0.1)
    count_axis(axis, "x", "episodes")
    legend_above(axis, 2, handlelength=1)
    listed = "; ".join(f"{row['category']}: {row['kept']} of {row['attempted']}" for row in rows[:15])
    more = len(result.rows) - len(rows)
    caption = "Attempted and kept episodes by category" + (f"; {more} more are in the table." if more else ".")
    alt = f"Bars of kept episodes of those attempted by category. {listed}."
    return export_figure(figure, "categories", caption, alt, result)


def _histogram(result: Result, width: float) -> tuple[Canvas, Axes]:
    figure, (axis,) = canvas(HALF_IN, _HEIGHT_IN)
    starts, counts = ([row[key] for row in result.rows] for key in ("step", "episodes"))
    axis.bar([start * width for start in starts], counts, width=0.92 * width, align="edge", color=BLUE)
    return figure, axis


def _png(figure: Canvas) -> bytes:
    stream = io.BytesIO()
    figure.savefig(stream, format="png", dpi=_PIXELS_PER_INCH, metadata={"Software": None})
    return stream.getvalue()
