"""Colours, materials and relative sizes in the words around an object's name: 'small', 'dark blue', 'stainless steel'."""

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
    PRECIOUS_METALS,
    SAME_COLOR,
    SHADES,
    Look,
    apply_shade,
    color_of,
    material_of,
    usual_looks,
)
from manitwin.models.generators.templates.matter import (
    NON_MATERIAL_HEADS,
    is_composite,
    is_material_of_object,
    surfaces_of,
)
from manitwin.models.generators.templates.vocabulary import (
    CONTENTS,
    FILLER_WORDS,
    PLACES,
    PURPOSE,
    RELATIVE,
    is_other_object_start,
)

_GOLDEN = frozenset({"brass", "bronze", "copper"})
_NO_COLOR_BEFORE = frozenset({"resistant", "proof", "free", "remover", "removal"})
"""After these words, a colour word is no colour: rust resistant."""
_COLORED = frozenset({"colored", "coloured", "color", "colour", "painted"})
_PLAIN = frozenset(
    {"ceramic", "plastic", "wood", "steel", "stainless steel", "rubber", "glass", "paper", "stone", "fabric"}
)
"""Generic materials that a second word can specify: a wooden oak spoon is made of oak."""


@dataclass(frozen=True)
class LookRequest:
    """A requested colour or material, or both. ``kind`` is the colour word if it also implies a material."""

    rgb: tuple[float, float, float] | None = None
    material: Look | None = None
    kind: str = ""

    def apply_to(self, look: Look) -> Look:
        """Return a look with the requested properties applied."""
        matter = look if self.material is None or self.material.material == look.material else self.material
        return matter if self.rgb is None else matter.colored(self.rgb)

    def completed_by(self, other: LookRequest) -> LookRequest:
        """Return this wish completed by another one."""
        return LookRequest(
            other.rgb if self.rgb is None else self.rgb,
            other.material if self.material is None else self.material,
            other.kind if self.rgb is None else self.kind,
        )

    def candidate_looks(self, usual: Sequence[Look]) -> list[Look]:
        """Return the looks to sample from, given the ``usual`` looks of a part; unspecified properties are sampled."""
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
class LookDescription:
    """Meaning of some words: colour and material, relative size (None if not stated), and words without meaning to a template."""

    wish: LookRequest = LookRequest()
    relative: float | None = None
    unused: tuple[str, ...] = ()


@dataclass(frozen=True)
class _LookPhrase:
    """A colour or material expressed by the words ``start`` to ``end``."""

    start: int
    end: int
    rgb: tuple[float, float, float] | None = None
    material: Look | None = None
    basic: bool = False
    kind: str = ""


def parse_look_description(words: Sequence[str], of: Prior | None = None) -> LookDescription:
    """Return the meaning of words. ``of`` is the prior of the object if they precede its name, where they may state its purpose.

    A word that is both a colour and a material (copper) means the material if no other is stated. Raises UsageError for two
    colours, two materials or contradicting sizes.
    """
    said, unused = _find_look_phrases(words, of)
    sizes = [word for word in unused if word in RELATIVE]
    relative = [RELATIVE[word] for word in sizes]
    if relative and min(relative) < 0.5 < max(relative):
        raise UsageError(f"two sizes for one object, {' and '.join(sizes)}: say one")
    left = tuple(word for word in unused if word not in RELATIVE)
    color = _combined_color(said, words)
    look = _stated_material(said)
    rgb = _shade_of(said, look, words) if color is None else color.rgb
    return LookDescription(
        LookRequest(rgb, look, "" if color is None else color.kind), relative[-1] if relative else None, left
    )


def _shade_of(
    said: Sequence[_LookPhrase], look: Look | None, words: Sequence[str]
) -> tuple[float, float, float] | None:
    """Return the colour of a material with a shade ('dark wood'); None without a shade."""
    shades = [words[each.start - 1] for each in said if each.start and each.material is not None]
    shade = next((word for word in shades if SHADES.get(word)), None)
    return None if look is None or shade is None else apply_shade(look.rgb, shade)


def stated_materials(before: Sequence[str], called: Sequence[str], tail: Sequence[str], of: Prior) -> list[Look]:
    """Return the materials stated around and in an object's name, whatever the colours.

    A material in the name counts if it is one of several usual ones (paper cup, but not paper towel), or an unusual one in a name
    that is not the category itself (plastic jar). Raises UsageError for two materials in one group of words.
    """
    named = [
        each
        for each in _find_look_phrases([*before, *called], of)[0]
        if each.end <= len(before) or _is_stated_material(each.material, each.end - len(before), called, of)
    ]
    said = [_stated_material(named), _stated_material(_find_look_phrases(_split_description(tail)[0], None)[0])]
    return [look for look in said if look is not None]


def material_words_in_name(called: Sequence[str], of: Prior) -> list[str]:
    """Return the words of an object's name that state its material."""
    found = [
        each for each in _find_look_phrases(called, of)[0] if _is_stated_material(each.material, each.end, called, of)
    ]
    return [word for each in found for word in called[each.start : each.end]]


def _is_stated_material(look: Look | None, end: int, called: Sequence[str], of: Prior) -> bool:
    """Return whether a material in an object's name, ending before word ``end``, states the material of this object."""
    if look is None or end == len(called) or is_composite(of):
        return False
    usual = surfaces_of(of)
    if look.surface in usual:
        return len(usual) > 1
    return " ".join(called) != of.category.lower()


def _find_look_phrases(words: Sequence[str], of: Prior | None) -> tuple[list[_LookPhrase], list[str]]:
    """Return the colours and materials in some words, and the words that express neither."""
    said, left = list[_LookPhrase](), list[str]()
    at = 0
    while at < len(words):
        found = _look_phrase_at(words, at, of)
        if found is not None:
            said.append(found)
            at = found.end
            continue
        if words[at] not in FILLER_WORDS and words[at] not in SHADES:
            left.append(words[at])
        at += 1
    return said, left


def parse_trailing_description(words: Sequence[str]) -> LookDescription:
    """Return the meaning of the words after a name: red for 'a mug in red', nothing for 'a glass of red wine'.

    Raises UsageError as ``described`` does.
    """
    about, beside = _split_description(words)
    said = parse_look_description(about)
    return LookDescription(said.wish, said.relative, (*said.unused, *beside))


def _split_description(words: Sequence[str]) -> tuple[list[str], list[str]]:
    """Return the words after a name that describe it, and those that describe its contents or purpose."""
    cut = next((at for at, word in enumerate(words) if is_other_object_start(words, at)), len(words))
    about, beside = list(words[:cut]), [word for word in words[cut:] if word not in FILLER_WORDS | PURPOSE | PLACES]
    telling = [word for word in about if word not in FILLER_WORDS]
    if telling and about[0] in ("of", "in"):
        holds = about[0] == "of" and telling[-1] in CONTENTS
        if holds or not is_descriptive(telling[-1]):
            return [], [*telling, *beside]
    return about, beside


def more_specific_look(one: Look, other: Look) -> Look | None:
    """Return the more specific of two names of one material (oak, of wood and oak); None for two different materials."""
    if one == other or (one.surface == other.surface and other.material in _PLAIN):
        return one
    return other if one.surface == other.surface and one.material in _PLAIN else None


def is_descriptive(word: str) -> bool:
    """Return whether a word expresses a colour, a material, a shade or a relative size."""
    return color_of(word) is not None or material_of(word) is not None or word in RELATIVE or word in SHADES


def _look_phrase_at(words: Sequence[str], at: int, of: Prior | None) -> _LookPhrase | None:
    """Return the colour or material that starts at a word, trying the longest phrase first."""
    for length in (3, 2, 1):
        end = at + length
        phrase = " ".join(words[at:end])
        if end > len(words):
            continue
        precious = PRECIOUS_METALS.get(phrase) if at and words[at - 1] == "of" else None
        look, rgb = material_of(precious or phrase), None if precious else color_of(phrase)
        behind = words[end] if end < len(words) else ""
        if behind in _COLORED and (rgb is not None or look is not None):
            return _LookPhrase(at, end + 1, rgb or (look.rgb if look is not None else None))
        if (
            look is not None
            and behind not in NON_MATERIAL_HEADS
            and (of is None or is_material_of_object(phrase, look, of))
        ):
            return _LookPhrase(at, end, rgb, look)
        if rgb is not None and behind not in _NO_COLOR_BEFORE:
            shade = words[at - 1] if at and words[at - 1] in SHADES else None
            kind = SAME_COLOR.get(phrase, phrase)
            rgb = rgb if shade is None else apply_shade(rgb, shade)
            return _LookPhrase(at, end, rgb, None, kind in BASIC_COLORS, kind if kind in (CLEAR, *METAL_COLORS) else "")
    return None


def _combined_color(said: Sequence[_LookPhrase], words: Sequence[str]) -> _LookPhrase | None:
    """Return the combined colour of adjacent colour phrases: the more specific one, or their mean."""
    pure = [each for each in said if each.rgb is not None and each.material is None]
    if not pure and sum(each.material is not None for each in said) > 1:
        pure = [each for each in said if each.rgb is not None]  # copper ceramic: copper is the colour
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
        if CLEAR in (color.kind, each.kind):  # transparent blue: clear with a blue tint
            hue = each if color.kind == CLEAR else color
            color = _LookPhrase(color.start, each.end, hue.rgb, None, hue.basic, CLEAR)
        elif each.basic and color.basic:
            mixed = np.mean([rgb for rgb in (color.rgb, each.rgb) if rgb is not None], axis=0)
            color = _LookPhrase(color.start, each.end, (float(mixed[0]), float(mixed[1]), float(mixed[2])), None, True)
        elif color.basic:
            color = _LookPhrase(color.start, each.end, each.rgb)
        end = each.end
    return color


def _stated_material(said: Sequence[_LookPhrase]) -> Look | None:
    """Return the stated material; of two names of the same material, the more specific one."""
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
