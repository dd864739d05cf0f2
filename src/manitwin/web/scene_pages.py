"""HTML pages of scenes: the list of a run's scenes, and one scene with its 3D view and objects."""

from __future__ import annotations

from collections.abc import Sequence

from manitwin.scenes.scene import SceneRecord
from manitwin.web.html import SCENE_VIEWER, STAGE, THREE, number, page, table, text
from manitwin.web.links import Links
from manitwin.web.scene_document import DOCUMENT

PAGE_SCENES = 100
LAYERS = (
    ("mesh", "M", "Meshes", True),
    ("hulls", "H", "Hulls", False),
    ("furniture", "F", "Furniture", True),
    ("supports", "S", "Supports", False),
    ("workspace", "W", "Workspace of the robot", True),
)
"""Layers of the 3D view: name, key, label, and whether initially visible."""
KEYS = (("← → ↑ ↓", "turn"), ("+ −", "nearer, farther"), ("0", "from the front again"))


def list_page(records: Sequence[SceneRecord | str], place: int, count: int, title: str, links: Links) -> str:
    """Return a page of the list; ``records`` are the scenes from ``place`` on, of ``count``, or error messages for unreadable
    ones.
    """
    rows = "".join(_row(each, links) for each in records)
    pages = "".join(
        f'<a href="{text(links.scenes(start))}"{" aria-current=page" if start == place else ""}>'
        f"{start + 1:,}–{min(start + PAGE_SCENES, count):,}</a>"
        for start in range(0, count, PAGE_SCENES)
    )
    heads = ("scene", "furniture", "objects", "robot", "clutter", "what stands there")
    head = "".join(f'<th scope="col">{name}</th>' for name in heads)
    body = (
        f'<header class="top"><h1>{text(title)}</h1><p class="caption">{count:,} scenes</p></header>\n'
        f'<main id="main"><div class="scroll"><table class="scenes"><thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{rows}</tbody></table></div>\n"
        f"{f'<nav class=pages aria-label=Pages>{pages}</nav>' if count > PAGE_SCENES else ''}</main>\n"
    )
    return page(title, body, links)


def _row(record: SceneRecord | str, links: Links) -> str:
    if isinstance(record, str):
        return f'<tr><td colspan="6" class="error">{text(record)}</td></tr>\n'
    things = ", ".join(sorted(each.category for each in record.objects))
    cells = (record.furniture.kind, len(record.objects), record.robot or "–", record.clutter, things)
    return (
        f'<tr><th scope="row"><a href="{text(links.scene(record.scene_id))}">{text(record.scene_id)}</a></th>'
        + "".join(f"<td>{text(cell)}</td>" for cell in cells)
        + "</tr>\n"
    )


def scene_page(
    record: SceneRecord, links: Links, before: str | None, after: str | None, data: Sequence[str] = ()
) -> str:
    """Return the page of a scene; ``before`` and ``after`` are the ids of its neighbours in the list.

    ``data`` are scripts with the data that a server would otherwise provide.
    """
    steps = "".join(
        f'<a rel="{rel}" href="{text(links.scene(scene_id))}">{words}</a>'
        for rel, words, scene_id in (("prev", "previous", before), ("next", "next", after))
        if scene_id is not None
    )
    layers = "".join(
        f'<label><input type="checkbox" data-layer="{name}"{" checked" if shown else ""}> {words} <kbd>{key}</kbd></label>'
        for name, key, words, shown in LAYERS
    )
    keys = "".join(f"<div><dt>{text(key)}</dt><dd>{text(does)}</dd></div>" for key, does in KEYS)
    said = f"{len(record.objects)} objects on a {record.furniture.kind}, {record.clutter} clutter"
    body = (
        f'<header class="top"><nav><a href="{text(links.scenes())}">All scenes</a>{steps}</nav>'
        f'<h1>{text(record.scene_id)}</h1><p class="caption">{text(said)}</p></header>\n'
        '<div class="twin">\n<section class="viewer" id="viewer" aria-label="3D view"'
        f' data-document="{text(links.scene(record.scene_id, DOCUMENT))}">\n'
        '<div class="stage" tabindex="0" role="application" aria-label="3D view; the keys are listed below it">'
        '<div class="tip" hidden></div><div class="scale" aria-hidden="true"></div></div>\n'
        '<p class="said" role="status" aria-live="polite">Loading …</p>\n'
        f'<div class="layers">{layers}</div>\n'
        f'<details class="keys"><summary>Keys</summary><dl>{keys}</dl></details>\n</section>\n'
        f'<main id="main">\n{_objects(record, links)}{_facts(record)}</main>\n</div>\n'
    )
    return page(record.scene_id, body, links, scripts=[THREE, STAGE, SCENE_VIEWER], data=data)


def _objects(record: SceneRecord, links: Links) -> str:
    rows = "".join(
        f'<tr><th scope="row"><a href="{text(links.twin(each.twin_id))}">{text(each.name)}</a></th>'
        f"<td>{text(each.category)}</td><td>{text(f'{each.relation} {each.supported_by or each.surface}')}</td>"
        f"<td>{text(', '.join(number(1000 * value) for value in each.position_m))}</td></tr>\n"
        for each in record.objects
    )
    heads = "".join(f'<th scope="col">{name}</th>' for name in ("object", "category", "stands", "position, mm"))
    return (
        f'<div class="scroll"><table><caption>Objects</caption>\n<thead><tr>{heads}</tr></thead>\n'
        f"<tbody>\n{rows}</tbody></table></div>\n"
    )


def _facts(record: SceneRecord) -> str:
    measures = record.measures
    rows = [
        ("seed and number", f"{record.seed}, {record.number}"),
        ("robot", record.robot),
        ("furniture", record.furniture.kind),
        ("repairs", record.repairs),
        ("moved as it settled, mm at most", 1000 * measures.max_moved_m),
        ("turned as it settled, rad at most", measures.max_turned_rad),
        ("penetration, mm at most", 1000 * measures.max_penetration_m),
        ("least gap, mm", None if measures.min_gap_m is None else 1000 * measures.min_gap_m),
    ]
    return table("Measured by physics when it was made", ("", "value"), rows)
