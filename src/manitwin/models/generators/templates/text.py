"""Read what a sentence asks for: category, colours, materials, sizes; 'a red ceramic mug with a wooden handle, 9 cm tall'."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from itertools import pairwise

from manitwin.errors import UsageError
from manitwin.models.annotators.priors import named
from manitwin.models.generators.templates.looks import SHADES, Look, color_of, look_of, material_of, shaded
from manitwin.models.generators.templates.template import Template

MAX_CHARACTERS = 400
_LENGTH = re.compile(r"(\d{1,4}(?:\.\d{1,3})?) ?(mm|cm|m|inches|inch|in|ft)\b ?(\w{0,12})")
_METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0, "inch": 0.0254, "inches": 0.0254, "in": 0.0254, "ft": 0.3048}
DIRECTIONS = {
    "tall": "height", "high": "height", "height": "height", "wide": "width", "width": "width", "broad": "width",
    "diameter": "width", "across": "width", "long": "length", "length": "length", "deep": "depth", "thick": "height",
}  # fmt: skip
RELATIVE = {
    "tiny": 0.0,
    "small": 0.12,
    "little": 0.12,
    "mini": 0.0,
    "large": 0.88,
    "big": 0.88,
    "huge": 1.0,
    "giant": 1.0,
}
"""Where in the interval of a category's sizes a word puts a thing: 0 the least, 1 the largest."""
_ARTICLES = frozenset(
    {"a", "an", "the", "one", "some", "its", "very", "and", "of", "colored", "coloured", "made", "with"}
)
_PREPOSITIONS = frozenset({"of", "in", "for", "from", "made"})


@dataclass(frozen=True)
class Wish:
    """A colour or a material, or both, that a text names."""

    rgb: tuple[float, float, float] | None = None
    material: Look | None = None

    def of(self, look: Look) -> Look:
        """Return a look with what is wished for, the rest as it is."""
        matter = look if self.material is None else self.material
        if self.rgb is not None:
            return matter.colored(self.rgb)
        return matter if self.material is not None else look


@dataclass(frozen=True)
class Wanted:
    """What a text asks for: ``wishes`` by the name of a part, '' for the whole; ``lengths_m`` by direction, '' for the longest.

    ``relative`` is where in the category's interval of sizes it is, None where the text does not say; ``unused`` are the words
    that say nothing to a template.
    """

    category: str
    wishes: Mapping[str, Wish] = field(default_factory=dict)
    lengths_m: Mapping[str, float] = field(default_factory=dict)
    relative: float | None = None
    unused: tuple[str, ...] = ()


def read_text(text: str, templates: Mapping[str, Template]) -> Wanted:
    """Return what a text asks for; raises UsageError where it names no category that there is a template of, or several."""
    if len(text) > MAX_CHARACTERS:
        raise UsageError(f"a text of {len(text)} characters; at most {MAX_CHARACTERS} describe an object")
    plain, lengths = _plain(text), lengths_in(text)
    rest = _LENGTH.sub(lambda m: "" if m[3] in DIRECTIONS else m[3], plain)
    main, *features = re.split(r" with | having | and a | and an ", rest.replace(" ,", " "))
    category, around = _category(main.split(), text, templates)
    wish, relative, unused = _wish(around)
    wishes = {"": wish} if wish != Wish() else {}
    for phrase in features:
        words = [word for word in phrase.split() if word not in _ARTICLES]
        if not words:
            continue
        wish, _, left = _wish(words[:-1])
        wishes[words[-1].removesuffix("s")] = wish
        unused += left
    return Wanted(category, wishes, lengths, relative, tuple(unused))


def lengths_in(text: str) -> dict[str, float]:
    """Return the lengths (m) that a text states by their direction, '' for the longest."""
    found = _LENGTH.findall(_plain(text))
    return {DIRECTIONS.get(direction, ""): float(number) * _METRES[unit] for number, unit, direction in found}


def _plain(text: str) -> str:
    return " ".join(text.lower().replace(",", " , ").replace("-", " ").split())


def _category(words: list[str], text: str, templates: Mapping[str, Template]) -> tuple[str, list[str]]:
    """Return the category and the words around its name, which is the last and then the longest phrase that names one.

    What a thing is, its last noun says: a phrase is no name where words follow that describe nothing (a mug rack is no mug),
    but for those behind a preposition (a cup of tea is a cup). A material that the name says, of those that such a thing is of,
    is one of the words around it: a wooden spoon is of wood, but a wood chisel is not.
    """
    words = [word for word in (word.strip('.!?;:"') for word in words) if word]
    names = {
        name: template.category for template in templates.values() for name in (template.category, *template.names)
    }
    for end in range(len(words), 0, -1):
        tail = words[end:]
        if tail and tail[0] not in _PREPOSITIONS and _wish(tail)[2]:
            continue
        for start in range(end):
            phrase = " ".join(words[start:end])
            prior = named(phrase)
            category = names.get(phrase) or (prior.category if prior is not None else "")
            if category in templates and words[start] not in _ARTICLES:
                return category, [*_own_materials(words[start : end - 1], templates[category]), *words[:start], *tail]
    raise UsageError(_no_category(text, words, sorted(names), len(templates)))


def _own_materials(words: list[str], template: Template) -> list[str]:
    """Return the words of a name that say a material which the first slot of a template has."""
    known = {look_of(choice).material for choice in next(iter(template.slots.values())) if choice}
    return [word for word in words if (look := material_of(word)) is not None and look.material in known]


def _wish(words: list[str]) -> tuple[Wish, float | None, list[str]]:
    """Return the colour and material that words name, the relative size, and the words left."""
    rgb, material, relative, unused = None, None, None, []
    shade: str | None = None
    pairs = [" ".join(pair) for pair in pairwise(words)] + [""]
    skip = False
    for word, pair in zip(words, pairs, strict=False):
        if skip:
            skip = False
        elif material_of(pair) is not None:
            material, skip = material_of(pair), True
        elif (color := color_of(word)) is not None:
            rgb = color if shade is None else shaded(color, shade)
        elif material_of(word) is not None:
            material = material_of(word)
        elif word in RELATIVE:
            relative = RELATIVE[word]
        elif word not in _ARTICLES and word not in SHADES and word not in _PREPOSITIONS:
            unused.append(word)
        shade = word if word in SHADES else None
    return Wish(rgb, material), relative, unused


def _no_category(text: str, words: list[str], names: list[str], count: int) -> str:
    near = dict.fromkeys(match for word in words for match in get_close_matches(word, names, n=2, cutoff=0.6))
    hint = f"; did you mean {', '.join(list(near)[:4])}?" if near else "."
    return f"no template makes {text!r}{hint} There are {count} (docs/templates.md)"
