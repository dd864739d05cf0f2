"""HTML page of a twin: 3D view, all numbers with interval and source, and all pictures that the model was shown."""

from __future__ import annotations

from collections.abc import Collection

from manitwin.twin.loaded_twin import Twin
from manitwin.twin.record import TwinRecord
from manitwin.web import trial_document
from manitwin.web.html import STAGE, THREE, TRIAL_PLAYER, TWIN_SHAPES, VIEWER, options, page, text
from manitwin.web.links import Links
from manitwin.web.served_files import CARD, INPUTS, MODEL, VIEWS
from manitwin.web.twin_document import DOCUMENT
from manitwin.web.twin_facts import fact_tables, provenance

LAYERS = (
    ("mesh", "M", "Mesh", True),
    ("wireframe", "W", "Wireframe", False),
    ("hulls", "H", "Hulls", False),
    ("candidate", "C", "Candidates", False),
    ("functional", "F", "Functional points", True),
    ("grasp", "P", "Grasp points", True),
    ("grasps", "G", "Grasps", True),
    ("mass", "O", "Centre of mass", False),
    ("cube", "B", "10 cm cube", True),
    ("gripper", "R", "Gripper beside it", False),
)
"""Layers of the 3D view: name, key, label, and whether initially visible."""
KEYS = (
    ("← → ↑ ↓", "turn"), ("+ −", "nearer, farther"), ("0", "from the front again"), ("[ ]", "fewer, more grasps"),
    ("N  Shift N", "next, previous grasp: the whole hand"), ("T  Shift T", "play or pause its trial, close it"),
    ("L", "next placement"), ("K", "colours of grasps"),
)  # fmt: skip
SCRIPTS = (THREE, STAGE, TWIN_SHAPES, TRIAL_PLAYER, VIEWER)
"""Scripts of the 3D view of a twin, in execution order."""
SPEEDS = (("0.1", "⅒ ×"), ("0.25", "¼ ×"), ("0.5", "½ ×"), ("1", "1 ×"), ("2", "2 ×"))
DATA_SCRIPT, MODEL_SCRIPT, TRIALS_SCRIPT = "viewer.js", "visual.glb.js", "trials.js"
"""Data scripts of static files, since browsers load scripts from file URLs but neither JSON nor GLB."""


def twin_page(twin: Twin, links: Links, *, with_gallery: bool = True, with_trials: bool = True) -> str:
    """Return the page of an accepted or rejected twin; ``with_trials`` adds the playback of grasp trials."""
    record = twin.record
    name = record.name or (record.language.category if record.language else None) or record.twin_id
    back = f'<nav><a href="{text(links.gallery())}">All twins</a></nav>' if with_gallery else ""
    said = record.language.caption if record.language else (record.rejection.detail if record.rejection else "")
    body = (
        f'<header class="top">{back}<h1>{text(name)} <span class="status {record.status}">{record.status}</span></h1>'
        f'<p class="caption">{text(said)}</p></header>\n'
    )
    if record.status == "rejected":
        return page(name, f"{body}{_rejected(twin, links)}", links)
    own = () if links.live else (DATA_SCRIPT, MODEL_SCRIPT, *((TRIALS_SCRIPT,) if with_trials else ()))
    body += (
        f'<div class="twin">\n{viewer(record, links, with_trials=with_trials)}'
        f'<main id="main">\n{_language_section(record)}{fact_tables(record)}'
        f"{_downloads(record, links)}</main>\n</div>\n{pictures(twin, links)}"
    )
    return page(name, body, links, scripts=SCRIPTS, data=own)


def viewer(record: TwinRecord, links: Links, *, with_trials: bool = True, hidden: Collection[str] = ()) -> str:
    """Return the 3D view with its controls; ``hidden`` layers are initially invisible."""
    layers = "".join(
        f'<label><input type="checkbox" data-layer="{name}"{" checked" if shown and name not in hidden else ""}>'
        f" {words} <kbd>{key}</kbd></label>"
        for name, key, words, shown in LAYERS
    )
    known = [(key, does) for key, does in KEYS if with_trials or not key.startswith("T")]
    keys = "".join(f"<div><dt>{text(key)}</dt><dd>{text(does)}</dd></div>" for key, does in known)
    trials = links.file(record.twin_id, trial_document.DOCUMENT, record.revision).split("?")[0]
    places = (
        f' data-document="{text(links.file(record.twin_id, DOCUMENT, record.revision))}"'
        f' data-model="{text(links.file(record.twin_id, MODEL, record.revision))}" data-trial="{text(trials)}"'
    )
    card = text(links.file(record.twin_id, CARD, record.revision))
    return (
        f'<section class="viewer" id="viewer" aria-label="3D view"{places}>\n'
        '<div class="stage" tabindex="0" role="application" aria-label="3D view; the keys are listed below it">'
        '<div class="tip" hidden></div><div class="scale" aria-hidden="true"></div></div>\n'
        '<p class="said" role="status" aria-live="polite">Loading …</p>\n'
        f'<noscript><img class="card" alt="The twin\'s card" src="{card}"></noscript>\n'
        f'<div class="layers">{layers}</div>\n'
        '<div class="controls">'
        '<label>Gripper <select data-control="gripper"></select></label>'
        '<label>Grasps <input type="range" data-control="count" min="0" max="0" value="0"><output></output></label>'
        '<label>Colours <select data-control="color"><option value="outcome">outcome</option>'
        '<option value="robustness">robustness</option></select></label>'
        '<label>Pose <select data-control="placement"><option value="">object frame</option></select></label></div>\n'
        '<div class="legend" role="group" aria-label="Outcomes of grasps"></div>\n'
        f"{_trial() if with_trials else ''}"
        f'<details class="keys"><summary>Keys</summary><dl>{keys}</dl></details>\n</section>\n'
    )


def _trial() -> str:
    speeds = options(SPEEDS, "1")
    return (
        '<div class="trial player" role="group" aria-label="Trial of the chosen grasp">'
        '<button type="button" data-trial="play">Play trial <kbd>T</kbd></button>'
        '<input type="range" data-trial="time" min="0" max="0" step="any" value="0" disabled aria-label="time of the trial">'
        f'<select data-trial="speed" disabled aria-label="speed">{speeds}</select>'
        '<button type="button" data-trial="close" disabled>Close</button>'
        '<output data-trial="said"></output></div>\n'
    )


def _language_section(record: TwinRecord) -> str:
    language = record.language
    if language is None:
        return ""
    facts = [(name, getattr(language, name)) for name in ("category", "color", "material", "size", "shape", "function")]
    listed = "".join(f"<div><dt>{name}</dt><dd>{text(said)}</dd></div>" for name, said in facts)
    stage = record.provenance.stages.get("caption")
    source = f'<p class="note">source: {text(stage.model or stage.backend)}</p>' if stage else ""
    others = "".join(f"<li>{text(each)}</li>" for each in language.captions if each != language.caption)
    more = f"<details><summary>More captions</summary><ul>{others}</ul></details>" if others else ""
    return f'<dl class="words">{listed}</dl>\n{source}{more}\n'


def _downloads(record: TwinRecord, links: Links) -> str:
    if not links.live:
        return ""
    names = (MODEL, CARD, "twin.json")
    listed = ", ".join(
        f'<a href="{text(links.file(record.twin_id, name, record.revision))}" download>{name}</a>' for name in names
    )
    return f'<p class="note">Files: {listed}</p>\n'


def pictures(twin: Twin, links: Links, *, with_card: bool = True) -> str:
    """Return the card and every picture that the model was shown; ``with_card`` False omits the card, which shows intervals."""
    record = twin.record
    shown = [("card", CARD, "card")] if with_card and CARD in record.files else []
    if links.live and record.source.file in INPUTS:
        shown.append(("source", record.source.file, "the input"))
    shown += [
        ("view", name, name.removeprefix("views/").removesuffix(".webp").replace("_", " "))
        for name in sorted(record.files, reverse=True)
        if VIEWS.fullmatch(name)
    ]
    if not shown:
        return ""
    figures = "".join(
        f'<figure class="{kind}"><img loading="lazy" decoding="async" alt="{text(said)}"'
        f' src="{text(links.file(record.twin_id, name, record.revision))}"><figcaption>{text(said)}</figcaption></figure>\n'
        for kind, name, said in shown
    )
    note = (
        "The model that named the object and chose its points was shown the input, the views (rgb), the views with the"
        " numbered candidates (marked) and, where it looks once more, each functional point from nearby (closer)."
        f"{'' if links.live else ' The input is not among these files.'}"
    )
    return f'<section class="pictures"><h2>Pictures</h2>\n<p class="note">{note}</p>\n<div>{figures}</div></section>\n'


def _rejected(twin: Twin, links: Links) -> str:
    record = twin.record
    assert record.rejection is not None
    why = f"{record.rejection.stage}: {record.rejection.reason.replace('_', ' ')}"
    return (
        f'<main id="main"><p class="why">Rejected at {text(why)}</p>\n{provenance(record)}</main>\n'
        f"{pictures(twin, links)}"
    )
