"""Lookup of the prior for an everyday name: by category or alias, in the singular, and with words left out."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from itertools import combinations

from manitwin.errors import ManiTwinError
from manitwin.models.annotators.diacritics import remove_diacritics
from manitwin.models.annotators.foreign_names import category_of_foreign_name
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.templates.looks import COLORS, MATERIAL_WORDING, MATERIALS, SHADES

_BETWEEN_WORDS = r"(?:[^a-z0-9&+'.]|\.(?!\d)|(?<!\d)\.)+"
"""Word separators; a point between two digits is part of a number: 1.5 cm."""


def normalise_name(name: str) -> str:
    """Return a name in lower case without diacritics, punctuation, a leading article, or text after a comma or bracket."""
    head = re.split(r"[,(\[;:]", remove_diacritics(name), maxsplit=1)[0]
    words = re.sub(_BETWEEN_WORDS, " ", head.replace("’", "'").replace("'s ", " ").replace("'", "")).split()
    return " ".join(words[1:] if words[:1] in (["a"], ["an"], ["the"]) and len(words) > 1 else words)


def singulars(phrase: str) -> Iterator[str]:
    """Yield the phrase, and possible singulars of its last word."""
    yield phrase
    for plural, singular in (("ives", "ife"), ("ves", "f"), ("ies", "y"), ("oes", "o"), ("s", ""), ("es", "")):
        if phrase.endswith(plural) and len(phrase) > len(plural) + 1:
            yield phrase.removesuffix(plural) + singular


@cache
def _index() -> dict[str, Prior]:
    index: dict[str, Prior] = {}
    for prior in load_priors().values():
        for name in (prior.category, *prior.aliases):
            key = normalise_name(name)
            if key in index:
                raise ManiTwinError(f"priors: {name!r} names both {index[key].category!r} and {prior.category!r}")
            index[key] = prior
    return index


@cache
def _compound_index() -> dict[str, str]:
    """Return the index names by their letters without spaces, except for those shared by more than one prior."""
    index = _index()
    found: dict[str, set[str]] = {}
    for name in index:
        found.setdefault(name.replace(" ", ""), set()).add(name)
    return {
        letters: min(names) for letters, names in found.items() if len({index[name].category for name in names}) == 1
    }


def named(name: str) -> Prior | None:
    """Return the prior whose category or alias is this name, in the singular or plural; else None."""
    index = _index()
    return next((index[phrase] for phrase in singulars(normalise_name(name)) if phrase in index), None)


def prior_by_compound(name: str) -> Prior | None:
    """Return the prior of a name written as one word instead of two (a doorknob), or None."""
    together = _compound_index()
    return next((named(together[each]) for each in singulars(normalise_name(name)) if each in together), None)


def find_prior(name: str | None) -> Prior | None:
    """Find the prior of an everyday name; None if the table has none (``found_by``)."""
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
"""Words that say that an object imitates another one: a toy elephant is a toy."""
_SMALL = frozenset({*_IMITATIONS, "doll", "dollhouse", "miniature"})
"""Words that make a piece of furniture a toy (a doll's chair); toy tools and the like have entries of their own."""
_TOO_LARGE = "furniture"
"""Domain of objects that are too large for a hand, so that a toy version is a toy."""


_ALONE = frozenset({"cap", "handle", "holder", "roller"})
"""Nouns that name a thing where they stand alone, or with words for its look: with another noun they are a part of that thing,
or made for it (the cap of a pen or a chair's leg, the holder of a cable), of any size, and no hat and no container."""
_OF_ITS_LOOK = frozenset(
    word for said in (*COLORS, *SHADES, *MATERIALS, *MATERIAL_WORDING, "metal", "wool") for word in said.split()
)
_SAYS_LITTLE = frozenset(
    {
        "a", "an", "the", "my", "new", "old", "used", "worn", "simple", "plain", "basic", "modern", "vintage", "classic",
        "cheap", "round", "square", "oval", "flat", "long", "short", "big", "little", "tiny", "huge", "tall", "low", "wide",
        "narrow", "thick", "thin", "wooden", "woolen", "woollen", "metallic", "printed", "3d",
    }
)  # fmt: skip
_JOINED = r" (?:made |full )?(of|with|for|in|on|without|no|from) "
"""What divides a name into the noun with what stands before it, and what is said of that."""


def _is_component_name(phrase: str, noun: str) -> bool:
    """Tell whether a name with a noun of ``_ALONE`` says what else it is of: a 'red bottle cap', the 'handle of a drawer'."""
    if noun not in _ALONE:
        return False
    head, *said = re.split(_JOINED, phrase, maxsplit=1)
    others = [word for word in head.split() if noun not in singulars(word)]
    if said and said[0] in ("of", "for", "from"):
        others += said[1].split()
    return any(
        word not in _OF_ITS_LOOK and word not in _SAYS_LITTLE and not _NO_THING.fullmatch(word) for word in others
    )


def found_by(name: str | None) -> tuple[Prior, str] | None:
    """Find the prior of an everyday name, and the words, in the singular, by which it was found.

    The attempts, in order: the whole name or an alias; the part before 'of', 'with', 'without', 'no', 'for', 'in', 'on' or
    'from'; the whole name again. Each is tried as it is, in the singular, and with words dropped from the front ('red coffee
    mugs' are coffee mugs, which are mugs); before its last word is tried alone, words in between are dropped ('lego duplo
    brick' is a lego brick). The last word decides: a mug rack is not a mug. It does not decide if it is in ``_ALONE``: a pen
    cap is not a cap. Spelling with or without spaces is equivalent: a 'waterbottle' is a water bottle, and a 'tooth brush' a
    toothbrush rather than a brush. If nothing is found, numbers, measures, colours and common package words at the end are
    ignored ('mug_1', 'cube 5 cm', 'pitcher blue' and 'juice smooth 500 ml' are a mug, a cube, a pitcher and juice), and a toy
    version of anything is a toy, as is a doll's chair. File names are never looked up, since they are not evidence. A name
    without an English match is looked up as a whole in other languages.
    """
    return (_find_english(name) or _find_foreign(name)) if name else None


def _find_foreign(name: str) -> tuple[Prior, str] | None:
    category = category_of_foreign_name(name)
    return None if category is None else (_index()[normalise_name(category)], normalise_name(category))


def _find_english(name: str) -> tuple[Prior, str] | None:
    """Return the prior of an English name, with the attempts in the order that ``found_by`` describes."""
    if not (phrase := normalise_name(name)):
        return None
    head = re.split(_JOINED, phrase, maxsplit=1)[0].split()
    words = phrase.split()
    tries = [words, *(head[i:] for i in range(len(head) - 1)), *_shortened_names(head), head[-1:]]
    tries += [words[i:] for i in range(1, len(words))]
    while head and _NO_THING.fullmatch(head[-1]):
        head = head[:-1]
        tries += [head[i:] for i in range(len(head))]
    index, together = _index(), _compound_index()
    for part in tries:
        spelt = list(singulars(" ".join(part)))
        for candidate in (*spelt, *(together.get(each.replace(" ", ""), "") for each in spelt)):
            if of_another := _is_component_name(phrase, candidate):
                break
            if candidate in index and index[candidate].category != "unknown":
                small = index[candidate].domain == _TOO_LARGE and not _SMALL.isdisjoint(head[:-1])
                return (index["toy"], " ".join(head)) if small else (index[candidate], candidate)
        if of_another:
            break
    if ":" in name:  # the text before a colon names a collection: 'Practice: hand wheel valve'
        behind = found_by(name.rpartition(":")[2])
        if behind is not None:
            return behind
    imitation = next((_IMITATIONS[word] for word in head[:-1] if word in _IMITATIONS), None)
    return None if imitation is None else (index[imitation], " ".join(head))


_OF_A_THING = frozenset({"part", "piece", "model", "mesh", "object", "asset"})
"""Last words that refer to a part or a file; the word before may name the object."""


def names_with(name: str) -> list[str]:
    """Return the names that contain the last meaningful word of a name, the shortest first.

    For 'beer' these are beer bottle, beer can and others, for 'gear part' gear.
    """
    words = normalise_name(name).split()
    while words and (words[-1] in _OF_A_THING or _NO_THING.fullmatch(words[-1])):
        words.pop()
    last = set(singulars(words[-1])) if words else set()
    found = (key for key in _index() if last.intersection(key.split()))
    return sorted(found, key=lambda key: (len(key.split()), key))


def _shortened_names(head: list[str]) -> Iterator[list[str]]:
    """Yield a name with inner words dropped; the last word stays, and the variants with the most words come first."""
    *before, noun = head
    if len(before) > _MOST_WORDS_BEFORE:
        return
    for kept in range(len(before) - 1, 0, -1):
        for places in reversed(list(combinations(range(len(before)), kept))):
            yield [*(before[place] for place in places), noun]


def object_noun(prior: Prior, said: str) -> str:
    """Return the noun for an object that was found by these words: a 'coffee mug' is a mug, a 'pan' is not a frying pan.

    Packages and varieties get their full name if the words do not contain it: 'ketchup' is a ketchup bottle, a 'granny smith'
    a granny smith apple.
    """
    words, category = said.split(), normalise_name(prior.category).split()
    if words[-len(category) :] == category:
        return prior.category
    whole = [name for name in (prior.category, *prior.aliases) if " of " not in name]
    packed = next((name for name in whole if normalise_name(name).startswith(f"{said} ")), None)
    if packed is not None:
        return packed
    # keeps the spelling, e.g. of a cook's knife
    return next((alias for alias in prior.aliases if normalise_name(alias) == said), said)


def counter_phrase(prior: Prior, noun: str) -> str | None:
    """Return the counter of a prior ('bar of' for soap), None if the noun already contains it: a soap bar."""
    return None if prior.counter is None or prior.counter.split()[0] in noun.split() else prior.counter
