"""Statistics on the dataset card, computed from the published ``twins`` table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from manitwin.formats.markdown import markdown_escaped, table

CATEGORIES_SHOWN = 40

COLUMNS = (
    *("twin_id", "category", "kind", "license", "attribution", "shard"),
    *("gripper", "simulated", "verified", "success_rate"),
    *("held_in_second_engine_share", "functional_points", "grasp_points", "placements", "watertight", "failed_checks"),
    *("mass_source", "longest_m", "mass_kg", "hulls"),
)
"""Columns of the table ``twins`` that the card uses."""

Rows = Sequence[Mapping[str, Any]]


def total_lines(twins: Rows) -> list[str]:
    """Return two tables: totals, and the distributions of size, mass and grasps."""
    simulated, verified = (sum(twin[key] for twin in twins) for key in ("simulated", "verified"))
    opinions = [twin["held_in_second_engine_share"] for twin in twins]
    totals = [
        ["twins", f"{len(twins):,}"],
        ["categories", f"{len({twin['category'] for twin in twins}):,}"],
        ["made of", _count_words(twin["kind"] for twin in twins)],
        ["grasps tried in physics", f"{simulated:,}"],
        ["grasps verified", f"{verified:,}{_share(verified, simulated)}"],
        ["gripper", _count_words(str(twin["gripper"]) for twin in twins)],
        ["held in a second engine too, mean over twins", _mean_share(opinions)],
        ["functional points", f"{sum(twin['functional_points'] for twin in twins):,}"],
        ["grasp points", f"{sum(twin['grasp_points'] for twin in twins):,}"],
        ["stable poses", f"{sum(twin['placements'] for twin in twins):,}"],
        ["watertight", f"{sum(twin['watertight'] for twin in twins):,}"],
        ["with a failed quality check", f"{sum(bool(twin['failed_checks']) for twin in twins):,}"],
        # Only the part before the colon counts: prior:mug and prior:bowl are both prior.
        ["where the masses come from", _count_words(twin["mass_source"].partition(":")[0] for twin in twins)],
    ]
    spread = [
        _percentile_row("longest side (m)", [twin["longest_m"] for twin in twins]),
        _percentile_row("mass (kg)", [twin["mass_kg"] for twin in twins]),
        _percentile_row("collision hulls", [twin["hulls"] for twin in twins]),
        _percentile_row("verified grasps", [twin["verified"] for twin in twins]),
        _percentile_row("share of grasps that held", [twin["success_rate"] for twin in twins]),
    ]
    head = ["of a twin", "least", "5 %", "median", "95 %", "most"]
    return [*table(["", "all"], totals), "", *table(head, spread)]


def category_lines(twins: Rows) -> list[str]:
    """Return a table of the largest categories, with a line on the number of other ones."""
    count = Counter(twin["category"] for twin in twins)
    verified: Counter[str] = Counter()
    for twin in twins:
        verified[twin["category"]] += twin["verified"]
    order = sorted(count, key=lambda name: (-count[name], name))
    rows = [[markdown_escaped(name), f"{count[name]:,}", f"{verified[name]:,}"] for name in order[:CATEGORIES_SHOWN]]
    lines = table(["category", "twins", "verified grasps"], rows)
    rest = order[CATEGORIES_SHOWN:]
    if rest:
        twins_of_rest = sum(count[name] for name in rest)
        lines += ["", f"and {len(rest):,} more categories with {twins_of_rest:,} twins."]
    return lines


def licence_lines(twins: Rows) -> list[str]:
    """Return a table of the licences."""
    count = Counter(twin["license"] for twin in twins)
    named = Counter(twin["license"] for twin in twins if twin["attribution"])
    rows = [[markdown_escaped(name), f"{count[name]:,}", f"{named[name]:,}"] for name in sorted(count)]
    return table(["licence", "twins", "with attribution"], rows)


def _count_words(words: Iterable[str]) -> str:
    count = Counter(words)
    return ", ".join(f"{markdown_escaped(name)} {number:,}" for name, number in sorted(count.items()))


def _share(part: int, whole: int) -> str:
    return f" ({part / whole:.1%})" if whole else ""


def _mean_share(shares: Sequence[float | None]) -> str:
    known = [share for share in shares if share is not None]
    return f"{float(np.mean(known)):.1%} ({len(known):,} twins)" if known else "not tried"


def _percentile_row(label: str, values: Sequence[float]) -> list[str]:
    return [label, *(f"{value:.3g}" for value in np.percentile(values, (0, 5, 50, 95, 100)))]
