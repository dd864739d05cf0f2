"""Find the prior of what a person calls a thing: by category or alias, in the singular, with words left out."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from itertools import combinations

from manitwin.errors import ManiTwinError
from manitwin.models.annotators.diacritics import without_diacritics
from manitwin.models.annotators.names_abroad import category_abroad
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors

_BETWEEN_WORDS = r"(?:[^a-z0-9&+'.]|\.(?!\d)|(?<!\d)\.)+"
"""A point between two digits is a number's own: 1.5 cm."""


def normalised(name: str) -> str:
    """Return a name in lower-case Latin letters without marks, punctuation, articles and what follows a comma or bracket."""
    head = re.split(r"[,(\[;:]", without_diacritics(name), maxsplit=1)[0]
    words = re.sub(_BETWEEN_WORDS, " ", head.replace("’", "'").replace("'s ", " ").replace("'", "")).split()
    return " ".join(words[1:] if words[:1] in (["a"], ["an"], ["the"]) and len(words) > 1 else words)


def singulars(phrase: str) -> Iterator[str]:
    """Yield the phrase, and what its last word may be the plural of."""
    yield phrase
    for plural, singular in (("ives", "ife"), ("ves", "f"), ("ies", "y"), ("oes", "o"), ("s", ""), ("es", "")):
        if phrase.endswith(plural) and len(phrase) > len(plural) + 1:
            yield phrase.removesuffix(plural) + singular


@cache
def _index() -> dict[str, Prior]:
    index: dict[str, Prior] = {}
    for prior in load_priors().values():
        for name in (prior.category, *prior.aliases):
            key = normalised(name)
            if key in index:
                raise ManiTwinError(f"priors: {name!r} names both {index[key].category!r} and {prior.category!r}")
            index[key] = prior
    return index


@cache
def _written_together() -> dict[str, str]:
    """The names of the index by their letters alone, but for those that more than one prior has."""
    index = _index()
    found: dict[str, set[str]] = {}
    for name in index:
        found.setdefault(name.replace(" ", ""), set()).add(name)
    return {
        letters: min(names) for letters, names in found.items() if len({index[name].category for name in names}) == 1
    }


def named(name: str) -> Prior | None:
    """Return the prior whose category or alias a name is, whole or in the plural; None where it is no such name."""
    index = _index()
    return next((index[phrase] for phrase in singulars(normalised(name)) if phrase in index), None)


def named_together(name: str) -> Prior | None:
    """Return the prior of a name that is written as one word where its own is two, or None: a doorknob."""
    together = _written_together()
    return next((named(together[each]) for each in singulars(normalised(name)) if each in together), None)


def lookup(name: str | None) -> Prior | None:
    """Find the prior of what a person calls a thing; None where the table has no such thing (``found_by``)."""
    found = found_by(name)
    return None if found is None else found[0]


_MOST_WORDS_BEFORE = 6
_NUMBER = r"\d+(?:\.\d+)?"
_NO_THING = re.compile(
    rf"[a-z]?{_NUMBER}[a-z]?|{_NUMBER}(?:x{_NUMBER})*(?:mm|cm|in|inch|ft|ml|cl|dl|oz|kg|lbs?)?"
    r"|mm|cm|inch|inches|ml|cl|dl|oz|kg|lbs?|lit(?:er|re)s?|grams?|kilos?|[a-z]"
    r"|smooth|original|classic|organic|natural|small|medium|large"
    r"|black|white|gr[ae]y|silver|red|green|blue|yellow|orange|brown|pink|purple|beige"
)


_IMITATIONS = {"toy": "toy", "plush": "stuffed toy", "stuffed": "stuffed toy"}
"""What a thing is of which one word says that it is made after another: a toy elephant is a toy."""
_SMALL = frozenset({*_IMITATIONS, "doll", "dollhouse", "miniature"})
"""What a chair or a table is called that is none: toys of things with the name alone, as of tools, have entries of their own."""
_TOO_LARGE = "furniture"
"""The domain of things that no hand holds, so that what is called a toy of one is a toy."""


def found_by(name: str | None) -> tuple[Prior, str] | None:
    """Find the prior of what a person calls a thing, and the words, in the singular, by which it is found.

    Tried in order: the whole name, or an alias of it; the part before 'of', 'with', 'without', 'no', 'for', 'in', 'on' or 'from';
    the whole again: each as it is, in the singular, and with words dropped from the front ('red coffee mugs' are coffee mugs,
    which are mugs), and before its last word stands alone with words dropped between ('lego duplo brick' is a lego brick). The
    last word decides what a thing is: a mug rack is no mug. Words are the same written together or apart: a 'waterbottle' is a
    water bottle, and a 'tooth brush' a toothbrush before it is a brush. Where none is found, numbers, measures, colours and what
    is printed on most packs say nothing at the end ('mug_1', 'cube 5 cm', 'pitcher blue' and 'juice smooth 500 ml' are a mug, a
    cube, a pitcher and juice), and what is a toy of anything is a toy, as is a doll's chair. File names are never looked up:
    they are not evidence. What English has no such thing for, and is the whole name of one in another language, is that.
    """
    return (_found_in_english(name) or _found_abroad(name)) if name else None


def _found_abroad(name: str) -> tuple[Prior, str] | None:
    category = category_abroad(name)
    return None if category is None else (_index()[normalised(category)], normalised(category))


def _found_in_english(name: str) -> tuple[Prior, str] | None:
    if not (phrase := normalised(name)):
        return None
    head = re.split(r" (?:made |full )?(?:of|with|for|in|on|without|no|from) ", phrase, maxsplit=1)[0].split()
    words = phrase.split()
    tries = [words, *(head[i:] for i in range(len(head) - 1)), *_words_dropped(head), head[-1:]]
    tries += [words[i:] for i in range(1, len(words))]
    while head and _NO_THING.fullmatch(head[-1]):
        head = head[:-1]
        tries += [head[i:] for i in range(len(head))]
    index, together = _index(), _written_together()
    for part in tries:
        spelt = list(singulars(" ".join(part)))
        for candidate in (*spelt, *(together.get(each.replace(" ", ""), "") for each in spelt)):
            if candidate in index and index[candidate].category != "unknown":
                small = index[candidate].domain == _TOO_LARGE and not _SMALL.isdisjoint(head[:-1])
                return (index["toy"], " ".join(head)) if small else (index[candidate], candidate)
    if ":" in name:  # then what stands before it is a collection: 'Practice: hand wheel valve'
        behind = found_by(name.rpartition(":")[2])
        if behind is not None:
            return behind
    imitation = next((_IMITATIONS[word] for word in head[:-1] if word in _IMITATIONS), None)
    return None if imitation is None else (index[imitation], " ".join(head))


_OF_A_THING = frozenset({"part", "piece", "model", "mesh", "object", "asset"})
"""Last words that say that a name is of a part, or of a file: of which thing, the word before may say."""


def names_with(name: str) -> list[str]:
    """Return the names that have the last word of a name which says anything, the shortest first.

    Of 'beer' these are beer bottle, beer can and others, of 'gear part' gear.
    """
    words = normalised(name).split()
    while words and (words[-1] in _OF_A_THING or _NO_THING.fullmatch(words[-1])):
        words.pop()
    last = set(singulars(words[-1])) if words else set()
    found = (key for key in _index() if last.intersection(key.split()))
    return sorted(found, key=lambda key: (len(key.split()), key))


def _words_dropped(head: list[str]) -> Iterator[list[str]]:
    """Yield a name with words dropped between two that stay, the last of which is its noun; the most and the nearest first."""
    *before, noun = head
    if len(before) > _MOST_WORDS_BEFORE:
        return
    for kept in range(len(before) - 1, 0, -1):
        for places in reversed(list(combinations(range(len(before)), kept))):
            yield [*(before[place] for place in places), noun]


def word_for(prior: Prior, said: str) -> str:
    """Return what a person calls a thing that was found by these words: a 'coffee mug' is a mug, a 'pan' no frying pan.

    What it is sold in, or a kind of, is called so where the words do not say it: 'ketchup' is a ketchup bottle, a 'granny smith'
    a granny smith apple.
    """
    words, category = said.split(), normalised(prior.category).split()
    if words[-len(category) :] == category:
        return prior.category
    whole = [name for name in (prior.category, *prior.aliases) if " of " not in name]
    packed = next((name for name in whole if normalised(name).startswith(f"{said} ")), None)
    if packed is not None:
        return packed
    return next((alias for alias in prior.aliases if normalised(alias) == said), said)  # a cook's knife as it is spelt


def counter_of(prior: Prior, noun: str) -> str | None:
    """Return what one of a prior's things is counted by, None where the noun says it: a bar of soap, but a soap bar."""
    return None if prior.counter is None or prior.counter.split()[0] in noun.split() else prior.counter
