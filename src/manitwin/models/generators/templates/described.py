"""What the words around a thing's name say of it: colours, materials, relative size; 'small', 'dark blue', 'stainless steel'."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.generators.templates.looks import (
    BARE_METALS,
    BASIC_COLORS,
    CLEAR,
    MATERIALS,
    METAL_COLORS,
    OF_PRECIOUS_METAL,
    SAME_COLOR,
    SHADES,
    Look,
    color_of,
    material_of,
    shaded,
    usual_looks,
)
from manitwin.models.generators.templates.matter import NO_MATTER_BEFORE, is_composite, is_matter, surfaces_of
from manitwin.models.generators.templates.vocabulary import (
    CONTENTS,
    FILLER_WORDS,
    PLACES,
    PURPOSE,
    RELATIVE,
    speaks_of_others,
)

_GOLDEN = frozenset({"brass", "bronze", "copper"})
_NO_COLOR_BEFORE = frozenset({"resistant", "proof", "free", "remover", "removal"})
"""Behind a colour's word, which then is none: rust resistant."""
_COLORED = frozenset({"colored", "coloured", "color", "colour", "painted"})
_PLAIN = frozenset(
    {"ceramic", "plastic", "wood", "steel", "stainless steel", "rubber", "glass", "paper", "stone", "fabric"}
)
"""Materials that another word makes more exact: a wooden oak spoon is of oak."""


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
            golden = self.kind != "silver"
            metals = [look for look in usual if look.metallic > 0]
            alike = [look for look in metals if (look.material in _GOLDEN) == golden]
            yellow = [look for look in alike if look.material == "brass" and self.kind == "gold"]
            return yellow or alike or metals or list(usual)
        if self.kind == CLEAR:
            return [look for look in usual if look.surface in ("glass", "plastic")] or [MATERIALS["glass"]]
        painted = [look for look in usual if look.material not in BARE_METALS] if self.rgb is not None else []
        return painted or list(usual)


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

    A word that is both a colour and a material (copper) is the latter where no other is said. Raises UsageError for two colours,
    two materials or two sizes of one thing.
    """
    said, unused = _read(words, of)
    sizes = [word for word in unused if word in RELATIVE]
    relative = [RELATIVE[word] for word in sizes]
    if relative and min(relative) < 0.5 < max(relative):
        raise UsageError(f"two sizes for one object, {' and '.join(sizes)}: say one")
    left = tuple(word for word in unused if word not in RELATIVE)
    color = _color(said, words)
    look = _material(said)
    rgb = _shade_of(said, look, words) if color is None else color.rgb
    return Described(Wish(rgb, look, "" if color is None else color.kind), relative[-1] if relative else None, left)


def _shade_of(said: Sequence[_Said], look: Look | None, words: Sequence[str]) -> tuple[float, float, float] | None:
    """Return the colour of a material that a shade is said of ('dark wood'), None where none is."""
    shades = [words[each.start - 1] for each in said if each.start and each.material is not None]
    shade = next((word for word in shades if SHADES.get(word)), None)
    return None if look is None or shade is None else shaded(look.rgb, shade)


def materials_said(before: Sequence[str], called: Sequence[str], tail: Sequence[str], of: Prior) -> list[Look]:
    """Return the materials that the words around and in what a thing is called say, whatever colours they say.

    What it is called says one of several that such things are of (a paper cup, but no paper towel), or another one where it is
    no plain name (a plastic jar). Raises UsageError for two of one kind of words.
    """
    named = [
        each
        for each in _read([*before, *called], of)[0]
        if each.end <= len(before) or _is_said(each.material, each.end - len(before), called, of)
    ]
    said = [_material(named), _material(_read(_about(tail)[0], None)[0])]
    return [look for look in said if look is not None]


def own_materials(called: Sequence[str], of: Prior) -> list[str]:
    """Return the words of what a thing is called that say what it is of."""
    found = [each for each in _read(called, of)[0] if _is_said(each.material, each.end, called, of)]
    return [word for each in found for word in called[each.start : each.end]]


def _is_said(look: Look | None, end: int, called: Sequence[str], of: Prior) -> bool:
    """Tell whether a material in what a thing is called, before word ``end``, says what this one is of."""
    if look is None or end == len(called) or is_composite(of):
        return False
    usual = surfaces_of(of)
    if look.surface in usual:
        return len(usual) > 1
    return " ".join(called) != of.category.lower()


def _read(words: Sequence[str], of: Prior | None) -> tuple[list[_Said], list[str]]:
    """Return the colours and materials that words say, and the words that say neither."""
    said, left = list[_Said](), list[str]()
    at = 0
    while at < len(words):
        found = _found(words, at, of)
        if found is not None:
            said.append(found)
            at = found.end
            continue
        if words[at] not in FILLER_WORDS and words[at] not in SHADES:
            left.append(words[at])
        at += 1
    return said, left


def described_behind(words: Sequence[str]) -> Described:
    """Return what the words behind a name say of it: the red of 'a mug in red', nothing of 'a glass of red wine'.

    Raises UsageError as ``described`` does.
    """
    about, beside = _about(words)
    said = described(about)
    return Described(said.wish, said.relative, (*said.unused, *beside))


def _about(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the words behind a name that speak of it, and those that speak of what is in it, or what it is for."""
    cut = next((at for at, word in enumerate(words) if speaks_of_others(words, at)), len(words))
    about, beside = list(words[:cut]), [word for word in words[cut:] if word not in FILLER_WORDS | PURPOSE | PLACES]
    telling = [word for word in about if word not in FILLER_WORDS]
    if telling and about[0] in ("of", "in"):
        holds = about[0] == "of" and telling[-1] in CONTENTS
        if holds or not is_described(telling[-1]):
            return [], [*telling, *beside]
    return about, beside


def more_exact(one: Look, other: Look) -> Look | None:
    """Return the more exact of two names of one material: oak, of wood and oak; None for two materials."""
    if one == other or (one.surface == other.surface and other.material in _PLAIN):
        return one
    return other if one.surface == other.surface and one.material in _PLAIN else None


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
        precious = OF_PRECIOUS_METAL.get(phrase) if at and words[at - 1] == "of" else None
        look, rgb = material_of(precious or phrase), None if precious else color_of(phrase)
        behind = words[end] if end < len(words) else ""
        if behind in _COLORED and (rgb is not None or look is not None):
            return _Said(at, end + 1, rgb or (look.rgb if look is not None else None))
        if look is not None and behind not in NO_MATTER_BEFORE and (of is None or is_matter(phrase, look, of)):
            return _Said(at, end, rgb, look)
        if rgb is not None and behind not in _NO_COLOR_BEFORE:
            shade = words[at - 1] if at and words[at - 1] in SHADES else None
            kind = SAME_COLOR.get(phrase, phrase)
            rgb = rgb if shade is None else shaded(rgb, shade)
            return _Said(at, end, rgb, None, kind in BASIC_COLORS, kind if kind in (CLEAR, *METAL_COLORS) else "")
    return None


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
                f"two colours for one object, {first} and {second}: state which part has which, such as"
                f" 'a {first} mug with a {second} handle'"
            )
        if CLEAR in (color.kind, each.kind):  # transparent blue is a blue that is seen through
            hue = each if color.kind == CLEAR else color
            color = _Said(color.start, each.end, hue.rgb, None, hue.basic, CLEAR)
        elif each.basic and color.basic:
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
            f"two materials for one object, {first} and {second}: state which part has which, such as"
            f" 'a {first} knife with a {second} handle'"
        )
    exact = [look for look in looks if look.material not in _PLAIN] or looks
    return exact[-1] if exact else None
