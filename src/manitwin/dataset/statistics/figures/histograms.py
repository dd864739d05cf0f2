"""Histograms: grasps per object, rates, numbers of points, sizes and masses."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from manitwin.dataset.statistics.query import Result
from manitwin.dataset.statistics.style import (
    BLUE,
    FULL_IN,
    GREY,
    HALF_IN,
    INK,
    Figure,
    canvas,
    count_axis,
    export_figure,
    legend_above,
    logarithmic_axis,
    plain_number,
)

_HEIGHT_IN = 2.4
_BIN = 5


def grasps_per_object(simulated: Result, verified: Result) -> Figure | None:
    """Draw the numbers of simulated and verified grasps per object."""
    if not simulated.rows:
        return None
    figure, (axis,) = canvas(FULL_IN, _HEIGHT_IN)
    top = max(row["low"] for row in (*simulated.rows, *verified.rows)) + _BIN
    edges = np.arange(0, top + _BIN, _BIN)
    axis.stairs(_bin_counts(simulated, "low", edges[:-1]), edges, fill=True, color=GREY, alpha=0.45, label="simulated")
    axis.stairs(_bin_counts(verified, "low", edges[:-1]), edges, color=BLUE, linewidth=1.8, label="verified")
    axis.set_xlim(0, top)
    axis.set_xlabel("grasps per object")
    count_axis(axis, "y", "objects")
    legend_above(axis, 2, handlelength=1)
    alt = "Histograms. " + " ".join(
        f"{label} grasps per object: most often {_mode(r.rows, 'low', 'objects')} to {_mode(r.rows, 'low', 'objects') + _BIN}."
        for r, label in ((simulated, "Simulated"), (verified, "Verified"))
    )
    caption = f"Grasps per object in steps of {_BIN}: simulated, and of these verified."
    return export_figure(figure, "grasps_per_object", caption, alt, simulated, verified)


def counts_per_object(results: Sequence[Result]) -> Figure | None:
    """Draw the numbers of functional points, grasp points and placements per object."""
    if not any(result.rows for result in results):
        return None
    figure, axes = canvas(FULL_IN, 2.1, len(results))
    said = []
    for axis, result in zip(axes, results, strict=True):
        label = result.query.name.removesuffix("_histogram").replace("_", " ")
        numbers = [row["number"] for row in result.rows]
        axis.bar(numbers, [row["objects"] for row in result.rows], color=BLUE, width=0.7)
        axis.set_xticks(range(min(numbers), max(numbers) + 1) if numbers else [])
        axis.set_xlabel(f"{label} per object")
        count_axis(axis, "y", "objects" if axis is axes[0] else "")
        said.append(f"{label}: " + ", ".join(f"{row['objects']} with {row['number']}" for row in result.rows))
    alt = f"Bars of objects by number. {'; '.join(said)}."
    caption = "Functional points, grasp points and placements per object."
    return export_figure(figure, "points_per_object", caption, alt, *results)


def logarithmic(result: Result, dimensions: Result, steps: int, name: str, quantity: str, unit: str) -> Figure | None:
    """Draw the distribution of a quantity on a logarithmic axis with ``steps`` bins per decade, and its median."""
    if not result.rows:
        return None
    figure, (axis,) = canvas(HALF_IN, _HEIGHT_IN)
    at = np.arange(min(row["step"] for row in result.rows), max(row["step"] for row in result.rows) + 1)
    edges = 10 ** (np.append(at, at[-1] + 1) / steps)
    heights = _bin_counts(result, "step", at)
    axis.bar(edges[:-1], heights, width=np.diff(edges) * 0.92, align="edge", color=BLUE)
    axis.set_xlim(edges[0] / 1.1, edges[-1] * 1.1)
    logarithmic_axis(axis, "x", f"{quantity}, {unit}")
    (row,) = (row for row in dimensions.rows if row["quantity"] == f"{quantity}, {unit}")
    axis.axvline(row["median"], color=INK, linewidth=1, linestyle=(0, (4, 2)))
    words, place = f"median {row['median']:.2g} {unit}", (row["median"], 1)
    axis.annotate(words, place, (4, 2), xycoords=("data", "axes fraction"), textcoords="offset points")
    count_axis(axis, "y", "objects")
    alt = (
        f"Histogram of the {quantity} of {row['objects']} objects on a logarithmic axis, from {row['min']:.3g} to "
        f"{row['max']:.3g} {unit}, median {row['median']:.3g} {unit}."
    )
    caption = f"{quantity[0].upper()}{quantity[1:]} of accepted twins, {steps} steps a decade."
    return export_figure(figure, name, caption, alt, result)


def shares(result: Result, name: str, caption: str, label: str, what: str, steps: int) -> Figure | None:
    """Draw a histogram of shares between 0 and 1 in equal steps."""
    if not result.rows:
        return None
    figure, (axis,) = canvas(HALF_IN, _HEIGHT_IN)
    heights = _bin_counts(result, "step", np.arange(steps))
    axis.bar(np.arange(steps) / steps, heights, width=0.92 / steps, align="edge", color=BLUE)
    axis.set_xlim(0, 1)
    axis.set_xlabel(label)
    count_axis(axis, "y", what)
    most = _mode(result.rows, "step", what.split()[-1]) / steps
    often = f"{plain_number(most)} to {plain_number(most + 1 / steps)}"
    alt = f"Histogram of the {label} of {sum(heights):,} {what}; most often {often}."
    return export_figure(figure, name, caption, alt, result)


def _bin_counts(result: Result, key: str, at: np.ndarray) -> list[int]:
    """Return the counts at the bins of a histogram, 0 for bins without a row."""
    (counted,) = set(result.rows[0]) - {key} if result.rows else {""}
    found = {row[key]: row[counted] for row in result.rows}
    return [found.get(int(place), 0) for place in at]


def _mode(rows: list[dict[str, int]], key: str, counted: str) -> int:
    return max(rows, key=lambda row: (row[counted], -row[key]))[key]
