"""Self-contained HTML report of a generated data set: counts, tables and sample pictures, without external requests."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from importlib import resources

from manitwin.formats.markdown import one_line

_STYLE = """
.samples { display: grid; grid-template-columns: repeat(auto-fill, minmax(14rem, 1fr)); gap: 1rem; }
.samples > figure { margin: 0; }
.samples img { width: 100%; height: auto; display: block; border-radius: 4px; }
h1, h2 { overflow-wrap: anywhere; }
th.text { min-width: 5.5rem; }
thead th.text { overflow-wrap: break-word; }
td.text { min-width: 4.7rem; }
tbody > tr > * { vertical-align: top; }
"""


@dataclass(frozen=True)
class Picture:
    """A sample picture (PNG bytes) with its caption."""

    png: bytes
    caption: str


@dataclass(frozen=True)
class Table:
    """Rows of texts and numbers below column headings; the first column names the row."""

    caption: str
    headings: Sequence[str]
    rows: Sequence[Sequence[str | int | float | None]]


@dataclass(frozen=True)
class Section:
    """A section of the page with a title, tables, and pictures side by side."""

    title: str
    parts: Sequence[Picture | Table]


def page(title: str, lead: Sequence[str], sections: Sequence[Section]) -> bytes:
    """Return the HTML page in the style of ``manitwin stats``; equal content gives equal bytes."""
    style = resources.files("manitwin.dataset.statistics").joinpath("report.css").read_text(encoding="utf-8")
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n<title>{escape(title)}</title>\n'
        f"<style>\n{style}{_STYLE}</style>\n</head>\n<body>\n<header>\n<h1>{escape(title)}</h1>\n"
        + "".join(f"<p>{escape(one_line(line))}</p>\n" for line in lead)
        + "</header>\n<main>\n"
        + "".join(_section(section) for section in sections)
        + "</main>\n</body>\n</html>\n"
    ).encode()


def _section(section: Section) -> str:
    tables = "".join(_table(part) for part in section.parts if isinstance(part, Table))
    figures = "".join(_figure(part) for part in section.parts if isinstance(part, Picture))
    samples = f'<div class="samples">\n{figures}</div>\n' if figures else ""
    body = tables + samples or '<p class="none">There is nothing to show.</p>\n'
    return f"<section>\n<h2>{escape(section.title)}</h2>\n{body}</section>\n"


def _figure(picture: Picture) -> str:
    said = escape(one_line(picture.caption))
    data = base64.b64encode(picture.png).decode()
    return f'<figure><img alt="{said}" src="data:image/png;base64,{data}"><figcaption>{said}</figcaption></figure>\n'


def _table(table: Table) -> str:
    """Return an HTML table; columns of text are left-aligned, columns of numbers right-aligned."""
    texts = [any(_is_text(row[place]) for row in table.rows) for place in range(len(table.headings))]
    kinds = [' class="text"' if is_text or not place else "" for place, is_text in enumerate(texts)]
    heads = "".join(
        f'<th scope="col"{kind}>{escape(name)}</th>' for name, kind in zip(table.headings, kinds, strict=True)
    )
    rows = "".join(
        f'<tr><th scope="row" class="text">{_cell(row[0])}</th>'
        + "".join(f"<td{kind}>{_cell(value)}</td>" for value, kind in zip(row[1:], kinds[1:], strict=True))
        + "</tr>\n"
        for row in table.rows
    )
    return (
        f'<div class="scroll"><table>\n<caption>{escape(table.caption)}</caption>\n'
        f"<thead><tr>{heads}</tr></thead>\n<tbody>\n{rows}</tbody>\n</table></div>\n"
    )


def _is_text(value: str | int | float | None) -> bool:
    """Return whether a value is text rather than a number with a unit or interval."""
    return isinstance(value, str) and value != "" and not (value[0].isdigit() or value[0] in "+-−–±")


def _cell(value: str | int | float | None) -> str:
    if value is None:
        return "–"
    if isinstance(value, str):
        return escape(one_line(value))
    if isinstance(value, int):
        return f"{value:,}"
    return f"{value:,.0f}" if 1e3 <= abs(value) < 1e9 else f"{value:.3g}"
