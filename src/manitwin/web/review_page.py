"""HTML page for judging a twin: 3D view, annotations by dimension, answers and corrections."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from manitwin.dataset.review.review_subjects import annotation_text
from manitwin.dataset.review.session import Progress
from manitwin.dataset.review.verdicts import ANSWERS, DIMENSIONS, MOST_NAME_CHARACTERS, MOST_NOTE_CHARACTERS, Dimension
from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record import TwinRecord
from manitwin.web.html import REVIEW, number, page, text
from manitwin.web.links import Links
from manitwin.web.twin_facts import fact_tables
from manitwin.web.twin_page import SCRIPTS, pictures, viewer

QUESTIONS: dict[Dimension, str] = {
    "category": "Is this what it is?",
    "language": "Are colour, material, shape, function and caption true?",
    "functional": "Is each functional point on what its label names?",
    "physical": "Are size, mass and material plausible?",
    "grasp": "Would one hold it at each grasp point?",
    "mesh": "Is it one whole object, without severe faults?",
    "simulation": "Do the grasps that held look as if they would?",
}
KEYS = (
    ("yes", "y", "yes, and on to the next"),
    ("no", "n", "no"),
    ("unsure", "u", "unsure, and on"),
    ("next", "j", "next dimension"),
    ("previous", "k", "previous dimension"),
    ("correct", "c", "what is true instead"),
    ("note", "t", "note"),
    ("confirm", "Enter", "confirm, and the next twin"),
    ("undo", "Backspace", "take the last review back"),
    ("later", "s", "leave it for later"),
)
"""Default keys: action, key, description. Digits select dimensions, Escape leaves a field."""
SHORT = tuple((action, key, words.split(",")[0]) for action, key, words in KEYS)
PATH = "/review"
MOST_UNREAD = 20
"""Maximum number of unreadable twins listed with the reason."""


def review_page(twin: Twin, links: Links, annotator: str, progress: Progress, draft: Any, *, blind: bool) -> str:
    """Return the page of an accepted twin; ``blind`` hides origin, confidence and rationale of annotations."""
    record = twin.record
    fields = "".join(_dimension(record, place, dimension, blind) for place, dimension in enumerate(DIMENSIONS, 1))
    body = (
        f"{_head(annotator, progress)}"
        f'<div class="twin">\n{viewer(record, links, hidden=("grasps",))}<main id="main">\n'
        f'<form id="review" data-twin="{text(record.twin_id)}" data-revision="{text(record.revision)}"'
        f' data-annotator="{text(annotator)}" data-path="{PATH}"'
        f' data-draft="{text(json.dumps(draft)) if draft else ""}" autocomplete="off">\n'
        f"{_strip()}{fields}"
        f'<label class="note"><span>Note <kbd data-key="note"></kbd></span>'
        f'<textarea name="note" rows="2" maxlength="{MOST_NOTE_CHARACTERS}"></textarea></label>\n'
        '<p class="buttons"><button type="button" data-act="confirm">Confirm <kbd data-key="confirm"></kbd></button>'
        '<button type="button" data-act="undo">Take back <kbd data-key="undo"></kbd></button>'
        '<button type="button" data-act="later">Later <kbd data-key="later"></kbd></button></p>\n'
        f'<p class="said" id="saved" role="status" aria-live="polite"></p>\n</form>\n{_keys()}'
        f"{'' if blind else fact_tables(record)}</main>\n</div>\n"
        f"{pictures(twin, links, with_card=not blind)}"
    )
    return page(f"Review {record.twin_id}", body, links, scripts=[*SCRIPTS, REVIEW])


def done_page(links: Links, annotator: str, progress: Progress, unread: Mapping[str, str]) -> str:
    """Return the page for an empty queue; ``unread`` maps the ids of unreadable twins to reasons."""
    first = list(unread.values())[:MOST_UNREAD]
    lacking = "".join(f'<li class="error">{text(reason)}</li>\n' for reason in first)
    if lacking:
        lacking = (
            f"<p>{len(unread):,} {'twin' if len(unread) == 1 else 'twins'} cannot be read:</p>\n<ul>\n{lacking}</ul>\n"
        )
    what = "Nothing else" if lacking else "Nothing"
    body = (
        f'{_head(annotator, progress)}<main id="main" class="message"><p>{what} is left in your queue.</p>\n{lacking}'
        f'<form id="review" data-annotator="{text(annotator)}" data-path="{PATH}"><p class="buttons">'
        '<button type="button" data-act="undo">Take back <kbd data-key="undo"></kbd></button></p>\n'
        f'<p class="said" id="saved" role="status" aria-live="polite"></p></form>\n{_keys()}</main>\n'
    )
    return page("Review", body, links, scripts=[REVIEW])


def _head(annotator: str, progress: Progress) -> str:
    total = progress.reviewed + progress.left
    speed = ""
    if progress.median_s is not None:
        left_min = progress.median_s * progress.left / 60
        speed = f", {progress.median_s:.0f} s each (median)" + (
            f", about {left_min:.0f} min to go" if left_min >= 1 else ""
        )
    return (
        f'<header class="top"><h1>Review</h1><p class="caption" id="progress">{text(annotator)}: {progress.reviewed} reviewed,'
        f' {progress.left} left{speed} <progress value="{progress.reviewed}" max="{max(total, 1)}"></progress></p></header>\n'
    )


def _dimension(record: TwinRecord, place: int, dimension: Dimension, blind: bool) -> str:
    answers = "".join(
        f'<label><input type="radio" name="{dimension}" value="{answer}"> {answer}</label>' for answer in ANSWERS
    )
    return (
        f'<fieldset data-dimension="{dimension}"><legend><kbd>{place}</kbd> {dimension}'
        f' <span class="question">{text(QUESTIONS[dimension])}</span></legend>\n'
        f'<p class="given">{text(annotation_text(record, dimension, blind=blind))}</p>\n'
        f'<div class="answers" role="radiogroup" aria-label="{dimension}">{answers}</div>'
        f"{_correction_fields(record, dimension)}</fieldset>\n"
    )


def _correction_fields(record: TwinRecord, dimension: Dimension) -> str:
    physical, points = record.physical, record.points
    if dimension == "category":
        return _hidden(f'<label>it is <input data-fix="category" maxlength="{MOST_NAME_CHARACTERS}"></label>')
    if dimension == "physical" and physical is not None:
        rows = []
        for name, words, unit, value in (
            ("mass_kg", "mass", "kg", physical.mass_kg.value),
            ("longest_side_m", "longest side", "m", max(physical.extents_m)),
        ):
            ends = "".join(
                f'<input data-fix="{name}.{end}" inputmode="decimal" placeholder="{shown}" aria-label="{words}, {end}">'
                for end, shown in (("value", number(value)), ("low", "at least"), ("high", "at most"))
            )
            rows.append(f"<span>{words} {ends} {unit}</span>")
        return _hidden("".join(rows))
    if dimension in ("functional", "grasp") and points is not None:
        kind = dimension[0]
        named = [(p.id, p.label, p.candidate) for p in points.functional] if kind == "f" else []
        named += [(p.id, p.label or p.type, p.candidate) for p in points.grasp] if kind == "g" else []
        fields = "".join(
            f'<label>{text(name)} {text(label)} belongs to candidate <input data-point="{text(name)}" inputmode="numeric"'
            f' placeholder="{candidate}"></label>'
            for name, label, candidate in named
        )
        return _hidden(f'{fields}<span class="note">click a candidate in the 3D view to put it in</span>')
    return ""


def _hidden(fields: str) -> str:
    return f'<div class="fix" hidden>{fields}</div>'


def _strip() -> str:
    shown = "".join(f'<span><kbd data-key="{action}">{key}</kbd> {short}</span>' for action, key, short in SHORT)
    return f'<p class="strip">{shown}</p>\n'


def _keys() -> str:
    rows = "".join(
        f'<label>{text(words)} <input data-map="{action}" data-default="{key}" size="9" readonly value="{key}"></label>'
        for action, key, words in KEYS
    )
    return (
        f'<details class="keys" id="keys"><summary>Change the keys</summary><div class="keymap">{rows}'
        "<p>1 to 7: to a dimension. Shift Enter: confirm with dimensions left out. Escape: out of a field."
        " To change a key, choose its field and press another. "
        '<button type="button" data-act="reset">As at first</button></p></div></details>\n'
    )
