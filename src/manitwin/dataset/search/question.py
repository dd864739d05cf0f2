"""Parsing of search questions: wanted words, unwanted words, and whether small or large objects rank first."""

from __future__ import annotations

import re
from collections.abc import Collection
from dataclasses import dataclass

from manitwin.errors import UsageError
from manitwin.models.annotators.diacritics import remove_diacritics

IGNORED = frozenset(
    (
        "a", "an", "and", "any", "are", "as", "at", "be", "by", "for", "from", "in", "is", "it", "me", "my", "of", "on", "one",
        "or", "some", "that", "the", "this", "to", "with", "you", "your", "but", "thing", "something", "anything", "object",
        "item", "stuff", "which", "used",
    )
)  # fmt: skip
NEGATIONS = frozenset(("not", "no", "without", "except", "non", "isn", "aren"))
SMALL = frozenset(("small", "smaller", "smallest", "little", "mini"))
LARGE = frozenset(("large", "larger", "largest", "big", "bigger", "biggest", "huge"))
SPELLINGS = {
    "gray": "grey", "aluminum": "aluminium", "colored": "coloured", "golden": "gold", "wooden": "wood", "metallic": "metal",
    "violet": "purple", "crimson": "red", "navy": "blue", "cloth": "fabric",
}  # fmt: skip
"""Spelling variants and synonyms mapped to the words that descriptions use."""
PLURALS = (
    ("ives", "ife"), ("aves", "af"), ("ies", "y"), ("oes", "o"), ("sses", "ss"), ("xes", "x"), ("zes", "z"), ("ches", "ch"),
    ("shes", "sh"), ("us", "us"), ("ss", "ss"), ("s", ""),
)  # fmt: skip
"""Plural endings and their singular endings; the first match applies."""
_WORD = re.compile(r"[^\W_]+")


@dataclass(frozen=True)
class Question:
    """``wanted`` maps each searched word to its forms that occur in descriptions; ``unwanted`` likewise for excluded words.

    ``larger_first`` is True if large objects rank first, False for small ones, and None if the question does not say.
    """

    wanted: dict[str, frozenset[str]]
    unwanted: dict[str, frozenset[str]]
    larger_first: bool | None

    @classmethod
    def of(cls, text: str, vocabulary: Collection[str], pairs: dict[str, tuple[str, str]]) -> Question:
        """Parse a question. ``vocabulary`` has the words of all descriptions, ``pairs`` maps joined adjacent words to the two
        words.

        Raises UsageError if the question has no word to search for.
        """
        wanted, unwanted, negated = list[str](), list[str](), False
        for word in _joined(_all_words(text), vocabulary, pairs):
            if word in NEGATIONS:
                negated = True
            elif word not in IGNORED and word != "t":
                (unwanted if negated else wanted).append(word)
                negated = False
        sizes = [word for word in wanted if word in SMALL or word in LARGE]
        if len(sizes) == len(wanted) or len({word in LARGE for word in sizes}) != 1:
            sizes = []  # a size word alone is searched like any other word, since descriptions contain size words
        told = [word for word in wanted if word not in sizes]
        if not told:
            why = "contains only excluded words" if unwanted else "has no word to search for"
            raise UsageError(f"{text!r} {why}; describe the object, such as: a blue mug")
        return cls(
            {word: _forms(word, vocabulary) for word in told},
            {word: _forms(word, vocabulary) for word in unwanted},
            sizes[0] in LARGE if sizes else None,
        )


def words(text: str) -> list[str]:
    """Return the meaningful words of a text, singular and in normalized spelling."""
    return [word for word in _all_words(text) if word not in IGNORED]


def _all_words(text: str) -> list[str]:
    found = (word.casefold() for word in _WORD.findall(remove_diacritics(text)))
    return [word if word in IGNORED else _singular(SPELLINGS.get(word, word)) for word in found]


def _joined(asked: list[str], vocabulary: Collection[str], pairs: dict[str, tuple[str, str]]) -> list[str]:
    """Write compounds as descriptions do: ``hour glass`` becomes hourglass, ``wineglass`` becomes wine glass."""
    found, place = list[str](), 0
    while place < len(asked):
        both = "".join(asked[place : place + 2])
        if len(asked) > place + 1 and both in vocabulary:
            found.append(both)
            place += 2
            continue
        word = asked[place]
        found += pairs[word] if word not in vocabulary and word in pairs else (word,)
        place += 1
    return found


def _forms(word: str, vocabulary: Collection[str]) -> frozenset[str]:
    """Return a word and those of its forms with and without -ing that are in the vocabulary: ``drink`` and ``drinking``."""
    stems = {word}
    if word.endswith("ing") and len(word) > len("ring") + 1:
        stem = word.removesuffix("ing")
        stems |= {stem, f"{stem}e", *([stem[:-1]] if stem[-1] == stem[-2] else [])}
    forms = {f"{each}ing" for each in stems} | {f"{each}{each[-1]}ing" for each in stems}
    forms |= {f"{each[:-1]}ing" for each in stems if each.endswith("e")}
    return frozenset({word} | {form for form in stems | forms if form in vocabulary})


def _singular(word: str) -> str:
    for plural, singular in PLURALS:
        if word.endswith(plural) and len(word) > len(plural) + 1:
            return word.removesuffix(plural) + singular
    return word
