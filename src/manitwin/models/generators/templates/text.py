"""Read what a sentence asks for: category, colours, materials, sizes; 'a red ceramic mug with a wooden handle, 9 cm tall'."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.annotators.walls import METALS
from manitwin.models.generators.templates.described import (
    FILLER_WORDS,
    RELATIVE,
    Described,
    Wish,
    described,
    described_behind,
    is_described,
)
from manitwin.models.generators.templates.looks import look_of
from manitwin.models.generators.templates.matter import is_composite
from manitwin.models.generators.templates.named_category import find_category, plain_words
from manitwin.models.generators.templates.stated_amounts import Amount, amounts_in, without_amounts
from manitwin.models.generators.templates.stated_lengths import (
    DIRECTIONS,
    LENGTH,
    in_figures,
    lengths_in,
    lengths_of_parts,
    several_lengths,
    without_lengths_of_parts,
)
from manitwin.models.generators.templates.template import Template

MAX_CHARACTERS = 400
_NEGATION = re.compile(r"\b(?:no(?!\.? ?\d)|not|without)\b")
"""What no template can be told: left out in silence, the thing would be another one."""
_NEGATIVE = re.compile(r"(?:^|(?<=[^\d\W]) |(?<=[(,:]) ?)[-−]\.?\d[\d.]*")
"""A minus before a number, behind a word, a bracket or a comma: behind a digit it parts a range, within a word it joins."""
_PART_NAMES = {
    "lid": ("cap",), "cap": ("lid",), "top": ("cap", "lid"), "stopper": ("cap",), "cork": ("cap",), "grip": ("handle",),
    "blade": ("head",), "strap": ("band",), "display": ("screen",), "bristle": ("bristles",),
}  # fmt: skip
"""Other words for slots of templates, the best first."""
_TOOL_HEADS = ("head", "blade")
_COLORED_MATTER = {"plastic", "rubber"}
_COMMON_PARTS = ("handle", "lid", "cap", "rim", "blade")
_PART_BEHIND_COMMA = re.compile(
    rf" ?, (?=(?:an? )?(?:(?!with\b)[a-z]+ ){{0,3}}(?:{'|'.join(_COMMON_PARTS)})s?(?:$| ?,| and\b))"
)
"""'a screwdriver, yellow handle'."""
_WITH = re.compile(r" (?:with|having|featuring) | and an? (?=.)| (?:that|which) has ")


@dataclass(frozen=True)
class Wanted:
    """What a text asks for: ``wishes`` by the name of a part, '' for the whole; ``lengths_m`` by direction, '' for the longest.

    ``relative`` is where in the category's interval of sizes it is, None where the text does not say; ``unused`` are the words
    that say nothing to a template; ``part_lengths_m`` those of parts or slots, of each its longest side; ``amount`` is the
    volume or the mass.
    """

    category: str
    wishes: Mapping[str, Wish] = field(default_factory=dict)
    lengths_m: Mapping[str, float] = field(default_factory=dict)
    relative: float | None = None
    unused: tuple[str, ...] = ()
    part_lengths_m: Mapping[str, float] = field(default_factory=dict)
    amount: Amount | None = None

    @property
    def solves_measures(self) -> bool:
        """Whether one scale for the whole cannot give what is stated: several lengths, that of a part, a volume beside them."""
        beside = self.amount is not None or len(self.lengths_m) > 1
        return bool(self.part_lengths_m) or (bool(self.lengths_m) and beside)

    @property
    def scaling_amount(self) -> Amount | None:
        """The volume or mass that sets the scale; None where lengths do, or nothing."""
        return None if self.solves_measures else self.amount


def read_text(text: str, templates: Mapping[str, Template]) -> Wanted:
    """Return what a text asks for.

    Raises UsageError where it names no category that there is a template of, or several, asks for several things, or says what
    a template cannot be told.
    """
    if len(text) > MAX_CHARACTERS:
        raise UsageError(f"a text of {len(text)} characters; at most {MAX_CHARACTERS} describe an object")
    plain, lengths = in_figures(text), lengths_in(text)
    _check_taken(text, plain)
    of_parts, plain = lengths_of_parts(plain), without_lengths_of_parts(plain)
    said_in, plain = plain, without_amounts(plain)
    rest = LENGTH.sub(lambda m: "" if m[3] in DIRECTIONS else m[3], plain)
    main, *features = _WITH.split(_PART_BEHIND_COMMA.sub(" with ", rest), maxsplit=1)
    found = find_category(main.split(), text, templates)
    template, prior = templates[found.category], load_priors()[found.category]
    try:
        parts, whole = _part_before(found.before, template)
        parts += _features(features[0], template) if features else []
        before = described(whole, prior)
        slot = _slot_meant(before.wish, template, prior)
        if slot is not None:
            parts = [(slot, Described(before.wish)), *parts]
            before = replace(before, wish=Wish())
        words = _joined(before, described(found.own), described_behind(found.tail))
        coated = _slot_coated(words.wish, template)
        if coated is not None and coated not in {part for part, _ in parts}:
            parts = [(coated, Described(words.wish)), *parts]
            words = replace(words, wish=Wish())
        wishes = {} if words.wish == Wish() else {"": words.wish}
        unused = list(words.unused)
        for part, said in parts:
            wishes[part] = said.wish.over(wishes.get(part, Wish()))
            unused += said.unused
    except UsageError as error:
        raise UsageError(f"{text!r}: {error}") from None
    amounts = amounts_in(said_in, prior)
    if len(amounts) > 1 or (amounts and amounts[0].volume_m3 is None and (lengths or of_parts)):
        stated = " and ".join([*(each.said for each in amounts), *(["a length"] if lengths or of_parts else [])])
        raise UsageError(
            f"{text!r} states {stated}: say one volume or one mass, of the two a volume alone beside lengths"
        )
    part_lengths = {_slot_called(word, template): length for word, length in of_parts.items()}
    return Wanted(
        found.category, wishes, lengths, words.relative, tuple(unused), part_lengths, next(iter(amounts), None)
    )


def _slot_meant(wish: Wish, template: Template, prior: Prior) -> str | None:
    """Return the part that a material before the name is of, where the thing is of several: of a wooden hammer the handle."""
    if wish.material is None or not is_composite(prior):
        return None
    usual = {slot: {look_of(words).surface for words in choices if words} for slot, choices in template.slots.items()}
    first = next(iter(usual))
    of_it = [slot for slot, surfaces in usual.items() if wish.material.surface in surfaces]
    return of_it[0] if of_it and first not in of_it else None


def _slot_coated(wish: Wish, template: Template) -> str | None:
    """Return the part that a colour of the whole is of, where nobody paints the whole: of a red hammer the handle."""
    if wish.rgb is None or wish.material is not None or wish.kind:
        return None
    usual = {slot: {look_of(words).surface for words in choices if words} for slot, choices in template.slots.items()}
    first = next(iter(usual))
    if first not in _TOOL_HEADS or not usual[first].issubset(METALS):
        return None
    return next((slot for slot, surfaces in usual.items() if surfaces & _COLORED_MATTER), None)


def _joined(before: Described, own: Described, tail: Described) -> Described:
    """Return what is said before a name, in it and behind it: of one thing, so that two colours contradict each other."""
    wishes = [said.wish for said in (before, tail)]
    for what in ("rgb", "material"):
        first, second = (getattr(wish, what) for wish in wishes)
        if first is not None and second is not None and first != second:
            raise UsageError(
                f"two {'colours' if what == 'rgb' else 'materials'} of one thing: say which part has which"
            )
    wish = before.wish.over(tail.wish).over(own.wish)
    relative = next((said.relative for said in (before, tail) if said.relative is not None), None)
    return Described(wish, relative, before.unused + tail.unused)


def _part_before(words: list[str], template: Template) -> tuple[list[tuple[str, Described]], list[str]]:
    """Return what is said of a part before the name ('a red handled hammer'), and the words that are left."""
    for at, word in enumerate(words):
        part = word if word in template.slots else None
        for name in (*template.slots, *_COMMON_PARTS):
            if word in (f"{name}d", f"{name}ed", f"{name}{name[-1]}ed"):
                part = _slot_called(name, template)
        if part is not None and at:
            return [(part, _of_part(words[:at]))], words[at + 1 :]
    return [], words


def _slot_called(word: str, template: Template) -> str:
    """Return the slot that a word means, in the plural or by another name; else the word itself, in the singular."""
    names = [word, word.removesuffix("s"), f"{word}s"]
    names += [other for name in names[:2] for other in _PART_NAMES.get(name, ())]
    return next((name for name in names if name in template.slots), names[1])


def _features(text: str, template: Template) -> list[tuple[str, Described]]:
    """Return what is said of each part behind 'with': 'a red handle, black head and green claw'.

    A part that nothing is said of is as the one before it: of 'a red handle and lid' both are red.
    """
    features: list[tuple[str, Described]] = []
    before: list[str] = []
    for phrase in re.split(r"( and an? |^an? | and | , | with )", f" {text} ".replace("  ", " ")):
        words = [word for word in plain_words(phrase.split()) if word not in FILLER_WORDS]
        if not words:
            continue
        names = [at for at, word in enumerate(words) if not is_described(word) or word in template.slots]
        if not names and _slot_called(words[-1], template) in template.slots:  # 'a cork' is a part, and of cork
            features.append((_slot_called(words[-1], template), _of_part([*before, *words])))
            before = []
            continue
        if not names:
            before += [*words, "and"]  # 'red and white stripes'
            continue
        at = names[-1]  # the last but for 'a handle in red'
        said = _of_part([*before, *words[:at], *words[at + 1 :]])
        features.append(
            (_slot_called(words[at], template), said if said != Described() or not features else features[-1][1])
        )
        before = []
    if before:
        raise UsageError(f"no part is named that is {' '.join(before[:-1])}")
    return features


def _of_part(words: list[str]) -> Described:
    """Return what words say of a part, whose size a template cannot be told."""
    said = described([word for word in words if word not in RELATIVE])
    return Described(said.wish, None, (*said.unused, *(word for word in words if word in RELATIVE)))


def _check_taken(text: str, plain: str) -> None:
    """Raise UsageError for what a template cannot be told."""
    if (below := _NEGATIVE.search(text)) is not None:
        raise UsageError(f"{text!r}: a length below zero ({below[0].strip()!r}); state it without the sign")
    if (said := _NEGATION.search(plain)) is not None:
        raise UsageError(
            f"{text!r}: a template cannot be told what a thing is not ({said[0]!r}); leave it out, or say a length"
        )
    if several_lengths(text):
        raise UsageError(
            f"{text!r} states several lengths of one side, or from which to which one is; say one of each, such as '9 cm tall and"
            " 8 cm wide'"
        )
