"""Dataset card (README.md) of a published data set, with loading examples and the definitions of its frames."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from manitwin.dataset.publish.card_statistics import category_lines, licence_lines, total_lines
from manitwin.dataset.publish.licences import LICENSES_MD, hub_license, without_attribution
from manitwin.dataset.publish.tables import columns_of
from manitwin.formats.installation import installed_version
from manitwin.formats.markdown import markdown_escaped, table

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
    """Input of a card: rows of the published ``twins`` table, row counts of the other tables, and shard sizes in bytes.

    ``pictures`` are file names relative to the publication.
    """

    name: str
    twins: Sequence[Mapping[str, Any]]
    rows: Mapping[str, int]
    shard_bytes: Sequence[int]
    pictures: Sequence[str]


def dataset_card(facts: CardFacts) -> str:
    """Return README.md: front matter for the hub and ``datasets``, statistics, loading examples, frames and licences."""
    verified = sum(twin["verified"] for twin in facts.twins)
    licences = [twin["license"] for twin in facts.twins]
    configs = {name: f"index/{name}-*.parquet" for name in _TABLES}
    lines = [
        *front_matter(facts.name, licences, len(facts.twins), TAGS, configs),
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
        *licence_section(
            facts.twins,
            f"Every twin stays under the licence of its source; whom to credit is in [{LICENSES_MD}]({LICENSES_MD}), and for "
            "each twin in the columns `license` and `attribution` of the table `twins`.",
        ),
        "",
        f"Made with manitwin {installed_version()}.",
    ]
    return "\n".join(lines) + "\n"


def size(count: int) -> str:
    """Return a byte count as text such as ``3.2 GB`` (powers of 1000, as on the hub)."""
    value, units = float(count), ["B", "kB", "MB", "GB", "TB"]
    while value >= 1000 and len(units) > 1:
        value /= 1000
        units.pop(0)
    return f"{value:.3g} {units[0]}"


def size_category(count: int) -> str:
    """Return the hub's size category of a number of rows."""
    return next((word for word, limit in _SIZES if count < limit), "10M<n<100M")


def front_matter(
    name: str, licences: Iterable[str], rows: int, tags: Sequence[str], configs: Mapping[str, str]
) -> list[str]:
    """Return the lines of a card's YAML front matter. ``configs`` maps table names to paths; the first is the default."""
    fields = {"pretty_name": name, **hub_license(licences)}
    lines = ["---", *(f"{key}: {json.dumps(value)}" for key, value in fields.items())]  # JSON strings are valid YAML
    lines += ["size_categories:", f"- {json.dumps(size_category(rows))}"]
    lines += ["task_categories:", "- robotics", "tags:", *[f"- {each}" for each in tags], "configs:"]
    for number, (config, path) in enumerate(configs.items()):
        lines += [f"- config_name: {config}", *(["  default: true"] if number == 0 else [])]
        lines += ["  data_files:", "  - split: train", f"    path: {path}"]
    return [*lines, "---"]


def _table_rows(facts: CardFacts) -> list[list[str]]:
    return [
        [f"`{name}`", f"{_TABLES[name]} ({len(columns_of(name))} columns)", f"{facts.rows[name]:,}"] for name in _TABLES
    ]


def licence_section(twins: Sequence[Mapping[str, Any]], terms: str) -> list[str]:
    """Return the card's section on licences: their table, the terms, and a warning if authors are unknown."""
    lines = ["## Licences and attribution", "", *licence_lines(twins), "", terms]
    missing = len(without_attribution(twins))
    if missing:
        lines += ["", f"**Of {missing:,} twins under a licence that asks for attribution no author is known.**"]
    return lines


_TEXT = """\
## How to load it

The tables, and from them the shards that hold what you want ([datasets](https://huggingface.co/docs/datasets); `PATH` is
this folder or the name of its repository):

```python
from datasets import load_dataset

twins = load_dataset(PATH, "twins", split="train")
wanted = twins.filter(lambda twin: twin["category"] == "{category}" and twin["verified"] >= 20)
shards = sorted(set(wanted["shard"]))  # ["{shard}"]
grasps = load_dataset(PATH, "grasps", split="train")  # also: points, placements, shards
```

The twins, as a stream ([webdataset](https://github.com/webdataset/webdataset); of a repository, `PATH` here is
`https://huggingface.co/datasets/NAME/resolve/main`):

```python
import io, json
import trimesh, webdataset

for sample in webdataset.WebDataset([f"{{PATH}}/{{shard}}" for shard in shards], shardshuffle=False):
    twin = json.loads(sample["twin.json"])
    visual = trimesh.load(io.BytesIO(sample["visual.glb"]), file_type="glb")  # Y-up
    hulls = trimesh.load(io.BytesIO(sample["collision.zip"]), file_type="zip")  # a scene of convex hulls, Z-up
```

The twins as folders, checked against their digests, ready for SAPIEN and MuJoCo, with manitwin:

```python
import manitwin

for folder in manitwin.unpack_shard("{shard}", "unpacked"):
    twin = manitwin.load(folder)
    twin.grasps().gripper_to_object  # (N, 4, 4), the verified ones
```

## What a sample has

| part | what it is |
| --- | --- |
| `twin.json` | everything that is known of the object, with sources, intervals and the sha256 of every file |
| `visual.glb` | the textured mesh, metres, Y-up (glTF's rule) |
| `collision.zip` | convex hulls `hull_00.obj` ..., metres, object frame, stored uncompressed |
| `face_parts.npy` | the part of each face of `visual.glb` but those without area: its place in `twin.json`, 255 for none |
| `face_links.npy` | of a twin with joints: the link of each face likewise |
| `shape.json` | 66 numbers that describe the shape, and its radius of gyration |
| `grasps.parquet` | every grasp that was tried, held or failed |
| `rgb_00.webp` ... | pictures from eight sides |
| `marked_00.webp` ... | the same with the numbered candidate points |
| `card.png` | one picture of all that |
| `source.*` or `prompt.txt` | what the twin was made of, byte for byte |
| `run.json` | seconds and cost of each stage |

The key of a sample is the `twin_id`, the same in all tables.

## Frames and units

SI units everywhere: metres, kilograms, seconds, newtons, radians. Quaternions are **wxyz**.

- **Object frame**: right-handed, +Z up, origin at the bottom centre: the object stands on z = 0. GLB files are Y-up:
  object (x, y, z) is glTF (x, z, -y).
- **Grasp frame**: origin at the gripper's base link, +Z the approach, X the closing direction. `position_m` and
  `quaternion_wxyz` of a grasp are the pose of that frame in the object frame; the fingertips' centre lies `depth_m` along
  +Z. A Panda's `panda_hand` closes along Y: turn it by 90 degrees about Z.
- **Placement**: the pose of the object frame in a frame on the supporting plane (z = 0, z up).
- `outcome` of a grasp is `held`, or where it failed: collides, unreachable, misses, penetrates, drops, unstable, slips.
  A `proposer` that ends in `:unfiltered` is a sample taken before any filter, one that ends in `:jittered` a negative
  control: leave both out of success rates.
- A grasp that is `retired` was verified, and failed with a robot's arm since: do not use it.
- Mass, friction and size are estimates with an interval unless `mass_source` says `measured`."""


def usage_text(facts: CardFacts) -> list[str]:
    """Return the usage sections of the card, with a category and shard of this data set in the examples."""
    example = max(facts.twins, key=lambda twin: (twin["verified"], twin["twin_id"]))
    category = re.sub(r"[^\w .-]", "", str(example["category"]))  # the category is inserted into code
    return _TEXT.format(category=category, shard=example["shard"]).splitlines()
