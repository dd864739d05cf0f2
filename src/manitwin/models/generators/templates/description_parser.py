"""Parse an object description: category, colours, materials, sizes; 'a red ceramic mug with a wooden handle, 9 cm tall'."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.annotators.walls import METALS
from manitwin.models.generators.templates.look_phrases import (
    LookDescription,
    LookRequest,
    more_specific_look,
    parse_look_description,
    parse_trailing_description,
)
from manitwin.models.generators.templates.looks import look_of
from manitwin.models.generators.templates.matter import is_composite
from manitwin.models.generators.templates.named_category import find_category
from manitwin.models.generators.templates.part_statements import (
    assign_two_colors,
    leading_part_statement,
    move_part_statements,
    parse_part_statements,
    slot_name,
)
from manitwin.models.generators.templates.proportions import MARGIN
from manitwin.models.generators.templates.standard_sizes import StandardSize, join_size_codes, standard_size
from manitwin.models.generators.templates.stated_amounts import Amount, amounts_in, without_amounts
from manitwin.models.generators.templates.stated_lengths import (
    DIRECTIONS,
    INCHES,
    LENGTH,
    ROUNDED,
    has_several_lengths,
    lengths_of_parts,
    lengths_of_whole,
    normalise_lengths,
    without_lengths_of_parts,
)
from manitwin.models.generators.templates.template import Template

MAX_CHARACTERS = 400
_NEGATION = re.compile(r"\b(?:no(?!\.? ?\d)|not|without)\b")
"""Negations are refused, since a template cannot express them and ignoring them would give another object."""
_NEGATIVE = re.compile(r"(?:^|(?<=[^\d\W]) |(?<=[(,:]) ?)[-−]\.?\d[\d.]*")
"""A minus sign before a number, after a word, bracket or comma; after a digit it is a range, within a word a hyphen."""
_TOOL_HEADS = ("head", "blade")
_COLORED_MATTER = {"plastic", "rubber"}
_ONE_OF = re.compile(r"^(?:one|any|each|either) of (?:the|these|those|my|our) ")
_SHAPED_LIKE = re.compile(r" (?:(?:that is )?shaped like|in the (?:shape|form) of|(?:that looks|looking) like) ")
_NO_LENGTH = re.compile(r"#?\d[\d.]*(?:x\d[\d.]*)*")
"""One or several numbers, joined by 'x', without a unit."""
_NUMBERED = frozenset(
    {"no", "number", "nr", "model", "type", "version", "mark", "mk", "series", "vol", "volume", "route"}
)
_IS_SIZED = re.compile(r"\b(?:size|eur?) ((?:\w{1,3} )?(?:\d[\d.]*|x*[sml]|small|medium|large|one)\b)")
_WITH = re.compile(r" (?:(?:that|which|it|and) )?(?:with|having|featuring|whose|has) | and an? (?=.)")


@dataclass(frozen=True)
class ObjectDescription:
    """A parsed description. ``wishes`` are keyed by part ('' for the whole), ``lengths_m`` by direction ('' for the longest
    side).

    ``relative`` is the relative position in the category's size interval, None if not stated. ``unused`` are words without
    meaning to a template. ``part_lengths_m`` are lengths of the longest sides of parts or slots. ``amount`` is the volume or
    mass. ``measures`` are those of a standard size, such as an M8 x 40 bolt. ``nominal_m`` is the nominal size of a tool, such as
    that of a wrench.
    """

    category: str
    wishes: Mapping[str, LookRequest] = field(default_factory=dict)
    lengths_m: Mapping[str, float] = field(default_factory=dict)
    relative: float | None = None
    unused: tuple[str, ...] = ()
    part_lengths_m: Mapping[str, float] = field(default_factory=dict)
    amount: Amount | None = None
    measures: Mapping[str, float] = field(default_factory=dict)
    nominal_m: float | None = None

    @property
    def solves_measures(self) -> bool:
        """Whether a uniform scale cannot meet the statements: several lengths, a part's length, or an amount besides a length."""
        beside = self.amount is not None or len(self.lengths_m) > 1
        return bool(self.part_lengths_m) or (bool(self.lengths_m) and beside)

    @property
    def scaling_amount(self) -> Amount | None:
        """The volume or mass that determines the scale; None if lengths do, or nothing is stated."""
        return None if self.solves_measures else self.amount


def read_text(text: str, templates: Mapping[str, Template]) -> ObjectDescription:
    """Parse a description.

    Raises UsageError if it names no category of a template, or several, asks for several objects, or states something that a
    template cannot express.
    """
    if len(text) > MAX_CHARACTERS:
        raise UsageError(f"a text of {len(text)} characters; at most {MAX_CHARACTERS} describe an object")
    plain = join_size_codes(normalise_lengths(text))
    _check_expressible(text, plain)
    try:
        plain = move_part_statements(_SHAPED_LIKE.sub(" for ", _ONE_OF.sub("the ", plain)), templates)
    except UsageError as error:
        raise UsageError(f"{text!r}: {error}") from None
    lengths = lengths_of_whole(plain)
    _check_lengths(text, plain)
    of_parts, plain = lengths_of_parts(plain), without_lengths_of_parts(plain)
    said_in, plain = plain, without_amounts(plain)
    rest = LENGTH.sub(lambda m: "" if m[3] in DIRECTIONS else m[3], plain)
    main, *told = _WITH.split(rest, maxsplit=1)
    found = find_category(main.split(), text, templates)
    template, prior = templates[found.category], load_priors()[found.category]
    try:
        parts, whole = leading_part_statement(found.before, template)
        parts += parse_part_statements(told[0], template) if told else []
        shared, whole = assign_two_colors(whole, template)
        tailed, tail = assign_two_colors(found.tail, template)
        parts = [*shared, *tailed, *parts]
        before = parse_look_description(whole, prior)
        slot = _slot_of_material(before.wish, template, prior)
        if slot is not None:
            parts = [(slot, LookDescription(before.wish)), *parts]
            before = replace(before, wish=LookRequest())
        words = _merge_descriptions(before, parse_look_description(found.own), parse_trailing_description(tail))
        coated = _slot_of_color(words.wish, template)
        if coated is not None and coated not in {part for part, _ in parts}:
            parts = [(coated, LookDescription(words.wish)), *parts]
            words = replace(words, wish=LookRequest())
        wishes = {} if words.wish == LookRequest() else {"": words.wish}
        unused = list(words.unused)
        if any(part == "" for part, _ in parts):
            words = _merge_descriptions(
                words, LookDescription(), LookDescription(next(said.wish for part, said in parts if part == ""))
            )
        for part, said in parts:
            wishes[part] = said.wish.completed_by(wishes.get(part, LookRequest()))
            unused += [*said.unused, *([part] if any(word.isdigit() for word in said.unused) else [])]  # '192 pages'
    except UsageError as error:
        raise UsageError(f"{text!r}: {error}") from None
    amounts = amounts_in(said_in, prior)
    if len(amounts) > 1 or (amounts and amounts[0].volume_m3 is None and (lengths or of_parts)):
        stated = " and ".join([*(each.said for each in amounts), *(["a length"] if lengths or of_parts else [])])
        raise UsageError(
            f"{text!r} states {stated}: say one volume or one mass, of the two a volume alone beside lengths"
        )
    part_lengths = {slot_name(word, template): length for word, length in of_parts.items()}
    try:
        size = standard_size(found.category, main.split())
    except UsageError as error:
        raise UsageError(f"{text!r}: {error}") from None
    lengths = _reconcile_lengths(size, lengths, text)
    lengths, part_lengths = _diagonal(plain, lengths, part_lengths, template, text)
    nominal_m = None
    if lengths.keys() == {""} and _is_nominal(lengths[""], template, prior):
        nominal_m, lengths = lengths[""], {}
    unused = [word for word in unused if size is None or word not in (size.code, "x")]
    _check_numbers(text, unused)
    amount, measures = next(iter(amounts), None), {} if size is None else size.measures
    return ObjectDescription(
        found.category, wishes, lengths, words.relative, tuple(unused), part_lengths, amount, measures, nominal_m
    )


def _is_nominal(length_m: float, template: Template, prior: Prior) -> bool:
    """Return whether a length is a tool's nominal size: too short for the whole object, and in the range of such sizes."""
    of_it = [template.measures[name] for name in template.nominal]
    low = template.nominal_times * math.prod(measure.low for measure in of_it) / MARGIN
    high = template.nominal_times * math.prod(measure.high for measure in of_it) * MARGIN
    return bool(of_it) and length_m < prior.longest_axis_m.low and low <= length_m <= high


def _diagonal(
    plain: str, lengths: dict[str, float], part_lengths: dict[str, float], template: Template, text: str
) -> tuple[dict[str, float], dict[str, float]]:
    """Return the lengths of the whole and of parts, where a screen size in inches is a diagonal: a laptop of 15.6 inches."""
    if template.diagonal_of and not lengths and part_lengths.keys() == {template.diagonal_of}:
        return {"diagonal": part_lengths[template.diagonal_of]}, {}
    inches = all(unit in INCHES for _, unit, _ in LENGTH.findall(plain))
    if template.diagonal_of and lengths.keys() == {""} and inches and not part_lengths:
        return {"diagonal": lengths[""]}, {}
    if "diagonal" in lengths and (not template.diagonal_of or len(lengths) + len(part_lengths) > 1):
        raise UsageError(f"{text!r}: a diagonal is told of a screen, and no other length beside it; say the sides")
    return lengths, part_lengths


def _reconcile_lengths(size: StandardSize | None, lengths: dict[str, float], text: str) -> dict[str, float]:
    """Return the lengths of a text or of its named size; raises UsageError if they contradict each other."""
    if size is None or not lengths:
        return lengths if size is None else dict(size.lengths_m)
    said, named = (sorted(each.values()) for each in (lengths, size.lengths_m))
    if len(said) == len(named) and all(abs(a - b) <= ROUNDED * b for a, b in zip(said, named, strict=True)):
        return dict(size.lengths_m)
    raise UsageError(
        f"{text!r} states a size, {size.code}, and a length: say one, or both as one, such as 'M8 x 40' of a bolt"
    )


def _check_numbers(text: str, unused: list[str]) -> None:
    """Raise UsageError for a number without a unit, which may be a size. Counts ('192 pages') and numbering ('No. 2') are
    accepted.
    """
    for at, word in enumerate(unused):
        counted = at + 1 < len(unused) and not any(character.isdigit() for character in unused[at + 1])
        counted = counted and unused[at + 1] != "x" and "x" not in word
        numbered = at > 0 and (unused[at - 1] in _NUMBERED or re.fullmatch(r"[a-wyz]", unused[at - 1]) is not None)
        if _NO_LENGTH.fullmatch(word) and not counted and not numbered:
            raise UsageError(
                f"{text!r}: {word!r} has no unit; give one, such as '30 cm', '12 in' or '500 ml', or leave it out"
            )


def _slot_of_material(wish: LookRequest, template: Template, prior: Prior) -> str | None:
    """Return the slot that a material before the name of a composite object refers to: the handle of a wooden hammer."""
    if wish.material is None or not is_composite(prior):
        return None
    usual = {slot: {look_of(words).surface for words in choices if words} for slot, choices in template.slots.items()}
    first = next(iter(usual))
    of_it = [slot for slot, surfaces in usual.items() if wish.material.surface in surfaces]
    return of_it[0] if of_it and first not in of_it else None


def _slot_of_color(wish: LookRequest, template: Template) -> str | None:
    """Return the slot that a colour of the whole refers to if the head is bare metal: the handle of a red hammer."""
    if wish.rgb is None or wish.material is not None or wish.kind:
        return None
    usual = {slot: {look_of(words).surface for words in choices if words} for slot, choices in template.slots.items()}
    first = next(iter(usual))
    if first not in _TOOL_HEADS or not usual[first].issubset(METALS):
        return None
    return next((slot for slot, surfaces in usual.items() if surfaces & _COLORED_MATTER), None)


def _merge_descriptions(before: LookDescription, own: LookDescription, tail: LookDescription) -> LookDescription:
    """Return the combined meaning of the words before, in and after a name; raises UsageError for contradictions."""
    one, other = before.wish, tail.wish
    if one.rgb is not None and other.rgb is not None and one.rgb != other.rgb:
        raise UsageError("two colours for one object: state which part has which")
    if one.material is not None and other.material is not None:
        exact = more_specific_look(one.material, other.material)
        if exact is None:
            raise UsageError("two materials for one object: state which part has which")
        one = replace(one, material=exact)
    wish = one.completed_by(other).completed_by(own.wish)
    relative = next((said.relative for said in (before, tail) if said.relative is not None), None)
    return LookDescription(wish, relative, before.unused + tail.unused)


def _check_expressible(text: str, plain: str) -> None:
    """Raise UsageError for statements that a template cannot express."""
    if (below := _NEGATIVE.search(text)) is not None:
        raise UsageError(f"{text!r}: a negative length ({below[0].strip()!r}); state it without the sign")
    if (said := _NEGATION.search(plain)) is not None:
        raise UsageError(f"{text!r}: a template cannot use a negation ({said[0]!r}); leave it out, or give a length")
    if (sized := _IS_SIZED.search(plain)) is not None:
        raise UsageError(
            f"{text!r}: {sized[0]!r} is not understood, because sizes of clothes, shoes and rings are not lengths;"
            f" give a length, such as '28 cm long', or 'small' or 'large' before the name"
        )


def _check_lengths(text: str, plain: str) -> None:
    """Raise UsageError if several lengths of one side are stated."""
    if has_several_lengths(plain):
        raise UsageError(
            f"{text!r} states several lengths of one side, or from which to which one is; say one of each, such as '9 cm tall and"
            " 8 cm wide'"
        )
