"""Parsing of licences and attributions that are stated in free text."""

from __future__ import annotations

import re
from collections.abc import Iterable

_KEYS = r"SPDX-License-Identifier|licen[cs]e|attribution|authors?|creator|copyright"
_STATEMENT = re.compile(rf"\W{{0,100}}({_KEYS})\s{{0,20}}(?:::|[:=])", re.IGNORECASE)
_WRITTEN_OUT = (
    (r"apache(?:\s+licen[cs]e)?,?(?:\s+version|\s+v)?\s*2(?:\.0)?\b", "Apache-2.0"),
    (r"mit\s+licen[cs]e\b", "MIT"),
    (r"(?:the\s+)?(?:3-clause\s+bsd|bsd\s+3-clause)(?:\s+licen[cs]e)?\b", "BSD-3-Clause"),
    (r"(?:the\s+)?(?:2-clause\s+bsd|bsd\s+2-clause)(?:\s+licen[cs]e)?\b", "BSD-2-Clause"),
    (r"creative\s+commons\s+attribution\s+4\.0(?:\s+international)?\b", "CC-BY-4.0"),
    (r"creative\s+commons\s+zero\b(?:\s+v?1\.0)?(?:\s+universal)?", "CC0-1.0"),
)
"""Patterns of licence names written in words, with their SPDX identifiers."""
_NAMED = tuple(
    (
        re.compile(
            rf"(?:licen[cs]ed\s+)?(?:under\s+)?(?:the\s+)?{name}(?!\s*(?:or|and|with|[/+])(?:\W|$))", re.IGNORECASE
        ),
        spdx,
    )
    for name, spdx in _WRITTEN_OUT
)
_NEXT = re.compile(rf"\n|;(?=\s{{0,20}}(?:{_KEYS})\s{{0,20}}[:=])", re.IGNORECASE)
_MAX_LETTERS = 1000
_UNSAID = frozenset({"", "unknown", "none", "todo"})


def stated_licence(texts: Iterable[str]) -> tuple[str | None, str | None]:
    """Return the licence and the attribution stated as ``licence: ...`` and ``attribution: ...`` in texts, or None for each.

    A statement starts a line or follows a semicolon; a semicolon inside an attribution does not end it.
    """
    licence = attribution = None
    for text in texts:
        for statement in _NEXT.split(text):
            found = _STATEMENT.match(statement)
            if found is None:
                continue
            value = statement[found.end() : found.end() + _MAX_LETTERS].strip()
            if "licen" in found.group(1).lower():
                licence = licence or short_licence(_without_marks(value))
            else:
                attribution = attribution or value
    return stated_or_none(licence), stated_or_none(attribution)


def short_licence(text: str) -> str:
    """Return the SPDX identifier if a text begins with a licence in words, such as ``under Apache License, Version 2.0 (...)``.

    Any other text, including one that names several licences, is returned unchanged.
    """
    return next((spdx for name, spdx in _NAMED if name.match(text)), text)


def stated_or_none(text: str | None) -> str | None:
    """Return the stripped text of a licence or author field, or None for a placeholder such as ``unknown`` or ``todo``."""
    return None if text is None or text.strip().lower() in _UNSAID else text.strip()


def _without_marks(value: str) -> str:
    """Strip punctuation from the end of a licence."""
    while value and not (value[-1].isalnum() or value[-1] in "+_"):
        value = value[:-1]
    return value
