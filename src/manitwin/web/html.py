"""HTML building blocks. Every text passes through ``text``, so that record contents are never interpreted as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from manitwin.formats.printable import printable
from manitwin.web.links import Links

STYLE, THREE, VIEWER, GALLERY, REVIEW = "manitwin.css", "three.js", "twin_viewer.js", "gallery.js", "review.js"
STAGE, SCENE_VIEWER, EPISODE_VIEWER = "stage.js", "scene_viewer.js", "episode_viewer.js"
EPISODE_TIMELINE, TWIN_SHAPES, TRIAL_PLAYER = "episode_timeline.js", "twin_shapes.js", "trial_player.js"
OUTLINE = "outline.js"
"""File names of styles and scripts, as served and as written."""


def text(value: object) -> str:
    """Return a value as escaped HTML text, also for attributes; invisible and bidirectional control characters are
    made visible.
    """
    return escape(printable(str(value)), quote=True)


def number(value: float, digits: int = 3) -> str:
    """Return a number with ``digits`` significant digits, without an exponent for moderate magnitudes."""
    if value == 0 or 1e-4 <= abs(value) < 1e6:
        shown = f"{value:.{digits}g}"
        return f"{value:.0f}" if "e" in shown else shown
    return f"{value:.{digits - 1}e}"


def page(title: str, body: str, links: Links, scripts: Sequence[str] = (), data: Sequence[str] = ()) -> str:
    """Return a whole page; ``scripts`` belong to this package, ``data`` are files beside the page that are loaded first."""
    loaded = [*data, *(links.asset(name) for name in scripts)]
    return (
        '<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        '<meta name="color-scheme" content="light dark">\n<link rel="icon" href="data:,">\n'
        f'<title>{text(title)}</title>\n<link rel="stylesheet" href="{links.asset(STYLE)}">\n'
        + "".join(f'<script defer src="{text(source)}"></script>\n' for source in loaded)
        + f"</head>\n<body>\n{body}</body>\n</html>\n"
    )


def table(caption: str, heads: Sequence[str], rows: Iterable[Sequence[Any]], note: str = "") -> str:
    """Return a table whose first column names the row; None is shown as an en dash. Cells are plain values, never HTML."""
    written = "".join(
        f'<tr><th scope="row">{text(row[0])}</th>' + "".join(f"<td>{cell(value)}</td>" for value in row[1:]) + "</tr>\n"
        for row in rows
    )
    if not written:
        return ""
    head = "".join(f'<th scope="col">{text(name)}</th>' for name in heads)
    below = f'<p class="note">{text(note)}</p>\n' if note else ""
    kind = " class=pair" if len(heads) == 2 else ""
    return (
        f'<div class="scroll"><table{kind}><caption>{text(caption)}</caption>\n<thead><tr>{head}</tr></thead>\n'
        f"<tbody>\n{written}</tbody></table></div>\n{below}"
    )


def cell(value: Any) -> str:
    """Return a value as table cell text."""
    if value is None or value == "":
        return "–"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return f"{value:,}"
    return number(value) if isinstance(value, float) else text(value)


def options(choices: Iterable[tuple[str, str]], chosen: str) -> str:
    """Return the options of a select element from pairs of value and label."""
    return "".join(
        f'<option value="{text(value)}"{" selected" if value == chosen else ""}>{text(shown)}</option>'
        for value, shown in choices
    )
