"""``--dry-run``: what a build would do, in lines or as a document."""

from __future__ import annotations

from collections import Counter
from datetime import timedelta

from manitwin.cli.build_plan import Plan, PlannedItem
from manitwin.cli.console import err_console, out_console
from manitwin.cli.documents import plan_document, print_document
from manitwin.pipeline.item import Item

MOST_LINES = 50
WORDS = {
    "to_build": "to build",
    "accepted": "accepted already",
    "rejected": "rejected already",
    "failed": "failed already",
    "would_be_rejected": "would be rejected",
    "duplicate": "duplicate",
}


def print_plan(plan: Plan, place: str, *, as_json: bool) -> None:
    """Print a plan: its items, how many are in each state, and the estimates with their source."""
    for remark in plan.remarks:
        err_console.print(remark)
    if as_json:
        print_document(plan_document(plan, place))
        return
    for planned in plan.items[:MOST_LINES]:
        out_console.print(_item_line(planned))
    if len(plan.items) > MOST_LINES:
        out_console.print(f"... and {len(plan.items) - MOST_LINES} more (--json lists all)")
    counts: Counter[str] = Counter(planned.state for planned in plan.items)
    told = ", ".join(f"{counts[state]} {words}" for state, words in WORDS.items() if counts[state])
    out_console.print(f"dry run, nothing is written: {told or 'nothing to do'}")
    if counts["failed"]:
        out_console.print(f"failed items are not retried automatically; run manitwin retry {place}")
    each = "; ".join(
        f"{number} {kind} of {plan.rates[kind].cpu_s:.1f} CPU-s ({plan.rates[kind].source})"
        for kind, number in plan.to_build.items()
    )
    out_console.print(f"about {timedelta(seconds=round(plan.cpu_s))} of CPU time{f': {each}' if each else ''}")
    out_console.print(f"services charge about {plan.cost_usd:.2f} USD")


def _item_line(planned: PlannedItem) -> str:
    item = planned.item
    given = _known_properties(item, planned.kind)
    detail = f": {planned.detail}" if planned.detail else ""
    return f"{WORDS[planned.state]:<17} {planned.kind or '?':<5} {item.title}{f' ({given})' if given else ''}{detail}"


def _known_properties(item: Item, kind: str | None) -> str:
    units = f"units {item.units}" if kind == "mesh" else ""
    size = "" if item.longest_side_m is None else f"{item.longest_side_m:g} m"
    return ", ".join(filter(None, (item.name or "no name", size, units)))
