"""Read what a sentence asks for: category, colours, materials, sizes; 'a red ceramic mug with a wooden handle, 9 cm tall'."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from difflib import get_close_matches
from itertools import pairwise

from manitwin.errors import UsageError
from manitwin.models.annotators.priors import Prior, load_priors, named
from manitwin.models.generators.templates.looks import SHADES, Look, color_of, look_of, material_of, shaded
from manitwin.models.generators.templates.template import Template

MAX_CHARACTERS = 400
_UNITS_M = {
    r"millimet(?:re|er)s?": 1e-3, "mm": 1e-3, r"centimet(?:re|er)s?": 1e-2, "cm": 1e-2, r"met(?:re|er)s?": 1.0, "m": 1.0,
    "inch(?:es)?": 0.0254, "in": 0.0254, "foot|feet|ft": 0.3048,
}  # fmt: skip
_AMOUNT = rf"(\d{{1,4}}(?:\.\d{{1,3}})?) ?({'|'.join(_UNITS_M)})\b\.?"
_MEASURES = "height|width|length|diameter|depth"
_LENGTH = re.compile(rf"{_AMOUNT} ?(?:in (?={_MEASURES}))?(\w{{0,12}})")
_NAMED_LENGTH = re.compile(rf"\b({_MEASURES})(?: of)? ({_AMOUNT})")
_OF_A_PART = re.compile(rf" (?:with|having|and) an? {_LENGTH.pattern}")
_SEVERAL = re.compile(rf"\d ?(?:x|by|×) ?{_LENGTH.pattern}")
_NOT_TAKEN = (
    (re.compile(r"\b(?:no(?!\.? ?\d)|not|without)\b"), "what a thing is not"),
    (
        re.compile(r"\b(?:\d[\d.]*|one|two|three|half) ?(?:ml|cl|dl|l|lit(?:re|er)s?|ounces?|oz|pints?|gallons?)\b"),
        "a volume",
    ),
    (re.compile(r"\b\d[\d.]* ?(?:kg|kilograms?|kilos?|g|grams?|lbs?|pounds?)\b"), "a mass"),
)
"""What no template can be told, by what it is called: left out in silence, the thing would be another one."""
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
    _check_taken(text, plain, lengths)
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
        part = words[-1] if words[-1] in templates[category].slots else words[-1].removesuffix("s")
        wishes[part] = wish
        unused += left
    return Wanted(category, wishes, lengths, relative, tuple(unused))


def lengths_in(text: str) -> dict[str, float]:
    """Return the lengths (m) that a text states by their direction, '' for the longest."""
    found = _LENGTH.findall(_plain(text))
    return {DIRECTIONS.get(direction, ""): float(number) * _metres(unit) for number, unit, direction in found}


def _metres(unit: str) -> float:
    return next(metres for spelt, metres in _UNITS_M.items() if re.fullmatch(spelt, unit))


def _plain(text: str) -> str:
    """Return the words in lower case: a decimal comma as a point, marks of inches and feet as words, a length before its name."""
    plain = re.sub(r"(?<=\d),(?=\d{3}\b)", "", text.lower())
    plain = re.sub(r"(?<=\d),(?=\d)", ".", plain)
    plain = re.sub(r"(?<=\d) ?(?:\"|″|'')", " inches ", plain)
    plain = re.sub(r"(?<=\d) ?(?:'|′)(?!\w)", " ft ", plain)  # the 70's are no feet
    plain = re.sub(r"(\d+) (\d)/(\d)\b", lambda m: f"{int(m[1]) + int(m[2]) / max(int(m[3]), 1):g}", plain)
    plain = " ".join(plain.replace(",", " , ").replace("-", " ").split())
    return _NAMED_LENGTH.sub(lambda m: f"{m[2]} {m[1]}", plain)


def _check_taken(text: str, plain: str, lengths: Mapping[str, float]) -> None:
    """Raise UsageError for what a template cannot be told."""
    for pattern, what in _NOT_TAKEN:
        if (said := pattern.search(plain)) is not None:
            raise UsageError(f"{text!r}: a template cannot be told {what} ({said[0]!r}); leave it out, or say a length")
    if len(_LENGTH.findall(plain)) > 1 or len(lengths) > 1 or _SEVERAL.search(plain):
        raise UsageError(
            f"{text!r} states several lengths: a template is scaled as a whole; say one, such as '9 cm tall'"
        )
    part = _OF_A_PART.search(plain)
    if part is not None and part[3] not in ("", *(d for d in DIRECTIONS if plain.endswith(d))):
        raise UsageError(
            f"{text!r} states the length of a part: a template is scaled as a whole; say that of the whole"
        )


def _category(words: list[str], text: str, templates: Mapping[str, Template]) -> tuple[str, list[str]]:
    """Return the category and the words around its name, which is the last and then the longest phrase that names one.

    What a thing is, its last noun says: a phrase is no name where words follow that describe nothing (a mug rack is no mug),
    but for those behind a preposition (a cup of tea is a cup). A material that the name says, of those that such a thing is of,
    is one of the words around it: a wooden spoon is of wood, but a wood chisel is not. Where the longer phrase is another thing
    that the priors know, a shorter one is that only where both have one form and the size fits: a jam jar is a jar, and a garlic
    bulb no light bulb.
    """
    words = [word for word in (word.strip('.!?;:"') for word in words) if word]
    names = {
        name: template.category for template in templates.values() for name in (template.category, *template.names)
    }
    other: Prior | None = None
    for end in range(len(words), 0, -1):
        tail = words[end:]
        if tail and tail[0] not in _PREPOSITIONS and _wish(tail)[2]:
            continue
        for start in range(end):
            phrase = " ".join(words[start:end])
            prior = named(phrase) or named(phrase.replace(" ", ""))
            meant = [names.get(phrase), *([] if prior is None else [prior.category, prior.kin_of])]
            category = next((name for name in meant if name in templates), None)
            if category is None and words[start] not in _ARTICLES:
                other = other or prior
            elif category is not None and words[start] not in _ARTICLES:
                if other is not None and not _stands_for(other, category):
                    raise UsageError(_no_category(text, other.category.split(), sorted(names), len(templates)))
                return category, [*_own_materials(words[start : end - 1], templates[category]), *words[:start], *tail]
    raise UsageError(_no_category(text, words, sorted(names), len(templates)))


def _stands_for(meant: Prior, category: str) -> bool:
    """Tell whether things of a category look like those that are meant, and may be as large."""
    prior = load_priors()[category]
    same = meant.shape == prior.shape and [p.label for p in meant.functional] == [p.label for p in prior.functional]
    return same and prior.longest_axis_m.low <= meant.longest_axis_m.typical <= prior.longest_axis_m.high


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
