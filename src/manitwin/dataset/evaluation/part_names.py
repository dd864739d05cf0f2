"""Matching of part names in everyday words: which names are synonyms, and which denote a location on another part."""

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
"""Nouns for locations on a part, or synonyms of it. A body includes its sides; tines, bowl and bristles are the heads of a fork,
a spoon and a brush. A top is not on the body, since it may be a cap's, and the carrier of a blade is more than the blade.
"""


def words_of(text: str) -> frozenset[str]:
    """Return the set of words of a text, in normalized spelling and singular."""
    return frozenset(_normalize_word(word) for word in re.findall(r"[a-z]+", text.lower()))


def is_same_part(name: str, other: str) -> bool:
    """Return whether two part names are equivalent: all words of one are among those of the other, ignoring plurals."""
    one, two = words_of(name), words_of(other)
    return bool(one and two) and (one <= two or two <= one)


def matches_any(name: str, truth: Iterable[str]) -> bool:
    """Return whether a part name matches one of the listed names."""
    return any(is_same_part(name, each) for each in truth)


def is_on_any(name: str, truth: Iterable[str]) -> bool:
    """Return whether a name denotes a listed part, by itself or a synonym, or a location on one."""
    listed = tuple(truth)
    return matches_any(name, listed) or any(_head_noun(name) in _ON.get(_head_noun(each), ()) for each in listed)


def _head_noun(name: str) -> str:
    """Return the head noun of a name, singular: the last word before ``of`` and similar prepositions."""
    found = re.findall(r"[a-z]+", re.split(r"\b(?:of|in|for|on)\b", name.lower())[0])
    return _normalize_word(found[-1]) if found else ""


def _normalize_word(word: str) -> str:
    word = SPELLINGS.get(word, word)
    return word[:-1] if len(word) > 3 and word.endswith("s") and not word.endswith("ss") else word
