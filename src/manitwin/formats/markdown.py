"""Escaping of untrusted text as one printable line and as Markdown, and Markdown tables."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence


def one_line(text: str) -> str:
    """Return text as one printable line: characters that are not printable (controls, surrogates, line breaks) become spaces."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def markdown_escaped(text: str) -> str:
    """Escape untrusted text as one line that Markdown and HTML show literally; unprintable characters become spaces."""
    return re.sub(r"([\\`*_\[\]|#])", r"\\\1", html.escape(one_line(text), quote=False))


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, align: str = "") -> list[str]:
    """Return the lines of a table, by default with text in the first column and numbers in the others (``align``: ``lr``)."""
    sides = align or "l" + "r" * (len(head) - 1)
    rule = ["---" if side == "l" else "---:" for side in sides]
    return [f"| {' | '.join(cells)} |" for cells in (head, rule, *rows)]
