"""README.md of a published data set: the hub's dataset card."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from manitwin.dataset.publish.card_statistics import category_lines, licence_lines, total_lines
from manitwin.dataset.publish.card_usage import usage_text
from manitwin.dataset.publish.hub_license import hub_license
from manitwin.dataset.publish.licences import LICENSES_MD, without_attribution
from manitwin.dataset.publish.tables import PUBLISHED, columns_of
from manitwin.formats.markdown import markdown_escaped, table
from manitwin.twin.version import installed_version

TASK_CATEGORIES = ("robotics",)
TAGS = ("robotics", "manipulation", "grasping", "simulation", "digital-twin", "3d", "webdataset")

_SIZES = (("n<1K", 10**3), ("1K<n<10K", 10**4), ("10K<n<100K", 10**5), ("100K<n<1M", 10**6), ("1M<n<10M", 10**7))

_TABLES = {
    "twins": "an object: words, size, mass, friction, how its grasps did, licence, and its `shard`",
    "points": "a functional point or a grasp point",
    "grasps": "a grasp that was tried, held or failed, with the reason",
    "placements": "a stable pose",
    "shards": "a tar file: how many twins and bytes it has",
}


@dataclass(frozen=True)
class CardFacts:
    """What the card tells: rows of the published ``twins`` table, rows of the other tables counted, and the shards' bytes.

    ``pictures`` are names of files below the publication.
    """

    name: str
    twins: Sequence[Mapping[str, Any]]
    rows: Mapping[str, int]
    shard_bytes: Sequence[int]
    pictures: Sequence[str]


def dataset_card(facts: CardFacts) -> str:
    """Return README.md: front matter that the hub and ``datasets`` read, statistics, how to load, frames and licences."""
    verified = sum(twin["verified"] for twin in facts.twins)
    lines = [
        "---",
        *_front_matter(facts),
        "---",
        "",
        f"# {markdown_escaped(facts.name)}",
        "",
        f"{len(facts.twins):,} simulation-ready objects for robot manipulation: each with a textured mesh, convex collision "
        "hulls, mass, friction and inertia with their sources, words, functional points, stable poses, and "
        f"grasps tried in physics ({verified:,} verified, and the failed ones too).",
        "",
        *[line for picture in facts.pictures for line in (f"![Input, render, hulls, verified grasps]({picture})", "")],
        "## What is here",
        "",
        *table(["table", "a row is", "rows"], _table_rows(facts), align="llr"),
        "",
        f"`data/<category>/<category>-000000.tar`: {len(facts.shard_bytes):,} WebDataset shards, "
        f"{size(sum(facts.shard_bytes))} in all. `SHA256SUMS` has the digest of every file: `sha256sum -c SHA256SUMS`.",
        "",
        "## Statistics",
        "",
        *total_lines(facts.twins),
        "",
        "### Categories",
        "",
        *category_lines(facts.twins),
        "",
        *usage_text(facts),
        "",
        "## Licences and attribution",
        "",
        *licence_lines(facts.twins),
        "",
        f"Every twin stays under the licence of its source; whom to credit is in [{LICENSES_MD}]({LICENSES_MD}), and for "
        "each twin in the columns `license` and `attribution` of the table `twins`.",
        *_missing_attribution(facts),
        "",
        f"Made with manitwin {installed_version()}.",
    ]
    return "\n".join(lines) + "\n"


def size(count: int) -> str:
    """Return bytes for a person: ``3.2 GB`` (powers of 1000, as the hub counts)."""
    value, units = float(count), ["B", "kB", "MB", "GB", "TB"]
    while value >= 1000 and len(units) > 1:
        value /= 1000
        units.pop(0)
    return f"{value:.3g} {units[0]}"


def size_category(count: int) -> str:
    """Return the hub's word for how many rows a data set has."""
    return next((word for word, limit in _SIZES if count < limit), "10M<n<100M")


def _front_matter(facts: CardFacts) -> list[str]:
    licence = hub_license(twin["license"] for twin in facts.twins)
    lines = [f"{key}: {_quoted(value)}" for key, value in {"pretty_name": facts.name, **licence}.items()]
    lines += ["size_categories:", f"- {_quoted(size_category(len(facts.twins)))}"]
    lines += ["task_categories:", *[f"- {each}" for each in TASK_CATEGORIES]]
    lines += ["tags:", *[f"- {each}" for each in TAGS], "configs:"]
    for name in (*PUBLISHED, "shards"):
        lines += [f"- config_name: {name}", *(["  default: true"] if name == "twins" else [])]
        lines += ["  data_files:", "  - split: train", f"    path: index/{name}-*.parquet"]
    return lines


def _quoted(text: str) -> str:
    return json.dumps(text)  # a JSON string is a YAML string


def _table_rows(facts: CardFacts) -> list[list[str]]:
    return [
        [f"`{name}`", f"{_TABLES[name]} ({len(columns_of(name))} columns)", f"{facts.rows[name]:,}"]
        for name in (*PUBLISHED, "shards")
    ]


def _missing_attribution(facts: CardFacts) -> list[str]:
    missing = len(without_attribution(facts.twins))
    return (
        ["", f"**Of {missing:,} twins under a licence that asks for attribution no author is known.**"]
        if missing
        else []
    )
