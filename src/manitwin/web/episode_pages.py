"""HTML pages of recorded episodes: the list of a run's attempts, and one episode with its 3D view and data."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import degrees
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from manitwin.episodes.attempts import OUTCOMES, Attempt, attempt_from
from manitwin.web.attempt_rows import AttemptRow
from manitwin.web.episode_document import DOCUMENT
from manitwin.web.html import EPISODE_TIMELINE, EPISODE_VIEWER, STAGE, THREE, number, options, page, table, text
from manitwin.web.links import Links

PAGE_EPISODES = 100
MEANINGS: Mapping[str, str] = {
    "kept": "succeeded, and nothing was touched by accident",
    "unplanned_contact": "succeeded, but the robot touched what it should not",
    "disturbed": "succeeded, but another object was moved",
    "misplaced": "did not end where it should, let go and still",
    "toppled": "fell over",
    "goal_missed": "the goal is not true at the end",
    "dropped": "fell out of the hand",
    "not_lifted": "did not come along as the hand rose",
    "replan_failed": "no way on from how it lay in the hand",
    "unsettled": "did not stand still at the beginning",
    "reached_already": "the goal was true at the beginning",
    "no_grasp": "no verified grasp of the object is for this hand",
    "no_plan": "no grasp could be planned",
    "no_room": "no room, or no partner, to set it up",
}
assert MEANINGS.keys() == set(OUTCOMES), "every outcome has its meaning"
LAYERS = (
    ("robot", "R", "Robot", True),
    ("mesh", "M", "Objects", True),
    ("furniture", "F", "Furniture", True),
    ("path", "P", "Path of the tool", False),
    ("goal", "G", "Goal", True),
)
"""Layers of the 3D view: name, key, label, and whether initially visible."""
SPEEDS = (("0.1", "1/10 ×"), ("0.25", "1/4 ×"), ("0.5", "1/2 ×"), ("1", "1 ×"), ("2", "2 ×"), ("4", "4 ×"))
KEYS = (
    ("Space", "play, pause"),
    (", .", "one state back, on"),
    ("[ ]", "slower, faster"),
    ("Home End", "beginning, end"),
    ("← → ↑ ↓", "turn"),
    ("+ −", "nearer, farther"),
    ("0", "from the front again"),
)


@dataclass(frozen=True)
class EpisodeList:
    """A page of a list: rows, or error messages for unreadable ones, from ``place`` on, of ``count`` with one outcome or of all.

    ``recorded`` is the total number of recorded episodes; ``outcomes`` counts all attempts if they are known.
    """

    rows: Sequence[AttemptRow | str]
    place: int
    count: int
    recorded: int
    outcome: str
    outcomes: Mapping[str, int]


class _LiteralResult(BaseModel):
    model_config = ConfigDict(extra="ignore")

    literal: str
    holds: bool
    failure: str | None = None
    measured: dict[str, float | str | None] = Field(default={}, max_length=64)


_MEASURED = TypeAdapter(list[_LiteralResult])


def recorded_row(said: dict[str, Any], number: int) -> AttemptRow:
    """Return the row of a recorded episode; raises EpisodesError for an attempt of another version."""
    attempt = attempt_from(said["attempt"])
    return AttemptRow(
        number, attempt.episode_id, attempt.skill, attempt.category, attempt.outcome, attempt.length_s,
        next(iter(attempt.instructions), ""), attempt.goal, attempt.failure, attempt.plan_failures,
    )  # fmt: skip


def list_page(shown: EpisodeList, title: str, remark: str, links: Links) -> str:
    """Return a page of the list; ``remark`` is a line above the table."""
    pages = "".join(
        f'<a href="{text(links.episodes(start, shown.outcome))}"{" aria-current=page" if start == shown.place else ""}>'
        f"{start + 1:,}–{min(start + PAGE_EPISODES, shown.count):,}</a>"
        for start in range(0, shown.count, PAGE_EPISODES)
    )
    heads = ("episode", "what is asked", "object", "skill", "outcome", "reason", "s")
    head = "".join(f'<th scope="col">{name}</th>' for name in heads)
    rows = "".join(_row(each, links) for each in shown.rows)
    counts = _counts(shown, links)
    attempts = sum(shown.outcomes.values())
    said = f"{shown.recorded:,} recorded episodes{f' of {attempts:,} attempts' if attempts else ''}"
    body = (
        f'<header class="top"><h1>{text(title)}</h1><p class="caption">{text(said)}</p></header>\n'
        f'<main id="main">{counts}{f"<p class=error>{text(remark)}</p>" if remark else ""}'
        f'<div class="scroll"><table class="episodes"><thead><tr>{head}</tr></thead>\n<tbody>\n{rows}</tbody></table></div>\n'
        f"{f'<nav class=pages aria-label=Pages>{pages}</nav>' if shown.count > PAGE_EPISODES else ''}</main>\n"
    )
    return page(title, body, links)


def _counts(shown: EpisodeList, links: Links) -> str:
    if not shown.outcomes:
        return ""
    choices = [("", "all", sum(shown.outcomes.values())), *((each, each, n) for each, n in shown.outcomes.items())]
    return (
        '<nav class="pages" aria-label="Outcomes">'
        + "".join(
            f'<a href="{text(links.episodes(0, value))}"{" aria-current=page" if value == shown.outcome else ""}>'
            f"{text(words.replace('_', ' '))} {n:,}</a>"
            for value, words, n in choices
        )
        + "</nav>\n"
    )


def _row(row: AttemptRow | str, links: Links) -> str:
    if isinstance(row, str):
        return f'<tr><td colspan="7" class="error">{text(row)}</td></tr>\n'
    name = text(row.episode_id)
    if row.number is not None:
        name = f'<a href="{text(links.episode(row.number))}">{name}</a>'
    asked = row.goal if row.goal and not row.instruction else row.instruction
    reason = row.failure or (_plan_failures(row.plan_failures) if row.outcome == "no_plan" else "") or (
        "" if row.outcome == "kept" else MEANINGS.get(row.outcome, "")
    )  # fmt: skip
    cells = (asked, row.category, row.skill)
    kind = "status" if row.outcome == "kept" else "status rejected"
    return (
        f'<tr><th scope="row">{name}</th>'
        + "".join(f"<td>{text(each) or '–'}</td>" for each in cells)
        + f'<td><span class="{kind}">{text(row.outcome.replace("_", " "))}</span></td><td>{text(reason) or "–"}</td>'
        + f"<td>{'–' if row.length_s is None else f'{row.length_s:.1f}'}</td></tr>\n"
    )


def _plan_failures(said: str | None) -> str:
    """Return the number of failed grasps per cause as text; empty if it cannot be read."""
    try:
        counts = TypeAdapter(dict[str, int]).validate_json(said or "{}")
    except ValidationError:
        return ""
    return ", ".join(f"{count} {cause.replace('_', ' ')}" for cause, count in counts.items())


def episode_page(
    said: dict[str, Any],
    number: int,
    count: int,
    links: Links,
    before: int | None,
    after: int | None,
    data: Sequence[str] = (),
) -> str:
    """Return the page of an episode; ``before`` and ``after`` are the numbers of its neighbours. Raises EpisodesError.

    ``data`` are scripts with the data that a server would otherwise provide.
    """
    attempt = attempt_from(said["attempt"])
    steps = "".join(
        f'<a rel="{rel}" href="{text(links.episode(other))}">{words}</a>'
        for rel, words, other in (("prev", "previous", before), ("next", "next", after))
        if other is not None
    )
    kind = "status" if attempt.outcome == "kept" else "status rejected"
    asked = next(iter(attempt.instructions), attempt.goal or "")
    title = f"Episode {number + 1} of {count:,}: {attempt.category or attempt.skill}"
    body = (
        f'<header class="top"><nav><a href="{text(links.episodes())}">All episodes</a>{steps}</nav>'
        f'<h1>{text(title)} <span class="{kind}">{text(attempt.outcome.replace("_", " "))}</span></h1>'
        f'<p class="caption">{text(asked)}</p></header>\n'
        f'<div class="twin">\n{_viewer(number, links)}'
        f'<main id="main">\n{_outcome_table(attempt)}{_instructions(attempt)}{_objects(said, links)}'
        f"{_facts(attempt)}</main>\n</div>\n"
    )
    return page(title, body, links, scripts=[THREE, STAGE, EPISODE_TIMELINE, EPISODE_VIEWER], data=data)


def _viewer(number: int, links: Links) -> str:
    layers = "".join(
        f'<label><input type="checkbox" data-layer="{name}"{" checked" if shown else ""}> {words} <kbd>{key}</kbd></label>'
        for name, key, words, shown in LAYERS
    )
    keys = "".join(f"<div><dt>{text(key)}</dt><dd>{text(does)}</dd></div>" for key, does in KEYS)
    return (
        '<section class="viewer" id="viewer" aria-label="3D view"'
        f' data-document="{text(links.episode(number, DOCUMENT))}">\n'
        '<div class="stage" tabindex="0" role="application" aria-label="3D view; the keys are listed below it">'
        '<div class="tip" hidden></div><div class="scale" aria-hidden="true"></div></div>\n'
        '<p class="said" role="status" aria-live="polite">Loading …</p>\n'
        '<div class="player"><button type="button" data-act="play" disabled>Play</button>'
        '<button type="button" data-act="back" aria-label="one state back" disabled>‹</button>'
        '<button type="button" data-act="on" aria-label="one state on" disabled>›</button>'
        '<input type="range" min="0" max="0" value="0" step="1" aria-label="state" disabled>'
        f'<output></output><label>Speed <select data-act="speed">{options(SPEEDS, "1")}</select></label></div>\n'
        '<div class="timeline"></div>\n<dl class="readout" aria-label="At this time"></dl>\n'
        f'<div class="layers">{layers}</div>\n<ol class="happenings" aria-label="What happens"></ol>\n'
        f'<details class="keys"><summary>Keys</summary><dl>{keys}</dl></details>\n</section>\n'
    )


def _outcome_table(attempt: Attempt) -> str:
    rows: list[tuple[str, Any]] = [
        (
            "outcome",
            f"{attempt.outcome.replace('_', ' ')}: {MEANINGS.get(attempt.outcome, 'not known to this version')}",
        ),
        ("reason", attempt.failure),
    ]
    if attempt.goal is None:
        rows += [
            ("from the goal, mm", None if attempt.position_error_m is None else 1000 * attempt.position_error_m),
            ("tilted, degrees", _degrees(attempt.tilt_rad)),
            ("heading off, degrees", _degrees(attempt.yaw_error_rad)),
        ]
    else:
        rows.append(("goal", attempt.goal))
    rows.append(("slipped in the hand, mm", None if attempt.slip_m is None else 1000 * attempt.slip_m))
    return table("Outcome", ("", "value"), [row for row in rows if row[1] is not None]) + _literals(attempt.measured)


def _literals(measured: str | None) -> str:
    if measured is None:
        return ""
    try:
        judged = _MEASURED.validate_json(measured)
    except ValidationError:
        return '<p class="error">What was measured of the goal cannot be read.</p>\n'
    rows = [
        (
            each.literal,
            "true" if each.holds else f"not true: {each.failure or ''}",
            ", ".join(
                f"{name} {number(value) if isinstance(value, float) else value}"
                for name, value in each.measured.items()
            ),
        )
        for each in judged
    ]
    return table("The goal's literals, as measured at the end", ("literal", "", "measured"), rows)


def _degrees(angle_rad: float | None) -> float | None:
    return None if angle_rad is None else degrees(angle_rad)


def _instructions(attempt: Attempt) -> str:
    if not attempt.instructions:
        return ""
    said = "".join(f"<li>{text(each)}</li>" for each in attempt.instructions)
    return f'<h2>What a person would say</h2>\n<ul class="instructions">{said}</ul>\n'


def _objects(said: dict[str, Any], links: Links) -> str:
    target = said["target"]
    rows = "".join(
        f'<tr><th scope="row">{text(each["name"])}{" (target)" if place == target else ""}</th>'
        f'<td><a href="{text(links.twin(each["twin_id"]))}">{text(each["twin_id"])}</a></td></tr>\n'
        for place, each in enumerate(said["objects"])
    )
    heads = "".join(f'<th scope="col">{name}</th>' for name in ("object", "twin"))
    return (
        f'<div class="scroll"><table class="pair"><caption>Objects</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}</tbody></table></div>\n"
    )


def _facts(attempt: Attempt) -> str:
    rows = [
        ("episode", attempt.episode_id),
        ("robot", attempt.robot),
        ("skill", attempt.skill),
        ("scene", attempt.scene_id),
        ("task", attempt.task_id),
        ("length, s", attempt.length_s),
        ("grasp", " ".join(filter(None, (attempt.grasp_id, attempt.grasp_type))) or None),
        ("grasps tried", attempt.grasps_tried),
        ("grasps that could not be planned", _plan_failures(attempt.plan_failures) or None),
        ("seed", str(attempt.seed)),
    ]
    return table("The attempt", ("", "value"), [row for row in rows if row[1] is not None])
