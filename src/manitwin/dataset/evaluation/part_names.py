"""Names of parts in words of everyday language: which two mean the same part, and which name a place on a listed one."""

from __future__ import annotations

import re
from collections.abc import Iterable

SPELLINGS = {"gray": "grey", "aluminum": "aluminium", "golden": "gold", "transparent": "clear"}

_SIDES = frozenset({"front", "back", "side", "face", "base", "bottom", "underside"})
_ON = {
    "body": _SIDES | {"casing", "housing"},
    "bowl": frozenset({"head", "scoop"}),
    "bristle": frozenset({"head"}),
    "cap": frozenset({"lid"}),
    "floor": frozenset({"surface"}),
    "handle": frozenset({"grip", "haft"}),
    "lid": frozenset({"cap"}),
    "opening": frozenset({"mouth"}),
    "rim": frozenset({"brim", "lip"}),
    "shaft": frozenset({"shank"}),
    "side": frozenset({"front", "back"}),
    "tine": frozenset({"head", "prong"}),
    "upper": frozenset({"toe", "vamp"}),
}
"""What is on a part of a name, or is it in another word: what has a body has its sides there; tines, a bowl and bristles are the
head of a fork, a spoon and a brush. A top is not on the body (it may be a cap's), and what carries a blade is more than it.
"""


def words_of(text: str) -> frozenset[str]:
    """Return the words of a text, in one spelling, plurals as their singular."""
    return frozenset(_plain(word) for word in re.findall(r"[a-z]+", text.lower()))


def matches(name: str, other: str) -> bool:
    """Tell whether two names of a part mean the same: equal, or all words of one among those of the other, plurals alike."""
    one, two = words_of(name), words_of(other)
    return bool(one and two) and (one <= two or two <= one)


def is_one_of(name: str, truth: Iterable[str]) -> bool:
    """Tell whether a name of a part is one of those listed, as ``matches`` tells."""
    return any(matches(name, each) for each in truth)


def is_on_one_of(name: str, truth: Iterable[str]) -> bool:
    """Tell whether a name is that of a listed part, in the same words or others, or of a place on one."""
    listed = tuple(truth)
    return is_one_of(name, listed) or any(_noun(name) in _ON.get(_noun(each), ()) for each in listed)


def _noun(name: str) -> str:
    """Return what a name calls a thing: the last word before ``of`` and the like, a singular."""
    found = re.findall(r"[a-z]+", re.split(r"\b(?:of|in|for|on)\b", name.lower())[0])
    return _plain(found[-1]) if found else ""


def _plain(word: str) -> str:
    word = SPELLINGS.get(word, word)
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word
