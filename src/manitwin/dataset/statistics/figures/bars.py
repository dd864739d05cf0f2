"""Horizontal bars: stages, reasons, outcomes, categories, cost."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from manitwin.dataset.statistics.query import Result
from manitwin.dataset.statistics.style import (
    BLUE,
    FULL_IN,
    GREY,
    RED,
    Figure,
    canvas,
    count_axis,
    plain_number,
    shortened,
    to_svg,
)

Finish = Callable[[str, str, str, tuple[str, ...]], Figure]

_ROW_IN, _FRAME_IN = 0.22, 0.75
MOST_CATEGORIES, MOST_REASONS = 40, 20


def success_by_stage(result: Result) -> Figure | None:
    """Draw what passed and what was rejected at every stage; None where nothing was given."""
    rows = [row for row in result.rows if row["entered"]]
    if not rows:
        return None
    axis, finish = _rows_axis([row["stage"] for row in rows])
    passed, rejected = ([row[key] for row in rows] for key in ("passed", "rejected"))
    where = np.arange(len(rows))
    axis.barh(where, passed, color=BLUE, height=0.7, label="passed")
    axis.barh(where, rejected, left=passed, color=RED, height=0.7, label="rejected")
    for y, row in enumerate(rows):
        _label(axis, row["entered"], y, f"{100 * row['passed_share']:.1f} %")
    axis.margins(x=0.12)
    count_axis(axis, "x", "items that entered the stage")
    _legend_above(axis, 2)
    first, last = rows[0], rows[-1]
    alt = (
        f"Bars of the items that entered each stage. {first['entered']} entered {first['stage']}; "
        f"{last['passed']} passed {last['stage']}. "
        + " ".join(f"{row['stage']}: {row['passed']} passed, {row['rejected']} rejected." for row in rows)
    )
    return finish(
        "success_by_stage",
        "Items that entered each stage, passed and rejected, and the share that passed.",
        alt,
        (result.query.name,),
    )


def rejections(result: Result) -> Figure | None:
    """Draw the reasons of rejection, most frequent first."""
    rows = sorted(result.rows, key=lambda row: (-row["items"], row["stage"], row["reason"]))[:MOST_REASONS]
    if not rows:
        return None
    names = [f"{row['stage']}: {row['reason'].replace('_', ' ')}" for row in rows]
    return _simple(
        "rejections",
        "Why items were rejected.",
        names,
        [row["items"] for row in rows],
        "rejected items",
        (result.query.name,),
        color=RED,
    )


def outcomes(result: Result) -> Figure | None:
    """Draw how grasps fail: of the filtered ones and of the unfiltered sample, as shares of the failed."""
    rows = result.rows
    if not rows:
        return None
    axis, finish = _rows_axis([row["outcome"] for row in rows], row_in=0.34)
    where = np.arange(len(rows))
    series = (("filtered", "filtered_share", BLUE, -0.2), ("unfiltered sample", "unfiltered_share", GREY, 0.2))
    for label, key, color, offset in series:
        axis.barh(where + offset, [100 * (row[key] or 0) for row in rows], height=0.38, color=color, label=label)
    axis.set_xlabel("of failed grasps, %")
    axis.grid(axis="x")
    _legend_above(axis, 2)
    alt = "Bars of the outcomes of failed grasps. " + " ".join(
        f"{row['outcome']}: {row['filtered']} filtered, {row['unfiltered_sample']} unfiltered." for row in rows
    )
    return finish("failed_outcomes", "How grasps fail, with and without the filters.", alt, (result.query.name,))


def categories(result: Result) -> Figure | None:
    """Draw the most frequent categories."""
    rows = result.rows[:MOST_CATEGORIES]
    if not rows:
        return None
    some = f"The {len(rows)} most frequent of {len(result.rows)} categories."
    caption = some if len(result.rows) > len(rows) else "Categories of accepted twins."
    names = [row["category"] for row in rows]
    return _simple(
        "categories", caption, names, [row["twins"] for row in rows], "accepted twins", (result.query.name,), color=BLUE
    )


def cost(result: Result) -> Figure | None:
    """Draw the mean CPU time of every stage."""
    rows = [row for row in result.rows if row["cpu_mean"] is not None]
    if not rows:
        return None
    return _simple(
        "cost_by_stage",
        "Mean CPU time of each stage, over the items that it ran on.",
        [row["stage"] for row in rows],
        [row["cpu_mean"] for row in rows],
        "mean CPU time, s",
        (result.query.name,),
        color=BLUE,
        counts=False,
    )


def _simple(
    name: str,
    caption: str,
    names: Sequence[str],
    values: Sequence[float],
    label: str,
    queries: tuple[str, ...],
    *,
    color: str,
    counts: bool = True,
) -> Figure:
    axis, finish = _rows_axis(names)
    axis.barh(np.arange(len(names)), values, color=color, height=0.7)
    for y, value in enumerate(values):
        _label(axis, value, y, f"{value:,}" if counts else plain_number(float(f"{value:.2g}")))
    if counts:
        count_axis(axis, "x", label)
    else:
        axis.set_xlabel(label)
        axis.grid(axis="x")
    axis.margins(x=0.12)
    axis.set_xlim(0, None)
    listed = "; ".join(f"{n} {plain_number(v)}" for n, v in list(zip(names, values, strict=True))[:10])
    more = f"; and {len(names) - 10} more" if len(names) > 10 else ""
    return finish(name, caption, f"Bars of {label}: {listed}{more}.", queries)


def _rows_axis(names: Sequence[str], row_in: float = _ROW_IN) -> tuple[Axes, Finish]:
    """Return an axis with a row a name, the first on top, and the function that finishes the figure."""
    figure, (axis,) = canvas(FULL_IN, _FRAME_IN + row_in * max(len(names), 2))
    axis.set_yticks(np.arange(len(names)), [shortened(name) for name in names])
    axis.set_ylim(len(names) - 0.4, -0.6)
    axis.tick_params(axis="y", length=0)

    def finish(name: str, caption: str, alt: str, queries: tuple[str, ...]) -> Figure:
        return Figure(name, caption, alt, queries, to_svg(figure, name, alt))

    return axis, finish


def _label(axis: Axes, x: float, y: float, words: str) -> None:
    """Write beside the end of a bar."""
    axis.annotate(words, (x, y), (3, 0), textcoords="offset points", va="center")


def _legend_above(axis: Axes, columns: int) -> None:
    axis.legend(loc="lower left", bbox_to_anchor=(0, 1.0), ncols=columns, borderaxespad=0.2, handlelength=1)
