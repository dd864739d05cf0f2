"""HTML pages for drawing and naming objects in photos: a list, and a photo with its background tinted."""

from __future__ import annotations

from urllib.parse import quote

from manitwin.dataset.review.cutouts import DoubtedPhoto
from manitwin.dataset.review.object_statements import ObjectStatement, known_names, name_remark
from manitwin.dataset.review.outlines import OutlineSession
from manitwin.pipeline.manifest_item import LONGEST
from manitwin.web.html import OUTLINE, page, text
from manitwin.web.links import Links

PATH, NAME_PATH = "/outline", "/name"
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
FIELDS = (
    ("name", "c", "name"),
    ("longest_side_cm", "l", "longest side, cm"),
)
ACTS = (
    ("fit", "f", "Fit to edges"),
    ("undo", "z", "Undo"),
    ("clear", "n", "Start from nothing"),
    ("reset", "r", "As it was"),
    ("closer", "+", "Closer"),
    ("farther", "-", "Farther"),
    ("keep", "Enter", "Use this outline"),
    ("words", "k", "Keep name and size alone"),
    ("later", "s", "Next photo"),
)


def address_of(key: str, name: str = "") -> str:
    """Return the URL of a photo's page, or of a file of it."""
    return f"{PATH}/{quote(key, safe='')}{name and f'/{name}'}"


def next_address(session: OutlineSession, key: str) -> str:
    """Return the page of the next photo without an outline, wrapping around; the list if none is left."""
    keys = list(session.photos)
    at = keys.index(key)
    left = [each for each in (*keys[at + 1 :], *keys[:at]) if each not in session.outlined_keys]
    return address_of(left[0]) if left else "/"


def list_page(session: OutlineSession, links: Links) -> str:
    """Return the list of all doubted photos of a data set."""
    cards = "".join(
        f'<li class="card"><a href="{address_of(key)}"><img src="{address_of(key, PICTURE)}" alt="" loading="lazy">'
        f'<span class="name">{text(_photo_name(session, key))}</span><p class="under">'
        f"{text(_state(session, photo))}</p></a></li>\n"
        for key, photo in session.photos.items()
    )
    left = len(session.photos) - len(session.outlined_keys)
    body = (
        f"{_head(session)}"
        f'<main id="main"><ul class="cards find">\n{cards}</ul>\n'
        f'<p class="note">{left} of {len(session.photos)} are not drawn. Those that are drawn are built when the command is ended'
        " (Ctrl-C).</p></main>\n"
    )
    return page("Outlines", body, links)


def outline_page(session: OutlineSession, photo: DoubtedPhoto, links: Links) -> str:
    """Return the page of one photo."""
    key, words = photo.key, session.words(photo.key)
    tools = "".join(
        f'<label title="{text(hint)}"><input type="radio" name="tool" value="{name}"{_checked(name == TOOLS[0][0])}> {called}'
        f" <kbd>{press}</kbd></label>"
        for name, press, called, hint in TOOLS
    )
    ways = "".join(
        f'<label><input type="radio" name="way" value="{name}"{_checked(name == WAYS[0][0])}> {called} <kbd>{press}</kbd></label>'
        for name, press, called in WAYS
    )
    acts = "".join(
        f'<button type="button" data-act="{name}" data-press="{text(press)}">{called} <kbd>{text(press)}</kbd></button>'
        for name, press, called in ACTS
    )
    body = (
        f'{_head(session)}<main id="main" class="outlining">\n'
        '<div class="drawing"><canvas id="canvas" role="img" aria-label="The photo, what is cut away tinted"></canvas></div>\n'
        f'<form id="outline" data-page="{address_of(key)}" data-photo="{address_of(key, PICTURE)}"'
        f' data-mask="{address_of(key, MASK)}" data-next="{next_address(session, key)}">\n'
        f"<h2>{text(photo.title)}</h2>\n{_fields(words)}"
        f'<div class="controls" role="radiogroup" aria-label="Tool">{tools}'
        f'<label>size <input type="range" id="size" min="2" max="{LARGEST_BRUSH_PX}" value="24"></label></div>\n'
        f'<div class="controls" role="radiogroup" aria-label="What is drawn">{ways}</div>\n'
        f'<p class="acts">{acts}</p>\n'
        f'<p class="said" id="said" role="status" aria-live="polite">{HINT}</p>\n'
        f'<p class="note">{text(photo.detail)}</p>\n</form></main>\n'
    )
    return page(f"Outline of {photo.title}", body, links, scripts=[OUTLINE])


def _head(session: OutlineSession) -> str:
    return (
        f'<header class="top"><h1>Outlines</h1><nav><a href="/">all photos</a></nav><p class="caption" id="progress">'
        f"{text(session.annotator)}: {len(session.outlined_keys)} drawn, "
        f"{len(session.photos) - len(session.outlined_keys)} left</p></header>\n"
    )


def _fields(words: ObjectStatement) -> str:
    """Return the input fields for name and length, in the order and with the keys of ``FIELDS``."""
    more = {
        "name": f'list="names" maxlength="{LONGEST["name"]}" placeholder="what it is"',
        "longest_side_cm": 'inputmode="decimal" maxlength="40" placeholder="as usual"',
    }
    fields = "".join(
        f'<label><span>{called} <kbd>{press}</kbd></span><input id="{name}" data-focus="{press}"'
        f' value="{text(getattr(words, name))}" autocomplete="off" spellcheck="false" {more[name]}></label>'
        for name, press, called in FIELDS
    )
    names = "".join(f'<option value="{text(name)}">' for name in known_names())
    return (
        f'<div class="stated">{fields}<datalist id="names">{names}</datalist>\n'
        f'<p class="note" id="known" aria-live="polite" data-asked="{NAME_PATH}">{text(name_remark(words.name))}</p></div>\n'
    )


def _photo_name(session: OutlineSession, key: str) -> str:
    name, title = session.words(key).name, session.photos[key].title
    return f"{title}: {name}" if name else title


def _state(session: OutlineSession, photo: DoubtedPhoto) -> str:
    done = [
        word
        for word, is_done in (
            ("drawn", photo.key in session.outlined_keys),
            ("named or measured", photo.twin_id in session.restated_twins),
        )
        if is_done
    ]
    return f"{', '.join(done)}, to be built" if done else photo.detail


def _checked(is_chosen: bool) -> str:
    return " checked" if is_chosen else ""
