"""Which template's thing a sentence is about, and the words around its name."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import pairwise

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_names import lookup, named, named_together
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.templates.described import is_described, own_materials
from manitwin.models.generators.templates.looks import color_of, look_of, material_of
from manitwin.models.generators.templates.matter import is_food
from manitwin.models.generators.templates.other_shapes import KIN_OF_ANOTHER_SHAPE, is_of_another_shape
from manitwin.models.generators.templates.standard_sizes import is_size_code
from manitwin.models.generators.templates.template import Template
from manitwin.models.generators.templates.vocabulary import FILLER_WORDS, PURPOSE, RELATIVE, speaks_of_others

_BEHIND = (
    frozenset({"of", "in", "from", "made", "that", "which", "painted", "colored", "coloured", ","})
    | {"labelled", "labeled", "marked", "called", "named"}
    | PURPOSE
)
"""Words behind a name that begin what is said of the thing."""
_PARTED = frozenset({"of", "in", "from"})
"""What a thing is, the words before these say: a box of pencils is a box."""
_SHOWN_AS = frozenset(
    {"piece", "kind", "sort", "type", "style", "model", "photo", "picture", "image"}
    | {"rendering", "render", "twin", "replica", "roll", "bar", "tube", "stick", "sheet", "block", "cube"}
)
"""What is behind 'of' is meant: a photo of a mug, a roll of duct tape."""
_GROUPS = frozenset(
    {"set", "pair", "pack", "packet", "stack", "pile", "bunch", "bundle", "collection", "group", "row", "handful"}
    | {"couple", "number", "lot", "lots", "dozen", "dozens"}
)
_ADJECTIVE = re.compile(r"[a-z]{4,}(?:ed|able|ible|less|proof|etic|omic|atic)")
"""Words that are no nouns by their ending, but for those that the priors know: an eraser, magnetic."""
_ADJECTIVES = frozenset(
    {
        "heavy",
        "duty",
        "premium",
        "classic",
        "deluxe",
        "professional",
        "pro",
        "modern",
        "vintage",
        "retro",
        "wireless",
        "cordless",
    }
    | {
        "portable",
        "bluetooth",
        "led",
        "eco",
        "organic",
        "natural",
        "round",
        "square",
        "oval",
        "slim",
        "wide",
        "narrow",
        "double",
    }
    | {
        "single",
        "full",
        "half",
        "empty",
        "hard",
        "soft",
        "fine",
        "medium",
        "new",
        "old",
        "used",
        "thin",
        "extra",
        "universal",
    }
)
"""What shops and people put behind a name that is part of no name."""
USED_ALIKE = 0.6
"""The share of places of use in common, from which a thing of the same shape is worth a hint."""
_COUNTS = frozenset(
    {"two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve", "twenty", "dozen"}
    | {"dozens", "several", "many", "multiple", "few", "both", "various", "couple", "pairs", "sets"}
)


@dataclass(frozen=True)
class NamedCategory:
    """A template's category, materials or colours that its name says (``own``), and the words before and behind the name."""

    category: str
    own: list[str]
    before: list[str]
    tail: list[str]


def plain_words(words: Sequence[str]) -> list[str]:
    """Return words without the marks around them; a comma stays as a word of its own."""
    return [word for word in (word if word == "," else word.strip('.!?;:()"/=') for word in words) if word]


def find_category(words: Sequence[str], text: str, templates: Mapping[str, Template]) -> NamedCategory:
    """Return the category and the words around its name, which is the last and then the longest phrase that names one.

    What a thing is, its last noun says: a phrase is no name where words follow that describe nothing (a mug rack is no mug),
    but for those behind a preposition (a cup of tea is a cup, and so is a box of pencils a box). A material that the name says,
    of those that such a thing is of, is one of the words around it: a wooden spoon is of wood, but a wood chisel is not. Where
    the longer phrase is another thing that the priors know, a shorter one is that only where both have one form and the size
    fits: a pesto jar is a jar, and a garlic bulb no light bulb. A template's bare name means it with nothing before it but how it
    looks: a white king is a chess piece, and a drama king is none.

    Raises UsageError for words that name no category, or several things.
    """
    words = plain_words(words)
    names = {
        name: template.category for template in templates.values() for name in (template.category, *template.names)
    }
    bare = {name: template for template in templates.values() for name in template.bare}
    parted = next((at for at in range(1, len(words)) if _parts(words, at)), len(words))
    shown = bool({*words[:parted]} & (_SHOWN_AS | _GROUPS | _COUNTS))
    other: Prior | None = None
    for end in range(len(words), 0, -1):
        tail = words[end:]
        if tail and not _says_more(tail):
            continue
        for start in range(end):
            if words[start] in FILLER_WORDS or "," in words[start:end] or (start > parted and not shown):
                continue
            phrase = " ".join(words[start:end])
            prior = (
                named(phrase)
                or named(phrase.replace(" ", ""))
                or (named_together(phrase) if end - start == 1 else None)
            )
            if _says_how_it_looks(words, start, end, prior, names):
                continue
            if is_of_another_shape(phrase, words[:start]):
                raise UsageError(_no_category(text, words, templates))
            meant = [names.get(phrase)]
            if prior is not None:
                meant += [prior.category, None if prior.category in KIN_OF_ANOTHER_SHAPE else prior.kin_of]
            if phrase in bare and other is None and _is_alone(words[:start], tail, bare[phrase]):
                meant.append(bare[phrase].category)
            category = next((name for name in meant if name in templates), None)
            if category is None:
                other = other or prior
                continue
            if other is not None and not _stands_for(other, category):
                raise UsageError(_no_category(text, other.category.split(), templates))
            _check_one_thing(text, words[:start], words[start:end], load_priors()[category], set(names))
            own = _own_words(words[start:end], templates[category], load_priors()[category])
            return NamedCategory(category, own, _without_counter(words[:start]), tail)
    raise UsageError(_no_category(text, words, templates))


def _is_alone(before: Sequence[str], tail: Sequence[str], template: Template) -> bool:
    """Tell whether words before a bare name say no more than how a thing looks, and all of a material that such things are of."""
    usual = {look_of(choice).surface for choices in template.slots.values() for choice in choices if choice}
    looks = [look for word in (*before, *tail) if (look := material_of(word)) is not None]
    said = all(word in FILLER_WORDS or word in RELATIVE or is_described(word) for word in before)
    return said and all(look.surface in usual for look in looks)


def _says_more(tail: Sequence[str]) -> bool:
    """Tell whether words behind a thing's name say more of it, and are no part of the name: 'in red', 'A5', 'size 42'."""
    first, *rest = tail
    if first in _BEHIND or speaks_of_others(tail, 0) or is_size_code(first):
        return True
    if first == "size":  # 'size 42', and no 'king size bed'
        return bool(rest) and (_says_more(rest) or rest[0] in RELATIVE)
    if any(character.isdigit() for character in first) and not _is_number(first):
        return True
    coated = bool(rest) and rest[0].endswith("ed") and _ADJECTIVE.fullmatch(rest[0]) is not None  # 'zinc plated'
    if _is_number(first) or is_adjective(first) or coated or first in FILLER_WORDS or is_described(first):
        return not rest or _says_more(rest)
    return False


def is_adjective(word: str) -> bool:
    """Tell whether a word that says no colour is no noun: 'magnetic', 'foldable', 'heavy duty'."""
    return word in _ADJECTIVES or (_ADJECTIVE.fullmatch(word) is not None and named(word) is None)


def _is_number(word: str) -> bool:
    return word.replace(".", "").isdigit()


def _says_how_it_looks(
    words: Sequence[str], start: int, end: int, prior: Prior | None, names: Mapping[str, str]
) -> bool:
    """Tell whether words that name a thing say how one before them looks or tastes: glass of 'a bottle, green glass'.

    So do a material behind a comma or 'that is', a colour behind it or the thing's name ('a mug orange'), and food before a
    colour ('a mug, lemon yellow') or behind a comma.
    """
    phrase, behind, before = " ".join(words[start:end]), words[end] if end < len(words) else "", words[:start]
    is_look = end - start == 1 and material_of(phrase) is not None
    food = prior is not None and prior.domain == "food" and prior.category in names
    colored = color_of(phrase) is not None or (food and color_of(behind) is not None)
    if not (is_look or colored or (food and "," in before)):
        return False
    ends = [at for at, word in enumerate(before) if word in _BEHIND - _PARTED - PURPOSE]
    if colored:
        telling = [at for at, word in enumerate(before) if word not in FILLER_WORDS and not is_described(word)]
        ends += [at + 1 for at in telling[-1:]]
    return any(" ".join(before[first:last]) in names for last in ends for first in range(last))


def _parts(words: Sequence[str], at: int) -> bool:
    """Tell whether a word parts a thing from what is in it or beside it: 'full' in 'a cup full of tea'."""
    return words[at] in _PARTED or speaks_of_others(words, at)


def _without_counter(before: list[str]) -> list[str]:
    """Return the words before a name without what it is counted by: red, of 'a pair of red pliers'."""
    at = next(
        (at for at, (word, of) in enumerate(pairwise(before)) if of == "of" and word in _GROUPS | _SHOWN_AS), None
    )
    return before if at is None else before[:at] + before[at + 2 :]


def _check_one_thing(text: str, before: list[str], name: list[str], prior: Prior, names: set[str]) -> None:
    """Raise UsageError where a text asks for several objects: a pair of pliers is one, and two forks are not."""
    words = [*before, *name]
    plural = name[-1].endswith("s") and named(name[-1].removesuffix("s")) is not None
    groups = [word for word, of in pairwise(words) if of == "of" and word in _GROUPS]
    counted = [word for word in before if word in _COUNTS and (plural or word == before[-1] or prior.counter)]
    numbers = [
        word for word in before[:1] if re.fullmatch(r"\d+", word) and int(word) > 1 and (plural or len(before) == 1)
    ]
    several = [group for group in groups if f"{group} of" != prior.counter] + counted + numbers
    if several:
        raise UsageError(
            f"{text!r} asks for several objects ({several[0]}): one text makes one object; describe one, and give"
            f" the number with --count"
        )
    if "and" in name and " ".join(name) not in names:
        raise UsageError(
            f"{text!r} asks for several objects ({' '.join(name)}): one text makes one object; name one of them"
        )
    other = next((first for first, word in pairwise(before) if word == "and" and first in names), None)
    if other is not None:
        raise UsageError(
            f"{text!r} asks for several objects ({other} and {' '.join(name)}): give a separate --text for each"
        )


def _stands_for(meant: Prior, category: str) -> bool:
    """Tell whether things of a category look like those that are meant, and may be as large."""
    prior = load_priors()[category]
    same = (
        meant.category not in KIN_OF_ANOTHER_SHAPE
        and meant.shape == prior.shape
        and [p.label for p in meant.functional] == [p.label for p in prior.functional]
    )
    return same and prior.longest_axis_m.low <= meant.longest_axis_m.typical <= prior.longest_axis_m.high


def _own_words(called: list[str], template: Template, prior: Prior) -> list[str]:
    """Return the words of a name that say a material which the first slot of a template has, or another than is usual.

    Of food, the colour too: a green apple is green, and a red wine glass is not red.
    """
    if is_food(prior) and (colors := [word for word in called[:-1] if color_of(word) is not None]):
        return colors
    known = {look_of(choice).material for choice in next(iter(template.slots.values())) if choice}
    own = [word for word in called[:-1] if (look := material_of(word)) is not None and look.material in known]
    return own or own_materials(called, prior)


def _no_category(text: str, words: list[str], templates: Mapping[str, Template]) -> str:
    """Say that no template makes a thing, and which are of its shape; of a word that nobody knows, which are spelt alike."""
    meant = lookup(" ".join(words))
    alike = [] if meant is None else [name for name in templates if _is_used_alike(load_priors()[name], meant)]
    if alike:
        hint = f"; of its shape there are: {', '.join(alike[:4])}."
    else:
        names = sorted({name for template in templates.values() for name in (template.category, *template.names)})
        said = words if meant is None else meant.category.split()
        # from the noun, which is the last word
        spelt = dict.fromkeys(
            name for word in reversed(said) for name in get_close_matches(word, names, n=2, cutoff=0.6)
        )
        # a block may be a building block
        kinds = [name for name in names if said and name.endswith(f" {said[-1]}")]
        near = [*kinds, *(name for name in spelt if name not in kinds)]
        hint = f"; did you mean {', '.join(near[:4])}?" if near else "."
    return f"no template makes {text!r}{hint} There are {len(templates)} (docs/templates.md)"


def _is_used_alike(one: Prior, other: Prior) -> bool:
    """Tell whether two kinds of things have one shape and nearly the same places of use."""
    ours, theirs = ({part.feature for part in prior.functional} for prior in (one, other))
    return one.shape == other.shape and len(ours & theirs) >= USED_ALIKE * len(ours | theirs)
