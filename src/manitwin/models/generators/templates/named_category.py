"""Find the template that a sentence asks for, and the words around the object's name."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import pairwise

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_names import find_prior, named, prior_by_compound
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.templates.look_phrases import is_descriptive, material_words_in_name
from manitwin.models.generators.templates.looks import color_of, look_of, material_of
from manitwin.models.generators.templates.matter import is_food
from manitwin.models.generators.templates.other_shapes import KIN_OF_ANOTHER_SHAPE, is_of_another_shape
from manitwin.models.generators.templates.standard_sizes import is_size_code
from manitwin.models.generators.templates.template import Template
from manitwin.models.generators.templates.vocabulary import FILLER_WORDS, PURPOSE, RELATIVE, is_other_object_start

_DESCRIPTION_STARTERS = (
    frozenset({"of", "in", "from", "made", "that", "which", "painted", "colored", "coloured", ","})
    | {"labelled", "labeled", "marked", "called", "named"}
    | PURPOSE
)
"""Words after a name that start its description."""
_CONTENT_PREPOSITIONS = frozenset({"of", "in", "from"})
"""Words after which contents or origin follow: a box of pencils is a box."""
_CLASSIFIER_NOUNS = frozenset(
    {"piece", "kind", "sort", "type", "style", "model", "photo", "picture", "image"}
    | {"rendering", "render", "twin", "replica", "roll", "bar", "tube", "stick", "sheet", "block", "cube"}
)
"""Nouns whose object follows 'of': a photo of a mug, a roll of duct tape."""
_GROUPS = frozenset(
    {"set", "pair", "pack", "packet", "stack", "pile", "bunch", "bundle", "collection", "group", "row", "handful"}
    | {"couple", "number", "lot", "lots", "dozen", "dozens"}
)
_ADJECTIVE = re.compile(r"[a-z]{4,}(?:ed|able|ible|less|proof|etic|omic|atic)")
"""Words with adjective endings, unless the priors know them as objects: an eraser is a noun, magnetic is not."""
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
"""Product adjectives after a name that are not part of it."""
LEAST_SHARED_FEATURES = 0.6
"""Minimum share of common functional features for an object of equal shape to be suggested."""
_COUNTS = frozenset(
    {"two", "three", "four", "five", "six", "seven", "eight", "nine", "ten", "eleven", "twelve", "twenty", "dozen"}
    | {"dozens", "several", "many", "multiple", "few", "both", "various", "couple", "pairs", "sets"}
)


@dataclass(frozen=True)
class NamedCategory:
    """A template's category, materials or colours in its name (``own``), and the words before and after the name."""

    category: str
    own: list[str]
    before: list[str]
    tail: list[str]


def plain_words(words: Sequence[str]) -> list[str]:
    """Return words without surrounding punctuation; a comma remains a word of its own."""
    return [word for word in (word if word == "," else word.strip('.!?;:()"/=') for word in words) if word]


def find_category(words: Sequence[str], text: str, templates: Mapping[str, Template]) -> NamedCategory:
    """Return the category and the words around its name, which is the last and then the longest phrase that names one.

    The head noun of a phrase determines the object. A phrase is no name if words follow that describe nothing (a mug rack is no
    mug), except after a preposition (a cup of tea is a cup, a box of pencils a box). A material in the name that is usual for the
    object counts as one of the words around it: a wooden spoon is of wood, a wood chisel is not. If the longer phrase is another
    object of the priors, a shorter one only matches if both have one shape and the size fits: a pesto jar is a jar, a garlic bulb
    is no light bulb. A template's bare name only matches after words of appearance: a white king is a chess piece, a drama king
    is not.

    Raises UsageError for words that name no category, or several objects.
    """
    words = plain_words(words)
    names = {
        name: template.category for template in templates.values() for name in (template.category, *template.names)
    }
    bare = {name: template for template in templates.values() for name in template.bare}
    parted = next((at for at in range(1, len(words)) if _is_separator(words, at)), len(words))
    shown = bool({*words[:parted]} & (_CLASSIFIER_NOUNS | _GROUPS | _COUNTS))
    other: Prior | None = None
    for end in range(len(words), 0, -1):
        tail = words[end:]
        if tail and not _is_trailing_description(tail):
            continue
        for start in range(end):
            if words[start] in FILLER_WORDS or "," in words[start:end] or (start > parted and not shown):
                continue
            phrase = " ".join(words[start:end])
            prior = (
                named(phrase)
                or named(phrase.replace(" ", ""))
                or (prior_by_compound(phrase) if end - start == 1 else None)
            )
            if _is_description_of_other(words, start, end, prior, names):
                continue
            if is_of_another_shape(phrase, words[:start]):
                raise UsageError(_unknown_object_message(text, words, templates))
            meant = [names.get(phrase)]
            if prior is not None:
                meant += [prior.category, None if prior.category in KIN_OF_ANOTHER_SHAPE else prior.kin_of]
            if phrase in bare and other is None and _is_bare_name(words[:start], tail, bare[phrase]):
                meant.append(bare[phrase].category)
            category = next((name for name in meant if name in templates), None)
            if category is None:
                other = other or prior
                continue
            if other is not None and not _is_substitute(other, category):
                raise UsageError(_unknown_object_message(text, other.category.split(), templates))
            _require_single_object(text, words[:start], words[start:end], load_priors()[category], set(names))
            own = _own_words(words[start:end], templates[category], load_priors()[category])
            return NamedCategory(category, own, _remove_counter(words[:start]), tail)
    raise UsageError(_unknown_object_message(text, words, templates))


def _is_bare_name(before: Sequence[str], tail: Sequence[str], template: Template) -> bool:
    """Return whether the words around a bare name only describe appearance, with materials that are usual for the object."""
    usual = {look_of(choice).surface for choices in template.slots.values() for choice in choices if choice}
    looks = [look for word in (*before, *tail) if (look := material_of(word)) is not None]
    said = all(word in FILLER_WORDS or word in RELATIVE or is_descriptive(word) for word in before)
    return said and all(look.surface in usual for look in looks)


def _is_trailing_description(tail: Sequence[str]) -> bool:
    """Return whether the words after a name describe it and are not part of the name: 'in red', 'A5', 'size 42'."""
    first, *rest = tail
    if first in _DESCRIPTION_STARTERS or is_other_object_start(tail, 0) or is_size_code(first):
        return True
    if first == "size":  # 'size 42', but not 'king size bed'
        return bool(rest) and (_is_trailing_description(rest) or rest[0] in RELATIVE)
    if any(character.isdigit() for character in first) and not _is_number(first):
        return True
    coated = bool(rest) and rest[0].endswith("ed") and _ADJECTIVE.fullmatch(rest[0]) is not None  # 'zinc plated'
    if _is_number(first) or is_adjective(first) or coated or first in FILLER_WORDS or is_descriptive(first):
        return not rest or _is_trailing_description(rest)
    return False


def is_adjective(word: str) -> bool:
    """Return whether a word that is no colour is not a noun either: 'magnetic', 'foldable', 'heavy duty'."""
    return word in _ADJECTIVES or (_ADJECTIVE.fullmatch(word) is not None and named(word) is None)


def _is_number(word: str) -> bool:
    return word.replace(".", "").isdigit()


def _is_description_of_other(
    words: Sequence[str], start: int, end: int, prior: Prior | None, names: Mapping[str, str]
) -> bool:
    """Return whether words that name an object describe the look or taste of a preceding one: glass of 'a bottle, green glass'.

    This holds for a material after a comma or 'that is', a colour after these or the name ('a mug orange'), and food before a
    colour ('a mug, lemon yellow') or after a comma.
    """
    phrase, behind, before = " ".join(words[start:end]), words[end] if end < len(words) else "", words[:start]
    is_look = end - start == 1 and material_of(phrase) is not None
    food = prior is not None and prior.domain == "food" and prior.category in names
    colored = color_of(phrase) is not None or (food and color_of(behind) is not None)
    if not (is_look or colored or (food and "," in before)):
        return False
    ends = [at for at, word in enumerate(before) if word in _DESCRIPTION_STARTERS - _CONTENT_PREPOSITIONS - PURPOSE]
    if colored:
        telling = [at for at, word in enumerate(before) if word not in FILLER_WORDS and not is_descriptive(word)]
        ends += [at + 1 for at in telling[-1:]]
    return any(" ".join(before[first:last]) in names for last in ends for first in range(last))


def _is_separator(words: Sequence[str], at: int) -> bool:
    """Return whether a word separates an object from its contents or surroundings: 'full' in 'a cup full of tea'."""
    return words[at] in _CONTENT_PREPOSITIONS or is_other_object_start(words, at)


def _remove_counter(before: list[str]) -> list[str]:
    """Return the words before a name without its counter: red, of 'a pair of red pliers'."""
    at = next(
        (at for at, (word, of) in enumerate(pairwise(before)) if of == "of" and word in _GROUPS | _CLASSIFIER_NOUNS),
        None,
    )
    return before if at is None else before[:at] + before[at + 2 :]


def _require_single_object(text: str, before: list[str], name: list[str], prior: Prior, names: set[str]) -> None:
    """Raise UsageError if a text asks for several objects: a pair of pliers is one object, two forks are not."""
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


def _is_substitute(meant: Prior, category: str) -> bool:
    """Return whether objects of a category look like the meant ones and may be equally large."""
    prior = load_priors()[category]
    same = (
        meant.category not in KIN_OF_ANOTHER_SHAPE
        and meant.shape == prior.shape
        and [p.label for p in meant.functional] == [p.label for p in prior.functional]
    )
    return same and prior.longest_axis_m.low <= meant.longest_axis_m.typical <= prior.longest_axis_m.high


def _own_words(called: list[str], template: Template, prior: Prior) -> list[str]:
    """Return the words of a name that state a material of the template's first slot, or an unusual one.

    For food also the colour: a green apple is green, but a red wine glass is not red.
    """
    if is_food(prior) and (colors := [word for word in called[:-1] if color_of(word) is not None]):
        return colors
    known = {look_of(choice).material for choice in next(iter(template.slots.values())) if choice}
    own = [word for word in called[:-1] if (look := material_of(word)) is not None and look.material in known]
    return own or material_words_in_name(called, prior)


def _unknown_object_message(text: str, words: list[str], templates: Mapping[str, Template]) -> str:
    """Return the error message for an unknown object, with templates of equal shape or similarly spelt names."""
    meant = find_prior(" ".join(words))
    alike = [] if meant is None else [name for name in templates if _has_similar_function(load_priors()[name], meant)]
    if alike:
        hint = f"; of its shape there are: {', '.join(alike[:4])}."
    else:
        names = sorted({name for template in templates.values() for name in (template.category, *template.names)})
        said = words if meant is None else meant.category.split()
        # Start with the last word, the noun.
        spelt = dict.fromkeys(
            name for word in reversed(said) for name in get_close_matches(word, names, n=2, cutoff=0.6)
        )
        # "block" may mean a building block.
        kinds = [name for name in names if said and name.endswith(f" {said[-1]}")]
        near = [*kinds, *(name for name in spelt if name not in kinds)]
        hint = f"; did you mean {', '.join(near[:4])}?" if near else "."
    return f"no template makes {text!r}{hint} There are {len(templates)} (docs/templates.md)"


def _has_similar_function(one: Prior, other: Prior) -> bool:
    """Return whether two categories have one shape and nearly the same functional features."""
    ours, theirs = ({part.feature for part in prior.functional} for prior in (one, other))
    return one.shape == other.shape and len(ours & theirs) >= LEAST_SHARED_FEATURES * len(ours | theirs)
