"""HTML gallery: one page of cards beside the filters. The URL holds the whole state, so that a link reproduces the view."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from manitwin.web.card_tables import WORDS
from manitwin.web.gallery_query import SORTS, GalleryPage, View, decimal
from manitwin.web.html import GALLERY, number, options, page, text
from manitwin.web.links import THUMBNAIL, Links

_ORDERS = {
    "": "identity", "name": "name", "category": "category", "-verified": "most verified grasps",
    "-robustness_median": "most robust", "-longest_m": "largest", "longest_m": "smallest", "-mass_kg": "heaviest",
    "mass_kg": "lightest", "stage": "stage", "reason": "reason",
}  # fmt: skip
_BOUNDS = (
    ("Longest side, m", "longest_min", "longest_max"),
    ("Mass, kg", "mass_min", "mass_max"),
)
MOST_FACETS = 1_000
"""Maximum number of categories in the selection list; others can be searched by words."""


def gallery_page(found: GalleryPage, title: str, links: Links, error: str = "", asked: View | None = None) -> str:
    """Return the page of a view. After an ``error``, the filters are those of the requested view ``asked``."""
    view = found.view
    body = (
        f"{_header(found, title, links)}"
        f'<div class="gallery">\n{_filters(found, view if asked is None else asked, links)}<main id="main">\n'
        + (f'<p class="error" role="alert">{text(error)}</p>\n' if error else "")
        + f'<p class="count" role="status">{_count_text(found)}</p>\n'
        + cards(found.rows, view.status, links)
        + _pages(found, links)
        + "</main>\n</div>\n"
    )
    return page(title, body, links, scripts=[GALLERY])


def static_gallery_page(rows: Sequence[dict[str, Any]], status: str, title: str, said: str, links: Links) -> str:
    """Return a static gallery of given rows: all cards, and a text field that filters them."""
    body = (
        f'<header class="top"><h1>{text(title)}</h1></header>\n<main id="main" class="plain">\n'
        '<form class="find" hidden><label>Words <input type="search" id="find"></label></form>\n'
        f'<p class="count" id="count" role="status" data-of="{len(rows)}">{text(said)}</p>\n'
        f"{cards(rows, status, links)}</main>\n"
    )
    return page(title, body, links, scripts=[GALLERY])


def cards(rows: Sequence[dict[str, Any]], status: str, links: Links) -> str:
    """Return the cards of rows; their pictures are loaded lazily."""
    return '<ul class="cards">\n' + "".join(_card(row, status, links) for row in rows) + "</ul>\n"


def _card(row: dict[str, Any], status: str, links: Links) -> str:
    name = row["name"] or row.get("category") or row["twin_id"]
    if status == "accepted":
        source = text(links.file(row["twin_id"], THUMBNAIL, row["revision"]))
        picture = f'<img loading="lazy" decoding="async" width="256" height="256" alt="" src="{source}">'
        facts, under = _facts(row), row["category"] if row["category"] != name else row["material"] or ""
    else:
        picture = f'<span class="none">{text(row["reason"].replace("_", " "))}</span>'
        facts, under = [("stage", row["stage"])], row["detail"]
    listed = "".join(f"<div><dt>{text(term)}</dt><dd>{text(said)}</dd></div>" for term, said in facts)
    words = f' data-words="{text(row[WORDS])}"' if WORDS in row else ""
    return (
        f'<li class="card {status}"{words}><a href="{text(links.twin(row["twin_id"]))}">{picture}'
        f'<span class="name">{text(name)}</span></a><p class="under">{text(under)}</p><dl>{listed}</dl></li>\n'
    )


def _facts(row: dict[str, Any]) -> list[tuple[str, str]]:
    facts = [("size", f"{number(100 * row['longest_m'])} cm"), ("mass", f"{number(row['mass_kg'])} kg")]
    if row["simulated"]:
        facts.append(("grasps", f"{row['verified']} of {row['simulated']} hold"))
    if row["robustness_median"] is not None:
        facts.append(("robust", number(row["robustness_median"], 2)))
    return facts


def _header(found: GalleryPage, title: str, links: Links) -> str:
    tabs = "".join(
        f'<a href="{text(links.gallery(View(status=status).query()))}"'
        f"{' aria-current=page' if status == found.view.status else ''}>{status} <b>{count:,}</b></a>"
        for status, count in found.counts.items()
    )
    return f'<header class="top"><h1>{text(title)}</h1><nav aria-label="Status">{tabs}</nav></header>\n'


def _filters(found: GalleryPage, view: View, links: Links) -> str:
    fields = [f'<label>Words <input type="search" name="q" value="{text(view.q)}"></label>']
    if view.status == "accepted":
        fields.append(_select("Category", "category", found.categories, view.category))
        fields += [_range_filter(said, low, high, view) for said, low, high in _BOUNDS]
        fields.append(_minimum_filter("Verified grasps, at least", "verified_min", view, "1"))
        fields.append(_minimum_filter("Robustness (median), at least", "robustness_min", view, "any"))
    else:
        fields.append('<input type="hidden" name="status" value="rejected">')
        fields.append(_select("Stage", "stage", found.stages, view.stage))
        fields.append(_select("Reason", "reason", found.reasons, view.reason))
    orders = [("", _ORDERS[""]), *((each, _ORDERS[each]) for each in SORTS[view.status])]
    fields.append(f'<label>Order <select name="sort">{options(orders, view.sort)}</select></label>')
    fields.append(
        '<label>Condition, as of <code>manitwin query</code> <input name="where" spellcheck="false" '
        f'autocomplete="off" value="{text(view.where)}"></label>'
    )
    all_of_them = text(links.gallery(View(status=view.status).query()))
    return (
        f'<details class="filters" open><summary>Filters</summary><form method="get" action="{text(links.gallery())}">'
        + "\n".join(fields)
        + f'<p class="buttons"><button>Show</button> <a href="{all_of_them}">Clear</a></p></form></details>\n'
    )


def _select(said: str, name: str, counts: dict[str, int], chosen: str) -> str:
    known = dict(list(counts.items())[:MOST_FACETS])
    if chosen and chosen not in known:
        known[chosen] = counts.get(chosen, 0)
    shown = [("", "any"), *((each, f"{each.replace('_', ' ')} ({count:,})") for each, count in sorted(known.items()))]
    return f'<label>{text(said)} <select name="{name}">{options(shown, chosen)}</select></label>'


def _range_filter(said: str, low: str, high: str, view: View) -> str:
    return (
        f"<fieldset><legend>{text(said)}</legend>{_number(low, 'at least', view)} to "
        f"{_number(high, 'at most', view)}</fieldset>"
    )


def _number(name: str, said: str, view: View) -> str:
    value = getattr(view, name)
    shown = "" if value is None else decimal(value)
    return f'<input type="number" step="any" min="0" name="{name}" aria-label="{said}" placeholder="{said}" value="{shown}">'


def _minimum_filter(said: str, name: str, view: View, step: str) -> str:
    value = getattr(view, name)
    shown = "" if value is None else decimal(value)
    return f'<label>{text(said)} <input type="number" step="{step}" min="0" name="{name}" value="{shown}"></label>'


def _count_text(found: GalleryPage) -> str:
    every = found.counts[found.view.status]
    what = f"{found.total:,} of {every:,}" if found.total != every else f"{every:,}"
    return f"{what} {found.view.status} twins" + (
        f", page {found.view.page:,} of {found.pages:,}" if found.pages > 1 else ""
    )


def _pages(found: GalleryPage, links: Links) -> str:
    if found.pages == 1 and found.view.page == 1:
        return ""
    here, last = found.view.page, found.pages
    numbers = sorted({1, last, *(each for each in range(here - 2, here + 3) if 1 <= each <= last)})
    parts, before = [], 0
    for each in numbers:
        gap = "<span>…</span>" if each > before + 1 else ""
        current = " aria-current=page" if each == here else ""
        parts.append(f'{gap}<a href="{_page_url(found, links, each)}"{current}>{each:,}</a>')
        before = each
    previous = f'<a rel="prev" href="{_page_url(found, links, min(here - 1, last))}">Previous</a>' if here > 1 else ""
    following = f'<a rel="next" href="{_page_url(found, links, here + 1)}">Next</a>' if here < last else ""
    return f'<nav class="pages" aria-label="Pages">{previous}{"".join(parts)}{following}</nav>\n'


def _page_url(found: GalleryPage, links: Links, number_: int) -> str:
    return text(links.gallery(found.view.query(page=number_)))
