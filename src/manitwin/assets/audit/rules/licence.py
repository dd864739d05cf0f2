"""LIC rules: stated licence and attribution."""

from __future__ import annotations

from collections.abc import Iterator

from manitwin.assets.audit.complaint import Complaint
from manitwin.assets.audit.finding import Rule
from manitwin.assets.audit.measured import MeasuredAsset

NOT_SAID = frozenset({"", "unknown", "none", "noassertion", "other", "todo"})
"""Placeholders in a licence field."""


def missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report an asset without a licence."""
    licence = (measured.asset.license or "").strip()
    if licence.lower() in NOT_SAID:
        yield Complaint(f"no licence is stated{f' ({licence!r})' if licence else ''}: nobody may pass it on")


def attribution_missing(measured: MeasuredAsset) -> Iterator[Complaint]:
    """Report a licence that requires attribution if no author is named."""
    licence = (measured.asset.license or "").strip()
    if licence.upper().startswith("CC-BY") and not (measured.asset.attribution or "").strip():
        yield Complaint(f"{licence} asks to name the author, and none is named")


RULES = (
    Rule(
        "LIC001",
        "licence-missing",
        "warning",
        why="Without a licence nothing may be passed on: menagerie PR #20, #302 and PR #141 were refused for it, richdreamer #67"
        " could not redistribute, objaverse-xl #8 asks whose the objects are.",
        remedy="State the licence of the source as its SPDX identifier: --license, or a column of the manifest.",
        check=missing,
    ),
    Rule(
        "LIC002",
        "attribution-missing",
        "warning",
        why="CC-BY and its kin allow use only with the author's name; TripoSR #43 was about objects mislabelled that way.",
        remedy="Name the author and the source: --attribution, or a column of the manifest.",
        check=attribution_missing,
    ),
)
