"""Nouns of categories: a wine glass is a glass, a magnifying glass is not, a mug may be called a cup."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache

from manitwin.models.annotators import prior_names

OF_ANOTHER_KIND = frozenset(
    {
        "magnifying glass", "trash can", "watering can", "piggy bank", "power bank", "circuit board", "cutting board",
        "gravy boat", "toy boat", "set top box", "switch box", "snow globe", "caulking gun", "glue gun", "heat gun",
        "staple gun", "pot holder", "curling iron", "soldering iron", "allen key", "hex key", "putty knife", "edible nut",
        "insulin pen", "bowling pin", "rolling pin", "safety pin", "flower pot", "plant pot", "french press",
        "garlic press", "butter stick", "drum stick", "glue stick", "usb stick", "muffin tin", "test tube", "paper towel",
        "hair clipper", "nail clipper", "computer mouse", "toy bucket", "toy hammer", "toy car",
    }
)  # fmt: skip
"""Names whose last word alone means another kind of thing: their noun is the whole name."""


PAIRS = frozenset(
    {"headphones", "earphones", "scissors", "shears", "pliers", "tongs", "tweezers", "glasses", "sunglasses", "goggles"}
)
"""Plural nouns whose unit is a pair."""


_WHAT_FOLLOWS = re.compile(r" (?:of|with|for|in) ")


def noun_of(category: str) -> str:
    """Return the noun of a category: ``bottle`` for ``ketchup bottle``, ``jar`` for ``jar of honey``; ``trash can`` stays."""
    if category in OF_ANOTHER_KIND:
        return category
    return _WHAT_FOLLOWS.split(category.removeprefix("pair of "), maxsplit=1)[0].split()[-1]


def with_shortened_names(names: Iterable[str]) -> frozenset[str]:
    """Return names with all shorter ones that people say for them: ``measuring cup`` and ``cup``; ``jar of honey`` and ``jar``.

    What its last word would make another kind of thing stays whole: a magnifying glass is no glass.
    """
    found = set(names)
    for name in names:
        head = _WHAT_FOLLOWS.split(name.removeprefix("pair of "), maxsplit=1)[0]
        words = head.split()
        if head not in OF_ANOTHER_KIND:
            found |= {" ".join(words[start:]) for start in range(len(words))}
    return frozenset(found)


def words_of(category: str) -> frozenset[str]:
    """Return the words that may stand for a category: its noun and its last word (a jar of honey may be called honey)."""
    return frozenset({noun_of(category), category.split()[-1]})


@cache
def noun_counter(category: str) -> str | None:
    """Return the counter of a category: ``pair of`` scissors, a ``bar of`` soap; None for countable nouns."""
    if category.split()[-1] in PAIRS:
        return None if category.startswith("pair of ") else "pair of"
    prior = prior_names.named(category)
    return None if prior is None else prior_names.counter_phrase(prior, category)


@cache
def nouns_of(category: str) -> frozenset[str]:
    """Return every noun that may denote a category.

    These are its own noun, those of its components (of a cup and saucer), that of its contents (honey of a jar of honey), and
    those of its aliases in the priors (a mug is a coffee cup).
    """
    prior = prior_names.named(category)
    names = {category, *(prior.aliases if prior is not None else ())}
    said = [each for name in names for each in name.split(" and ")]
    found = {noun_of(each) for each in said} | {each.split()[-1] for each in said if " of " in each}
    return frozenset(found - {category.split()[-1]} if category in OF_ANOTHER_KIND else found)
