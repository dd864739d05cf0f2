"""Names of objects in instructions: "mug", "red mug", "mug for holding hot drinks"."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from manitwin.models.annotators.descriptions import joined
from manitwin.models.annotators.prior_names import counter_phrase, find_prior, normalise_name
from manitwin.scenes.vqa.nouns import with_shortened_names
from manitwin.twin.record import Language

NAMELESS = "object"
"""Name of an object without a known category."""

_UNSAID = re.compile(r"\b(?:unknown|unclear|unspecified|unidentified|various|none|not|n/?a)\b", re.IGNORECASE)
_MOST_LETTERS = 1000  # of a description: regular expressions for brackets and spaces take quadratic time
_PLAIN = re.compile(r"[a-z]+(?:[ -][a-z]+)*")
_SIZES = frozenset(
    ("tiny", "small", "little", "large", "big", "long", "short", "medium-sized", "palm-sized", "hand-sized")
)
_ADJECTIVES = {"wood": "wooden", "wool": "woollen"}
_OF_ONE_MATERIAL = frozenset(
    (
        *("aluminium", "aluminum", "bamboo", "brass", "canvas", "cardboard", "ceramic", "copper"),
        *("cork", "cotton", "fabric", "foam", "glass", "iron", "leather", "metal"),
        *("nylon", "paper", "plastic", "porcelain", "rubber", "silicone", "silver", "steel"),
        *("stone", "textile", "titanium", "wax", "wicker", "wood", "wool"),
    )
)
_SINGULAR_IN_S = frozenset(("lens", "thermos", "gas", "canvas", "atlas"))
_FINITE_VERB = re.compile(r"\b(?:is|are|was|has|have|sits|stands|lies|can|features|shows|appears|looks)\b")
_CAPTION_WORDS = 8
_SEEN = frozenset(("color", "material", "size"))
_COLORS = 2


@dataclass(frozen=True)
class Name:
    """A noun phrase after "the"; ``in_pairs``: a single item is a pair. ``uses`` are the attributes that it mentions."""

    words: str
    plural: bool
    in_pairs: bool
    uses: frozenset[str]


@dataclass(frozen=True)
class _NameParts:
    """Usable parts of a twin's language record; None if a part is not usable. ``nouns``: further nouns that may denote it."""

    noun: str
    nouns: frozenset[str]
    plural: bool
    in_pairs: bool
    color: str | None
    material: str | None
    size: str | None
    use: str | None
    part: str | None
    caption: str | None


def names_of(language: Language, others: Sequence[Language] = ()) -> list[Name]:
    """Return the names of an object, simplest first; names that also fit one of the others only if all do."""
    told = _name_parts(language)
    names = _names(told)
    beside = [_name_parts(other) for other in others]
    own = [name for name in names if not any(_could_refer_to(name, told, other) for other in beside)]
    if own:
        return own
    most = max(len(name.uses) for name in names)
    return [name for name in names if len(name.uses) == most]


def is_distinguishable(language: Language, others: Sequence[Language]) -> bool:
    """Tell whether an object has a name that fits none of the others."""
    told, beside = _name_parts(language), [_name_parts(other) for other in others]
    return any(not any(_could_refer_to(name, told, other) for other in beside) for name in _names(told))


def category_names(category: str) -> frozenset[str]:
    """Return what people may call a thing of a category: its name, those that the priors know for it, and what these end with."""
    prior = find_prior(category)
    return with_shortened_names((category, *(prior.aliases if prior is not None else ())))


def _names(told: _NameParts) -> list[Name]:
    ways: list[tuple[str | None, tuple[str, ...]]] = [
        (told.noun, ()),
        (_with_adjectives(told, "color"), ("color",)),
        (_with_adjectives(told, "material"), ("material",)),
        (_with_adjectives(told, "color", "material"), ("color", "material")),
        (_with_adjectives(told, "size"), ("size",)),
        (_with_adjectives(told, "size", "color"), ("size", "color")),
        (told.use and f"{told.noun} for {told.use}", ("use",)),
        (told.part and f"{told.noun} with {told.part}", ("part",)),
        (told.caption, ("caption",)),
    ]
    named: dict[str, Name] = {}
    for words, uses in ways:
        if words:
            named.setdefault(words, Name(words, told.plural, told.in_pairs, frozenset(uses)))
    return list(named.values())


def _with_adjectives(told: _NameParts, *attributes: str) -> str | None:
    """Return the noun preceded by attributes; None if an attribute is not usable."""
    said = [getattr(told, attribute) for attribute in attributes]
    return None if None in said else " ".join([*said, told.noun])


def _could_refer_to(name: Name, told: _NameParts, other: _NameParts) -> bool:
    """Tell whether a name could also refer to another object: "the cup" to a measuring cup or a mug.

    Objects with different nouns are distinguished by visible attributes only, because their records may omit uses and parts.
    """
    if other.noun == told.noun or told.noun == NAMELESS:
        return all(getattr(other, attribute) == getattr(told, attribute) for attribute in name.uses)
    seen = ({"color"} if "caption" in name.uses else set()) | (name.uses & _SEEN)
    return told.noun in other.nouns and all(getattr(other, each) == getattr(told, each) for each in seen)


def _name_parts(language: Language) -> _NameParts:
    category = normalise_name(language.category).removeprefix("pair of ")
    prior = find_prior(category)
    if not _PLAIN.fullmatch(category) or _UNSAID.search(category):
        category, prior = NAMELESS, None
    counter = prior.counter if prior is not None else None
    in_pairs = counter == "pair of"
    plural = in_pairs or (counter is None and _is_plural(category))
    said = None if prior is None or in_pairs else counter_phrase(prior, category)
    noun = category if said is None else f"{said} {category}"
    edible = prior is not None and prior.surface == "food skin"
    return _NameParts(
        noun=noun,
        nouns=category_names(category),
        plural=plural,
        in_pairs=in_pairs,
        color=_color(language.color),
        material=None if edible else _material(language.material, noun),
        size=next((word for word in re.split(r"[,;] *| +", language.size.lower()) if word in _SIZES), None),
        use=None if edible else _use(language.function),
        part=_part(language.shape),
        caption=_caption((language.caption, *language.captions), noun),
    )


def _is_plural(noun: str) -> bool:
    head = re.split(r" (?:of|with|for|in) ", noun, maxsplit=1)[0].split()[-1]
    return head.endswith("s") and not head.endswith(("ss", "us", "is")) and head not in _SINGULAR_IN_S


def _color(text: str) -> str | None:
    """Return "dark grey and gold" for "dark grey (69 %), gold (25 %)"."""
    pieces = [piece.strip() for piece in re.sub(r"\([^)]*\)", "", text[:_MOST_LETTERS].lower()).split(",")]
    plain = [p for p in pieces if _PLAIN.fullmatch(p) and not _UNSAID.search(p) and len(p.split()) <= 3]
    return joined(plain[:_COLORS]) if plain and not _UNSAID.search(text) else None


def _material(text: str, noun: str) -> str | None:
    """Return the adjective of a single material; None for a mixture, an uncertain one, or one that the noun already states."""
    words = text.lower().split()
    if not words or len(words) > 2 or words[-1] not in _OF_ONE_MATERIAL or not _PLAIN.fullmatch(" ".join(words)):
        return None
    adjective = _ADJECTIVES.get(words[-1], words[-1])
    if _UNSAID.search(text) or {*words, adjective} & set(noun.split()):
        return None
    return " ".join([*words[:-1], adjective])


def _use(text: str) -> str | None:
    line = re.sub(r"^(?:used )?for ", "", text.lower().strip().rstrip("."))
    if (
        _UNSAID.search(line)
        or not re.match(r"[a-z-]+ing\b", line)
        or line.startswith("being ")
        or len(line.split()) > 8
    ):
        return None
    return line if re.fullmatch(r"[a-z]+(?:,? [a-z]+|-[a-z]+)*", line) else None


def _part(text: str) -> str | None:
    """Return "a side handle" for "cylindrical with a side handle, flat"."""
    found = re.search(
        r"\bwith ((?:an?|one|two|three|four|[a-z]+) [a-z ]+?)\s*(?:,|;|\.|$)", text[:_MOST_LETTERS].lower()
    )
    if found is None or _UNSAID.search(text) or len(found[1].split()) > 5:
        return None
    return found[1]


def _caption(captions: Sequence[str], noun: str) -> str | None:
    """Return the first caption that is a short noun phrase ending with the noun."""
    for text in captions:
        line = re.sub(r"^(?:an?|the)\s+", "", text.strip().rstrip(".").lower())
        plain = re.fullmatch(r"[a-z]+(?:,? [a-z]+|-[a-z]+)*", line) and len(line.split()) <= _CAPTION_WORDS
        starts = re.match(r"(?:an?|the)\s", text.strip(), re.IGNORECASE)
        if plain and starts and line.endswith(noun) and not _FINITE_VERB.search(line) and not _UNSAID.search(line):
            return None if " pair of " in f" {line} " else line
    return None
