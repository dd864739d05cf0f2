"""Scatter and interval plots of mass against size and against the priors of the categories."""

from __future__ import annotations

from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle

from manitwin.dataset.statistics.query import Result, Row
from manitwin.dataset.statistics.style import (
    BLUE,
    CYAN,
    FULL_IN,
    GREEN,
    GREY,
    INK,
    PURPLE,
    RED,
    SURFACE,
    YELLOW,
    Figure,
    canvas,
    export_figure,
    legend_above,
    logarithmic_axis,
    row_canvas,
    shortened,
)

_MOST_CATEGORIES, _MOST_INTERVALS, _MOST_BANDS = 40, 200, 60
_SOURCES = {
    "measured": (GREEN, "o"),
    "user": (PURPLE, "s"),
    "vlm": (RED, "^"),
    "prior": (BLUE, "o"),
    "density*volume": (YELLOW, "D"),
    "default": (INK, "X"),
}
_ANOTHER = (GREY, "v")


def mass_and_size(sample: Result, priors: Result) -> Figure | None:
    """Draw mass against the longest side, coloured by the source of the mass, over the priors' intervals of both."""
    rows = sample.rows
    if not rows:
        return None
    figure, (axis,) = canvas(FULL_IN, 4.4)
    for band in priors.rows[:_MOST_BANDS]:
        corner = (band["size_low_m"], band["mass_low_kg"])
        extent = (band["size_high_m"] - corner[0], band["mass_high_kg"] - corner[1])
        axis.add_patch(Rectangle(corner, *extent, facecolor=(CYAN, 0.06), edgecolor=(CYAN, 0.35), linewidth=0.6))
    said = {row["source"] for row in rows}
    present = [*(source for source in _SOURCES if source in said), *sorted(said - set(_SOURCES))]
    if len(rows) <= _MOST_INTERVALS:
        _points_with_intervals(axis, rows, present)
    else:  # drawn in sample order, so that no source hides another
        colors = [_SOURCES.get(row["source"], _ANOTHER)[0] for row in rows]
        places = [row["longest_m"] for row in rows], [row["mass_kg"] for row in rows]
        axis.scatter(*places, s=8, c=colors, alpha=0.7, linewidths=0, zorder=3)
    _limits(axis, rows)
    logarithmic_axis(axis, "x", "longest side, m")
    logarithmic_axis(axis, "y", "mass, kg")
    axis.grid()
    handles = _legend(present, len(rows), bool(priors.rows))
    legend_above(axis, 4, handles=handles)
    bands = min(len(priors.rows), _MOST_BANDS)
    alt = (
        f"Scatter of mass against longest side of {len(rows)} twins, both axes logarithmic, over the intervals that the "
        f"priors of {bands} categories give. Masses said by: "
        + ", ".join(f"{source} {sum(row['source'] == source for row in rows)}" for source in present)
        + "."
    )
    shown = f" of the {bands} most frequent categories" if len(priors.rows) > bands else " of the categories"
    caption = (
        f"Mass against longest side, over the intervals that the priors{shown} have of both: darker where more overlap."
    )
    return export_figure(figure, "mass_and_size", caption, alt, sample, priors)


def _points_with_intervals(axis: Axes, rows: list[Row], present: list[str]) -> None:
    for row in rows:
        axis.plot(
            [row["longest_m"]] * 2, [row["mass_low_kg"], row["mass_high_kg"]], color=GREY, linewidth=0.8, zorder=2
        )
    for source in present:
        color, marker = _SOURCES.get(source, _ANOTHER)
        chosen = [row for row in rows if row["source"] == source]
        places = [row["longest_m"] for row in chosen], [row["mass_kg"] for row in chosen]
        axis.scatter(*places, s=26, c=color, marker=marker, edgecolors=SURFACE, linewidths=0.4, zorder=3)


def _limits(axis: Axes, rows: list[Row]) -> None:
    sides = [row["longest_m"] for row in rows]
    lows, highs = [row["mass_low_kg"] for row in rows], [row["mass_high_kg"] for row in rows]
    low = min(value for value in (*lows, *(row["mass_kg"] for row in rows)) if value > 0)
    axis.set_xlim(min(sides) / 1.4, max(sides) * 1.4)
    axis.set_ylim(low / 1.5, max(highs) * 1.5)


def _legend(present: list[str], count: int, priors: bool) -> list[Line2D | Patch]:
    few = count <= _MOST_INTERVALS
    said: list[Line2D | Patch] = []
    for source in present:
        color, marker = _SOURCES.get(source, _ANOTHER)
        label = f"mass: {shortened(source, 16)}"
        said.append(Line2D([], [], color=color, marker=marker if few else "o", linestyle="", markersize=5, label=label))
    if few:
        said.append(Line2D([], [], color=GREY, linewidth=0.8, label="its interval"))
    if priors:
        said.append(Patch(facecolor=CYAN, alpha=0.25, label="prior of a category"))
    return said


def mass_by_category(priors: Result) -> Figure | None:
    """Draw the twins' masses per category beside the interval of the prior."""
    rows = priors.rows[:_MOST_CATEGORIES]
    if not rows:
        return None
    names = [f"{shortened(row['category'])} ({row['twins']:,})" for row in rows]
    figure, axis = row_canvas(names, frame_in=0.95)
    for y, row in enumerate(rows):
        axis.barh(
            y, row["mass_high_kg"] - row["mass_low_kg"], left=row["mass_low_kg"], height=0.62, color=CYAN, alpha=0.35
        )
        axis.plot([row["mass_typical_kg"]] * 2, [y - 0.31, y + 0.31], color=CYAN, linewidth=1.4)
        axis.plot([row["p10_kg"], row["p90_kg"]], [y, y], color=BLUE, linewidth=1.6)
        axis.plot(row["median_kg"], y, "o", color=BLUE, markersize=4)
    ends = [row[key] for row in rows for key in ("mass_low_kg", "mass_high_kg", "p10_kg", "p90_kg") if row[key] > 0]
    axis.set_xlim(min(ends) / 1.3, max(ends) * 1.3)
    logarithmic_axis(axis, "x", "mass, kg")
    axis.grid(axis="x")
    handles = [
        Patch(facecolor=CYAN, alpha=0.35, label="prior's interval"),
        Line2D([], [], color=CYAN, linewidth=1.4, label="typical"),
        Line2D([], [], color=BLUE, marker="o", markersize=4, linewidth=1.6, label="twins: median, p10 to p90"),
    ]
    legend_above(axis, 3, handles=handles)
    alt = "Masses by category beside the prior. " + " ".join(
        f"{row['category']}: median {row['median_kg']:.2g} kg, prior {row['mass_low_kg']:.2g} to {row['mass_high_kg']:.2g} kg."
        for row in rows[:10]
    )
    caption = "Masses of the twins of a category (their number in brackets) beside the interval of its prior."
    return export_figure(figure, "mass_by_category", caption, alt, priors)
