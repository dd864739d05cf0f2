"""Ranking of twins by words: BM25 over their descriptive fields and the aliases of their categories in the priors."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import chain, pairwise

from manitwin.dataset.search.question import Question, words
from manitwin.models.annotators.descriptions import is_metal
from manitwin.models.annotators.prior_names import find_prior

WEIGHTS = {
    "category": 6.0,
    "aliases": 4.0,
    "name": 4.0,
    "color": 3.0,
    "material": 2.0,
    "kind": 1.0,
    "function": 1.0,
    "shape": 1.0,
    "size": 1.0,
    "parts": 0.5,
    "caption": 0.5,
}
"""Weight of a word in each field: category above colour, colour above material."""
UNWANTED_IN = ("category", "aliases", "name", "color", "material", "kind", "parts")
"""Fields in which an unwanted word excludes a twin."""
KINDS = {
    "kitchen": "kitchen kitchenware", "tableware": "tableware kitchen", "tools": "tool", "food": "food", "toys": "toy",
    "electronics": "electronics electronic device", "office": "office stationery", "household": "household",
    "containers": "container", "furniture": "furniture",
}  # fmt: skip
"""Words for all objects of a domain of the priors."""
SATURATION, LENGTH_SHARE = 1.2, 0.75
"""k1 and b of BM25 as in Robertson and Zaragoza 2009, section 3.5."""
SIZE_SHARE = 0.25
"""Largest relative bonus of the smallest (largest) twin of a category if small (large) ones are requested."""
MOST_NEAR, NEARLY = 3, 0.75
"""Maximum number of similarly spelt words suggested for an unknown word, and their minimum similarity (difflib's ratio)."""
_NOT_A_COLOR = re.compile(r"\(.*?\)|unknown color")
_COLORS = frozenset(
    "black white grey gray silver red green blue yellow orange brown pink purple beige gold golden cream".split()  # noqa: SIM905
)


@dataclass(frozen=True)
class WordHit:
    """A twin's position in the input list, its score, and the fields that matched per question word."""

    place: int
    score: float
    matched: dict[str, list[str]]


def text_fields(row: Mapping[str, object]) -> dict[str, str]:
    """Return the texts by field of a row of the index table ``twins``; the aliases are those of the category's prior.

    Colour words are removed from the aliases: the alias "red apple" does not mean that this twin is red.
    """
    texts = {field: str(row.get(field) or "") for field in WEIGHTS}
    texts["color"] = _NOT_A_COLOR.sub(" ", texts["color"])
    if any(is_metal(each) for each in re.split(r", | and | or | with ", texts["material"]) if each):
        texts["material"] += " metal"
    prior = find_prior(texts["category"])
    names = " ".join((prior.category, *prior.aliases)) if prior else ""
    texts["aliases"] = " ".join(word for word in names.split() if word not in _COLORS)
    texts["kind"] = KINDS.get(prior.domain, "") if prior else ""
    return texts


def rank_by_words(
    question: str, texts: list[dict[str, str]], longest_m: Sequence[float] | None = None
) -> list[WordHit]:
    """Return the twins (texts from ``described``) that contain a word of the question, best first; ties keep the input order.

    BM25F: the words of all fields form one document, each weighted by its field's weight and length (Robertson, Zaragoza and
    Taylor 2004, "Simple BM25 extension to multiple weighted fields"). Twins with an unwanted word are left out. If small or large
    objects are requested, ``longest_m`` ranks those of one category. Raises UsageError for a question without words.
    """
    counted = [{field: Counter(words(text)) for field, text in each.items()} for each in texts]
    asked = Question.of(
        question, {word for each in counted for field in each.values() for word in field}, _adjacent_words(texts)
    )
    lengths = {field: _mean(sum(each[field].values()) for each in counted) or 1.0 for field in WEIGHTS}
    forms = set(chain.from_iterable(asked.wanted.values()))
    there = [set(chain.from_iterable(each.values())) & forms for each in counted]
    holding = {word: sum(not same.isdisjoint(each) for each in there) for word, same in asked.wanted.items()}
    unwanted = set(chain.from_iterable(asked.unwanted.values()))
    hits = []
    for place, each in enumerate(counted):
        if any(not unwanted.isdisjoint(each[field]) for field in UNWANTED_IN):
            continue
        score, matched = 0.0, dict[str, list[str]]()
        for word, same in asked.wanted.items():
            found = {field: count for field, counts in each.items() if (count := sum(counts[form] for form in same))}
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
    if asked.larger_first is not None and longest_m is not None:
        hits = _boost_by_size(hits, [each["category"] for each in texts], longest_m, asked.larger_first)
    return sorted(hits, key=lambda hit: (-hit.score, hit.place))


def unknown_words(question: str, texts: list[dict[str, str]]) -> dict[str, list[str]]:
    """Return the question words that no twin (texts from ``described``) has in any form, with similarly spelt words that occur.

    Raises UsageError for a question without words.
    """
    vocabulary = {word for each in texts for text in each.values() for word in words(text)}
    asked = Question.of(question, vocabulary, _adjacent_words(texts))
    unknown = [word for word, forms in asked.wanted.items() if vocabulary.isdisjoint(forms)]
    return {word: get_close_matches(word, sorted(vocabulary), MOST_NEAR, NEARLY) for word in unknown}


def _boost_by_size(
    hits: list[WordHit], categories: list[str], longest_m: Sequence[float], larger_first: bool
) -> list[WordHit]:
    """Increase the scores of hits by the share of hits of their category that they are larger (smaller) than."""
    weighed = []
    for hit in hits:
        others = [each.place for each in hits if categories[each.place] == categories[hit.place] and each is not hit]
        behind = sum((longest_m[hit.place] > longest_m[other]) == larger_first for other in others)
        share = behind / len(others) if others else 0.0
        weighed.append(WordHit(hit.place, hit.score * (1 + SIZE_SHARE * share), hit.matched))
    return weighed


def _adjacent_words(texts: list[dict[str, str]]) -> dict[str, tuple[str, str]]:
    """Return the adjacent words in categories and names, keyed by both words joined."""
    named = (words(each[field]) for each in texts for field in ("category", "name"))
    return {"".join(pair): pair for found in named for pair in pairwise(found)}


def _mean(values: Iterable[int]) -> float:
    listed = list(values)
    return sum(listed) / len(listed) if listed else 0.0
