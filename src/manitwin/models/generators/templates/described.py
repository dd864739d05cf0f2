"""What the words around a thing's name say of it: colours, materials, relative size; 'small', 'dark blue', 'stainless steel'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from manitwin.errors import UsageError
from manitwin.models.annotators.priors import Prior, load_materials
from manitwin.models.generators.templates.looks import (
    BASIC_COLORS,
    CLEAR,
    MATERIALS,
    METAL_COLORS,
    SAME_COLOR,
    SHADES,
    Look,
    color_of,
    material_of,
    shaded,
    usual_looks,
)

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
ARTICLES = frozenset(
    {
        "a",
        "an",
        "the",
        "one",
        "some",
        "its",
        "very",
        "and",
        "of",
        "colored",
        "coloured",
        "made",
        "with",
        "color",
        "colour",
    }
    | {"that", "which", "is", "it", "out", "entirely", "all", "solid", "finish", "painted", "in", "for", "from", ","}
)
"""Words that say nothing themselves."""
_COLORED = frozenset({"colored", "coloured", "color", "colour", "painted"})
_NO_MATTER_BEFORE = frozenset({"coated", "plated", "lined", "covered", "look", "effect", "style", "like", "free"})
"""Behind the name of a material: the thing is not of it."""
_PLAIN = frozenset(
    {"ceramic", "plastic", "wood", "steel", "stainless steel", "rubber", "glass", "paper", "stone", "fabric"}
)
"""Materials that another word makes more exact: a wooden oak spoon is of oak."""
_NEVER_BEFORE_A_NAME = frozenset({"soap", "wax", "bristle", "electronics"})
_WORKED_ON = {
    "tools": frozenset(
        {"wood", "paper", "glass", "leather", "fabric", "cloth", "stone", "metal", "foam", "cork", "tin"}
    ),
    "office": frozenset({"paper"}),
}
"""Nouns before the name of a tool that say what it is for, by the priors' domain: a wood saw and a paper punch."""
_SOFT = frozenset({"textile", "foam", "wax"})


@dataclass(frozen=True)
class Wish:
    """A colour or a material, or both, that a text names; ``kind`` is the colour's word where it speaks of the matter too."""

    rgb: tuple[float, float, float] | None = None
    material: Look | None = None
    kind: str = ""

    def of(self, look: Look) -> Look:
        """Return a look with what is wished for, the rest as it is."""
        matter = look if self.material is None or self.material.material == look.material else self.material
        return matter if self.rgb is None else matter.colored(self.rgb)

    def over(self, other: Wish) -> Wish:
        """Return this with what another one wishes besides."""
        return Wish(
            other.rgb if self.rgb is None else self.rgb,
            other.material if self.material is None else self.material,
            other.kind if self.rgb is None else self.kind,
        )

    def choices(self, usual: Sequence[Look]) -> list[Look]:
        """Return the looks to draw from, of the ``usual`` ones of a part: what is not wished for is drawn."""
        if self.material is not None:
            return [self.material] if self.rgb is not None else usual_looks(self.material, usual)
        if self.kind in METAL_COLORS:
            return [look for look in usual if look.metallic > 0] or list(usual)
        if self.kind == CLEAR:
            return [look for look in usual if look.surface in ("glass", "plastic")] or [MATERIALS["glass"]]
        return list(usual)


@dataclass(frozen=True)
class Described:
    """What words say: a colour and a material, the relative size (None: not said), and the words that say nothing."""

    wish: Wish = Wish()
    relative: float | None = None
    unused: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Said:
    """A colour or a material of a phrase of words ``start`` to ``end``."""

    start: int
    end: int
    rgb: tuple[float, float, float] | None = None
    material: Look | None = None
    basic: bool = False
    kind: str = ""


def described(words: Sequence[str], of: Prior | None = None) -> Described:
    """Return what words say; those before the name of a thing ``of`` a prior may say what it is for instead.

    A word that is both a colour and a material (copper) is the latter where no other is said. Raises UsageError for two colours
    or two materials of one thing.
    """
    said, unused, relative = list[_Said](), list[str](), None
    at = 0
    while at < len(words):
        found = _found(words, at, of)
        word = words[at]
        if found is not None:
            said.append(found)
            at = found.end
            continue
        if word in RELATIVE:
            relative = RELATIVE[word]
        elif word not in ARTICLES and word not in SHADES:
            unused.append(word)
        at += 1
    color = _color(said, words)
    return Described(
        Wish(None if color is None else color.rgb, _material(said), "" if color is None else color.kind),
        relative,
        tuple(unused),
    )


def is_described(word: str) -> bool:
    """Tell whether a word says a colour, a material, or a relative size."""
    return color_of(word) is not None or material_of(word) is not None or word in RELATIVE or word in SHADES


def _found(words: Sequence[str], at: int, of: Prior | None) -> _Said | None:
    """Return the colour or material that begins at a word, the longest phrase first."""
    for length in (3, 2, 1):
        end = at + length
        phrase = " ".join(words[at:end])
        if end > len(words):
            continue
        look, rgb = material_of(phrase), color_of(phrase)
        behind = words[end] if end < len(words) else ""
        if behind in _COLORED and (rgb is not None or look is not None):
            return _Said(at, end + 1, rgb or (look.rgb if look is not None else None))
        if look is not None and behind not in _NO_MATTER_BEFORE and (of is None or is_matter(phrase, look, of)):
            return _Said(at, end, rgb, look)
        if rgb is not None:
            shade = words[at - 1] if at and words[at - 1] in SHADES else None
            kind = SAME_COLOR.get(phrase, phrase)
            rgb = rgb if shade is None else shaded(rgb, shade)
            return _Said(at, end, rgb, None, kind in BASIC_COLORS, kind if kind in (CLEAR, *METAL_COLORS) else "")
    return None


def is_matter(word: str, look: Look, of: Prior) -> bool:
    """Tell whether a word before a thing's name says what it is of: the steel of a steel mug, not the wood of a wood saw.

    What such things are of anyway it always says; soap, wax and soft matter never of others, nor what a tool works on.
    """
    usual = surfaces_of(of)
    if look.surface in usual:
        return True
    if word in _NEVER_BEFORE_A_NAME or word in _WORKED_ON.get(of.domain, ()):
        return False
    return look.surface not in _SOFT or bool(usual & {"textile", "leather"})


def surfaces_of(prior: Prior) -> frozenset[str]:
    """Return the materials of the priors that the words of a prior's material name, metal as each of its kinds."""
    words = prior.material.replace(",", " ").replace("-", " ").split()
    phrases = [*words, *(" ".join(pair) for pair in pairwise(words))]
    looks = [look for phrase in phrases if (look := material_of(phrase)) is not None]
    metals = {"steel", "aluminium"} if "metal" in words else set()
    return frozenset({look.surface for look in looks} | {word for word in words if word in load_materials()} | metals)


def _color(said: Sequence[_Said], words: Sequence[str]) -> _Said | None:
    """Return the colour of phrases: of neighbours the more exact one, or their mean."""
    pure = [each for each in said if each.rgb is not None and each.material is None]
    if not pure and sum(each.material is not None for each in said) > 1:
        pure = [each for each in said if each.rgb is not None]  # copper ceramic: the colour of copper
    if not pure:
        return None
    color, end = pure[0], pure[0].end
    for each in pure[1:]:
        if each.rgb == color.rgb:
            continue
        if each.start != end:
            first, second = " ".join(words[color.start : end]), " ".join(words[each.start : each.end])
            raise UsageError(
                f"two colours of one thing, {first} and {second}: say which part has which, such as"
                f" 'a {first} mug with a {second} handle'"
            )
        if each.basic and color.basic:
            mixed = np.mean([rgb for rgb in (color.rgb, each.rgb) if rgb is not None], axis=0)
            color = _Said(color.start, each.end, (float(mixed[0]), float(mixed[1]), float(mixed[2])), None, True)
        elif color.basic:
            color = _Said(color.start, each.end, each.rgb)
        end = each.end
    return color


def _material(said: Sequence[_Said]) -> Look | None:
    """Return the material of phrases, the more exact one of two names of the same."""
    named = [each for each in said if each.material is not None]
    sure = [each for each in named if each.rgb is None] or named
    looks = list(dict.fromkeys(each.material for each in sure if each.material is not None))
    if len(looks) > 1 and len({look.surface for look in looks}) > 1:
        first, second = looks[0].material, looks[1].material
        raise UsageError(
            f"two materials of one thing, {first} and {second}: say which part has which, such as"
            f" 'a {first} knife with a {second} handle'"
        )
    exact = [look for look in looks if look.material not in _PLAIN] or looks
    return exact[-1] if exact else None
