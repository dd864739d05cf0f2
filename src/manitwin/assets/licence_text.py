"""Licences and attributions that are stated in free text."""

from __future__ import annotations

import re
from collections.abc import Iterable

_KEYS = r"SPDX-License-Identifier|licen[cs]e|attribution|authors?|creator|copyright"
_STATEMENT = re.compile(rf"\W{{0,100}}({_KEYS})\s{{0,20}}[:=]", re.IGNORECASE)
_NEXT = re.compile(rf"\n|;(?=\s{{0,20}}(?:{_KEYS})\s{{0,20}}[:=])", re.IGNORECASE)
_MAX_LETTERS = 1000
_UNSAID = frozenset({"", "unknown", "none", "todo"})


def stated_licence(texts: Iterable[str]) -> tuple[str | None, str | None]:
    """Return the licence and the attribution that texts state as ``licence: ...`` and ``attribution: ...``, or None.

    Statements are lines, or follow a semicolon: one inside of an attribution ends nothing.
    """
    licence = attribution = None
    for text in texts:
        for statement in _NEXT.split(text):
            found = _STATEMENT.match(statement)
            if found is None:
                continue
            value = statement[found.end() : found.end() + _MAX_LETTERS].strip()
            if "licen" in found.group(1).lower():
                licence = licence or _without_marks(value)
            else:
                attribution = attribution or value
    return stated_or_none(licence), stated_or_none(attribution)


def stated_or_none(text: str | None) -> str | None:
    """Return what stands where a licence or an author should, or None for words that say nothing."""
    return None if text is None or text.strip().lower() in _UNSAID else text.strip()


def _without_marks(value: str) -> str:
    """Return a licence without the punctuation that sentences put after it."""
    while value and not (value[-1].isalnum() or value[-1] in "+_"):
        value = value[:-1]
    return value
