"""Horizontal bar charts: stages, rejection reasons, outcomes, categories, cost."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from manitwin.dataset.statistics.query import Result
from manitwin.dataset.statistics.style import (
    BLUE,
    GREY,
    RED,
    Figure,
    count_axis,
    export_figure,
    label_bar,
    legend_above,
    plain_number,
    row_canvas,
    shortened,
)

MOST_CATEGORIES, MOST_REASONS = 40, 20


def success_by_stage(result: Result) -> Figure | None:
    """Draw the passed and rejected items of every stage; None if there are no items."""
    rows = [row for row in result.rows if row["entered"]]
    if not rows:
        return None
    figure, axis = row_canvas([shortened(row["stage"]) for row in rows])
    passed, rejected = ([row[key] for row in rows] for key in ("passed", "rejected"))
    where = np.arange(len(rows))
    axis.barh(where, passed, color=BLUE, height=0.7, label="passed")
    axis.barh(where, rejected, left=passed, color=RED, height=0.7, label="rejected")
    for y, row in enumerate(rows):
        label_bar(axis, row["entered"], y, f"{100 * row['passed_share']:.1f} %")
    axis.margins(x=0.12)
    count_axis(axis, "x", "items that entered the stage")
    legend_above(axis, 2, handlelength=1)
    first, last = rows[0], rows[-1]
    alt = (
        f"Bars of the items that entered each stage. {first['entered']} entered {first['stage']}; "
        f"{last['passed']} passed {last['stage']}. "
        + " ".join(f"{row['stage']}: {row['passed']} passed, {row['rejected']} rejected." for row in rows)
    )
    caption = "Items that entered each stage, passed and rejected, and the share that passed."
    return export_figure(figure, "success_by_stage", caption, alt, result)


def rejections(result: Result) -> Figure | None:
    """Draw the reasons of rejection, most frequent first."""
    rows = sorted(result.rows, key=lambda row: (-row["items"], row["stage"], row["reason"]))[:MOST_REASONS]
    values = {f"{row['stage']}: {row['reason'].replace('_', ' ')}": row["items"] for row in rows}
    return _single_bars(result, "rejections", "Why items were rejected.", values, "rejected items", color=RED)


def outcomes(result: Result) -> Figure | None:
    """Draw the failure modes of filtered grasps and of the unfiltered sample, as shares of the failed grasps."""
    rows = result.rows
    if not rows:
        return None
    figure, axis = row_canvas([shortened(row["outcome"]) for row in rows], row_in=0.34)
    where = np.arange(len(rows))
    series = (("filtered", "filtered_share", BLUE, -0.2), ("unfiltered sample", "unfiltered_share", GREY, 0.2))
    for label, key, color, offset in series:
        axis.barh(where + offset, [100 * (row[key] or 0) for row in rows], height=0.38, color=color, label=label)
    axis.set_xlabel("of failed grasps, %")
    axis.grid(axis="x")
    legend_above(axis, 2, handlelength=1)
    alt = "Bars of the outcomes of failed grasps. " + " ".join(
        f"{row['outcome']}: {row['filtered']} filtered, {row['unfiltered_sample']} unfiltered." for row in rows
    )
    return export_figure(figure, "failed_outcomes", "How grasps fail, with and without the filters.", alt, result)


def categories(result: Result) -> Figure | None:
    """Draw the most frequent categories."""
    rows = result.rows[:MOST_CATEGORIES]
    some = f"The {len(rows)} most frequent of {len(result.rows)} categories."
    caption = some if len(result.rows) > len(rows) else "Categories of accepted twins."
    values = {row["category"]: row["twins"] for row in rows}
    return _single_bars(result, "categories", caption, values, "accepted twins", color=BLUE)


def cost(result: Result) -> Figure | None:
    """Draw the mean CPU time of every stage."""
    values = {row["stage"]: row["cpu_mean"] for row in result.rows if row["cpu_mean"] is not None}
    caption = "Mean CPU time of each stage, over the items that it ran on."
    return _single_bars(result, "cost_by_stage", caption, values, "mean CPU time, s", color=BLUE, counts=False)


def _single_bars(
    result: Result,
    name: str,
    caption: str,
    values: Mapping[str, float],
    label: str,
    *,
    color: str,
    counts: bool = True,
) -> Figure | None:
    if not values:
        return None
    figure, axis = row_canvas([shortened(each) for each in values])
    axis.barh(np.arange(len(values)), list(values.values()), color=color, height=0.7)
    for y, value in enumerate(values.values()):
        label_bar(axis, value, y, f"{value:,}" if counts else plain_number(float(f"{value:.2g}")))
    if counts:
        count_axis(axis, "x", label)
    else:
        axis.set_xlabel(label)
        axis.grid(axis="x")
    axis.margins(x=0.12)
    axis.set_xlim(0, None)
    listed = "; ".join(f"{n} {plain_number(v)}" for n, v in list(values.items())[:10])
    more = f"; and {len(values) - 10} more" if len(values) > 10 else ""
    return export_figure(figure, name, caption, f"Bars of {label}: {listed}{more}.", result)
