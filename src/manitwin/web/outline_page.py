"""The pages on which a person draws the outlines of things in their photos: a list, and a photo with what is cut away tinted."""

from __future__ import annotations

from urllib.parse import quote

from manitwin.dataset.review.cutouts import DoubtedPhoto
from manitwin.dataset.review.outlines import OutlineSession
from manitwin.web.html import OUTLINE, page, text
from manitwin.web.links import Links

PATH = "/outline"
PICTURE, MASK = "photo.webp", "mask.png"
HINT = "What is tinted is cut away. Hold h to see the photo alone."
LARGEST_BRUSH_PX = 200
TOOLS = (
    ("polygon", "p", "corners", "click around it, Enter or a double click closes"),
    ("brush", "b", "brush", "paint; [ and ] change its size"),
)
WAYS = (
    ("add", "a", "belongs to it"),
    ("remove", "x", "does not belong to it"),
)
ACTS = (
    ("fit", "f", "Fit to edges"),
    ("undo", "z", "Undo"),
    ("clear", "n", "Start from nothing"),
    ("reset", "r", "As it was"),
    ("closer", "+", "Closer"),
    ("farther", "-", "Farther"),
    ("keep", "Enter", "Use this outline"),
    ("later", "s", "Next photo"),
)


def address_of(twin_id: str, name: str = "") -> str:
    """Return the address of a photo's page, or of a file of it."""
    return f"{PATH}/{quote(twin_id, safe='')}{name and f'/{name}'}"


def next_address(session: OutlineSession, twin_id: str) -> str:
    """Return the page of the next photo without an outline behind this one, around the end too; the list where none is left."""
    ids = list(session.photos)
    at = ids.index(twin_id)
    left = [each for each in (*ids[at + 1 :], *ids[:at]) if each not in session.kept]
    return address_of(left[0]) if left else "/"


def list_page(session: OutlineSession, links: Links) -> str:
    """Return the page of all doubted photos of a data set."""
    cards = "".join(
        f'<li class="card"><a href="{address_of(twin_id)}"><img src="{address_of(twin_id, PICTURE)}" alt="" loading="lazy">'
        f'<span class="name">{text(_called(photo))}</span><p class="under">'
        f"{'drawn, to be built' if twin_id in session.kept else text(photo.detail)}</p></a></li>\n"
        for twin_id, photo in session.photos.items()
    )
    left = len(session.photos) - len(session.kept)
    body = (
        f"{_head(session)}"
        f'<main id="main"><ul class="cards find">\n{cards}</ul>\n'
        f'<p class="note">{left} of {len(session.photos)} are not drawn. Those that are drawn are built when the command is ended'
        " (Ctrl-C).</p></main>\n"
    )
    return page("Outlines", body, links)


def outline_page(session: OutlineSession, photo: DoubtedPhoto, links: Links) -> str:
    """Return the page of one photo."""
    twin_id = photo.twin_id
    tools = "".join(
        f'<label title="{text(hint)}"><input type="radio" name="tool" value="{name}"{_checked(name == TOOLS[0][0])}> {words}'
        f" <kbd>{key}</kbd></label>"
        for name, key, words, hint in TOOLS
    )
    ways = "".join(
        f'<label><input type="radio" name="way" value="{name}"{_checked(name == WAYS[0][0])}> {words} <kbd>{key}</kbd></label>'
        for name, key, words in WAYS
    )
    acts = "".join(
        f'<button type="button" data-act="{name}" data-press="{text(key)}">{words} <kbd>{text(key)}</kbd></button>'
        for name, key, words in ACTS
    )
    body = (
        f'{_head(session)}<main id="main" class="outlining">\n'
        '<div class="drawing"><canvas id="canvas" role="img" aria-label="The photo, what is cut away tinted"></canvas></div>\n'
        f'<form id="outline" data-page="{address_of(twin_id)}" data-photo="{address_of(twin_id, PICTURE)}"'
        f' data-mask="{address_of(twin_id, MASK)}" data-next="{next_address(session, twin_id)}">\n'
        f"<h2>{text(_called(photo))}</h2>\n"
        f'<div class="controls" role="radiogroup" aria-label="Tool">{tools}'
        f'<label>size <input type="range" id="size" min="2" max="{LARGEST_BRUSH_PX}" value="24"></label></div>\n'
        f'<div class="controls" role="radiogroup" aria-label="What is drawn">{ways}</div>\n'
        f'<p class="acts">{acts}</p>\n'
        f'<p class="said" id="said" role="status" aria-live="polite">{HINT}</p>\n'
        f'<p class="note">{text(photo.detail)}</p>\n</form></main>\n'
    )
    return page(f"Outline of {_called(photo)}", body, links, scripts=[OUTLINE])


def _head(session: OutlineSession) -> str:
    return (
        f'<header class="top"><h1>Outlines</h1><nav><a href="/">all photos</a></nav><p class="caption" id="progress">'
        f"{text(session.annotator)}: {len(session.kept)} drawn, {len(session.photos) - len(session.kept)} left</p></header>\n"
    )


def _called(photo: DoubtedPhoto) -> str:
    return photo.item.title


def _checked(is_chosen: bool) -> str:
    return " checked" if is_chosen else ""
