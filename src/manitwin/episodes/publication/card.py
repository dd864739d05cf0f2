"""README.md of published episodes: a dataset card with the front matter that LeRobot and ``datasets`` read."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from manitwin.dataset.publish.card import front_matter, licence_section
from manitwin.dataset.publish.licences import LICENSES_MD
from manitwin.episodes.attempts import ATTEMPTS, AttemptCounts, StageCounts
from manitwin.episodes.lerobot.lerobot_format import CODEC
from manitwin.formats.markdown import markdown_escaped, table

TAGS = ("LeRobot", "robotics", "manipulation", "pick-and-place", "simulation", "synthetic")
TWINS_FILE = "twins.parquet"
CONFIGS = {"default": "data/*/*.parquet", "attempts": ATTEMPTS, "twins": TWINS_FILE}
CATEGORIES_SHOWN, NEVER_SHOWN = 50, 200

OF_EPISODES = (
    "An episode shows the objects that were in it, and follows their shape and mass: it stays under the licences of all their "
    f"twins. `{TWINS_FILE}` has licence, attribution and the source's sha256 of every twin, and the numbers of its `episodes`."
)


@dataclass(frozen=True)
class EpisodesCard:
    """Facts of the card: ``twins`` are rows of the table of twins.

    ``info`` is meta/info.json; ``made_of`` names the data set, scenes and versions, without folders.
    """

    name: str
    info: Mapping[str, Any]
    twins: Sequence[Mapping[str, Any]]
    success: AttemptCounts
    left_out: Mapping[str, int]
    attempt_rows: int
    made_of: Mapping[str, str]


def episodes_card(facts: EpisodesCard) -> str:
    """Return the text of README.md."""
    licences = [twin["license"] for twin in facts.twins]
    lines = [
        *front_matter(facts.name, licences, facts.info["total_frames"], TAGS, CONFIGS),
        "",
        *_introduction(facts),
        "",
        *_contents(facts),
        *_left_out(facts),
        "",
        *_success(facts.success),
        "",
        *licence_section(
            facts.twins,
            "An episode stays under the licences of all objects in it; whom to credit is in "
            f"[{LICENSES_MD}]({LICENSES_MD}).",
        ),
        "",
        "## How it was made",
        "",
        *table(["", ""], [[what, markdown_escaped(value)] for what, value in facts.made_of.items()], align="ll"),
    ]
    return "\n".join(lines) + "\n"


def _introduction(facts: EpisodesCard) -> list[str]:
    info = facts.info
    return [
        f"# {markdown_escaped(facts.name)}",
        "",
        f"{info['total_episodes']:,} simulated episodes of the robot {markdown_escaped(info['robot_type'])}, as a "
        "[LeRobotDataset v3.0](https://huggingface.co/docs/lerobot/lerobot-dataset-v3). Each was planned from a grasp that was "
        "verified in physics, executed in SAPIEN, and kept where an evaluator found its goal reached.",
        "",
        "```python",
        "from lerobot.datasets.lerobot_dataset import LeRobotDataset",
        "",
        'dataset = LeRobotDataset("local/episodes", root="FOLDER")  # where this repository was downloaded to',
        "```",
    ]


def _contents(facts: EpisodesCard) -> list[str]:
    info = facts.info
    hours = info["total_frames"] / info["fps"] / 3600
    rows = [
        ["robot", markdown_escaped(info["robot_type"])],
        ["episodes", f"{info['total_episodes']:,}"],
        ["frames", f"{info['total_frames']:,} at {info['fps']} a second ({hours:.2f} hours)"],
        ["tasks (phrasings)", f"{info['total_tasks']:,}"],
        ["objects in them", f"{sum(bool(twin['episodes']) for twin in facts.twins):,}"],
        ["cameras", _cameras(info)],
    ]
    return [
        "## What is here",
        "",
        *table(["", "all"], rows),
        "",
        *table(["feature", "type", "shape"], _features(info), align="lll"),
        "",
        "SI units, radians, world frame (the robot's base at the origin, +X forward, +Z up), quaternions wxyz.",
        "",
        f"`{ATTEMPTS}` has {facts.attempt_rows:,} attempts, kept or not, with the reason; `{TWINS_FILE}` the objects. "
        "`sha256sum -c SHA256SUMS` checks every file.",
    ]


def _features(info: Mapping[str, Any]) -> list[list[str]]:
    return [
        [f"`{name}`", feature["dtype"], " x ".join(map(str, feature["shape"]))]
        for name, feature in info["features"].items()
    ]


def _cameras(info: Mapping[str, Any]) -> str:
    films = {name: each["info"] for name, each in info["features"].items() if each["dtype"] == "video"}
    if not films:
        return "none: no pictures were drawn"
    return ", ".join(
        f"{name.rpartition('.')[2]} ({film['video.width']} x {film['video.height']}, {film.get(CODEC) or film['video.codec']})"
        for name, film in films.items()
    )


def _success(success: AttemptCounts) -> list[str]:
    head = ["category", "attempted", "executed", "succeeded", "of executed", "kept"]
    order = sorted(success.by_category, key=lambda name: (-success.by_category[name].attempted, name))
    rows = [_row(markdown_escaped(name) or "not told", success.by_category[name]) for name in order[:CATEGORIES_SHOWN]]
    lines = ["## Success", "", *table(head, [_row("all", success.total), *rows])]
    if order[CATEGORIES_SHOWN:]:
        lines += ["", f"and {len(order) - CATEGORIES_SHOWN:,} more categories."]
    outcomes = ", ".join(f"{markdown_escaped(name)} {count:,}" for name, count in success.outcomes.items())
    lines += ["", f"Outcomes: {outcomes}.", ""]
    if not success.never:
        return [*lines, "Every object that was tried succeeded at least once."]
    shown = ", ".join(f"{markdown_escaped(category)} `{twin_id}`" for twin_id, category in success.never[:NEVER_SHOWN])
    rest = len(success.never) - NEVER_SHOWN
    more = f", and {rest:,} more (see `{ATTEMPTS}`)" if rest > 0 else ""
    return [
        *lines,
        f"**Objects without a single success**, which no episode moves ({len(success.never):,}): {shown}{more}.",
    ]


def _row(name: str, tally: StageCounts) -> list[str]:
    rate = f"{tally.succeeded / tally.executed:.1%}" if tally.executed else "-"
    return [name, f"{tally.attempted:,}", f"{tally.executed:,}", f"{tally.succeeded:,}", rate, f"{tally.kept:,}"]


def _left_out(facts: EpisodesCard) -> list[str]:
    if not facts.left_out:
        return []
    why = ", ".join(f"{markdown_escaped(name)} {count:,}" for name, count in facts.left_out.items())
    return [
        "",
        f"Left out for the licence of an object in them, with their pictures: {sum(facts.left_out.values()):,} kept episodes "
        f"({why}), and all attempts at such objects. The success rates below count every attempt at the objects that "
        "may go out, whatever stood around.",
    ]
