"""XML documents whose bytes depend on their content alone."""

from __future__ import annotations

import math
from collections.abc import Iterable

from lxml import etree  # type: ignore[import-untyped]

from manitwin.assets.writers.licenses import one_line
from manitwin.errors import ExportError


def add(parent: etree._Element, tag: str, text: str | None = None, **attributes: str) -> etree._Element:
    """Append an element and return it; attributes keep the order in which they are given."""
    element = etree.SubElement(parent, tag, attributes)
    element.text = text
    return element


def numbers(*values: float) -> str:
    """Return numbers as the shortest text that reads back as the same ones. Raises ExportError for one that is not finite."""
    for value in values:
        if not math.isfinite(value):
            raise ExportError(f"{value} is no number that a simulator can use; build the twin again")
    return " ".join(repr(float(value) + 0.0) for value in values)  # + 0.0: no negative zero


def document(root: etree._Element, comments: Iterable[str]) -> bytes:
    """Return the document with ``comments`` above everything else in its root element."""
    for position, text in enumerate(comments):
        root.insert(position, etree.Comment(f" {_without_double_hyphen(one_line(text))} "))
    etree.indent(root)
    data: bytes = etree.tostring(root, xml_declaration=True, encoding="utf-8", pretty_print=True)
    return data


def _without_double_hyphen(text: str) -> str:
    """A comment ends at two hyphens (XML 1.0, section 2.5), and may not end with one."""
    while "--" in text:
        text = text.replace("--", "- -")
    return text.rstrip("-")
