"""Text from outside as one printable line and as Markdown, and tables in Markdown."""

from __future__ import annotations

import html
import re
from collections.abc import Sequence


def one_line(text: str) -> str:
    """Return text as one printable line: what is not printable (controls, lone surrogates, line breaks) becomes a space."""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())


def markdown_escaped(text: str) -> str:
    """Return text from outside as one line that Markdown and HTML show as it is; what is not printable becomes a space."""
    return re.sub(r"([\\`*_\[\]|#])", r"\\\1", html.escape(one_line(text), quote=False))


def table(head: Sequence[str], rows: Sequence[Sequence[str]], *, align: str = "") -> list[str]:
    """Return the lines of a table whose first column is words and whose others are numbers (or as ``align`` says: ``lr``)."""
    sides = align or "l" + "r" * (len(head) - 1)
    rule = ["---" if side == "l" else "---:" for side in sides]
    return [f"| {' | '.join(cells)} |" for cells in (head, rule, *rows)]
