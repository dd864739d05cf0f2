"""Rank twins by words: BM25 over the fields that describe them, with the priors' other names of their categories."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import chain

from manitwin.errors import UsageError
from manitwin.models.annotators.priors import lookup

WEIGHTS = {
    "category": 6.0,
    "aliases": 4.0,
    "name": 4.0,
    "color": 3.0,
    "material": 2.0,
    "function": 1.0,
    "shape": 1.0,
    "size": 1.0,
    "caption": 0.5,
}
"""What a word in each field counts: what a thing is before what colour it has, and that before what it is made of."""
SATURATION, LENGTH_SHARE = 1.2, 0.75
"""k1 and b of BM25, as Robertson and Zaragoza 2009 give them, section 3.5."""
IGNORED = frozenset(
    "a an and any are as at be by for from in is it me my of on one or some that the this to with you your".split()  # noqa: SIM905
)
SPELLINGS = {
    "gray": "grey", "aluminum": "aluminium", "colored": "coloured", "golden": "gold", "wooden": "wood", "metallic": "metal",
    "violet": "purple", "crimson": "red", "navy": "blue", "cloth": "fabric",
}  # fmt: skip
"""Other spellings of words that descriptions use."""
_WORD = re.compile(r"[^\W_]+")
_NOT_A_COLOR = re.compile(r"\(.*?\)|unknown color")


@dataclass(frozen=True)
class WordHit:
    """A twin's place in ``rows``, its score, and by which words of the question it was found in which fields."""

    place: int
    score: float
    matched: dict[str, list[str]]


def described(row: Mapping[str, object]) -> dict[str, str]:
    """Return the texts by field of a row of the index's table ``twins``; aliases are those of the category's prior."""
    texts = {field: str(row.get(field) or "") for field in WEIGHTS}
    texts["color"] = _NOT_A_COLOR.sub(" ", texts["color"])
    prior = lookup(texts["category"])
    texts["aliases"] = " ".join((prior.category, *prior.aliases)) if prior else ""
    return texts


def rank_by_words(question: str, texts: list[dict[str, str]]) -> list[WordHit]:
    """Return those of twins (``described``) that have a word of the question, the best first; equal ones as they came.

    BM25F: the words of all fields make one document, each counted by its field's weight and length (Robertson, Zaragoza and
    Taylor 2004, "Simple BM25 extension to multiple weighted fields"). Raises UsageError for a question without such words.
    """
    asked = list(dict.fromkeys(words(question)))
    if not asked:
        raise UsageError(f"{question!r} has no word to look for; say what the thing is, such as: a blue mug")
    counted = [{field: Counter(words(text)) for field, text in each.items()} for each in texts]
    lengths = {field: _mean(sum(each[field].values()) for each in counted) or 1.0 for field in WEIGHTS}
    holding = Counter(word for each in counted for word in set(chain.from_iterable(each.values())) & set(asked))
    hits = []
    for place, each in enumerate(counted):
        score, matched = 0.0, dict[str, list[str]]()
        for word in asked:
            found = {field: counts[word] for field, counts in each.items() if counts[word]}
            frequency = sum(
                WEIGHTS[field] * count / (1 - LENGTH_SHARE + LENGTH_SHARE * sum(each[field].values()) / lengths[field])
                for field, count in found.items()
            )
            if found:
                rarity = math.log(1 + (len(texts) - holding[word] + 0.5) / (holding[word] + 0.5))
                score += rarity * frequency * (SATURATION + 1) / (SATURATION + frequency)
                matched[word] = sorted(found)
        if matched:
            hits.append(WordHit(place, score, matched))
    return sorted(hits, key=lambda hit: (-hit.score, hit.place))


def words(text: str) -> list[str]:
    """Return the words of a text that mean something, in the singular and in one spelling."""
    found = (word.casefold() for word in _WORD.findall(text))
    return [_singular(SPELLINGS.get(word, word)) for word in found if word not in IGNORED]


PLURALS = (
    ("ives", "ife"), ("aves", "af"), ("ies", "y"), ("oes", "o"), ("sses", "ss"), ("xes", "x"), ("zes", "z"), ("ches", "ch"),
    ("shes", "sh"), ("us", "us"), ("ss", "ss"), ("s", ""),
)  # fmt: skip
"""Endings of plurals and what stands for each in the singular; of several that fit the first counts."""


def _singular(word: str) -> str:
    for plural, singular in PLURALS:
        if word.endswith(plural) and len(word) > len(plural) + 1:
            return word.removesuffix(plural) + singular
    return word


def _mean(values: Iterable[int]) -> float:
    listed = list(values)
    return sum(listed) / len(listed) if listed else 0.0
