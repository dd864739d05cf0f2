"""Statements on single parts in a description: 'a red handle', 'red handled', 'blades 12 cm, handles red', 'yellow inside'."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import cache
from itertools import permutations

from manitwin.errors import UsageError
from manitwin.models.annotators.prior_names import named
from manitwin.models.generators.templates.look_phrases import (
    LookDescription,
    LookRequest,
    is_descriptive,
    parse_look_description,
)
from manitwin.models.generators.templates.looks import color_of, look_of
from manitwin.models.generators.templates.named_category import find_category, is_adjective, plain_words
from manitwin.models.generators.templates.stated_amounts import without_amounts
from manitwin.models.generators.templates.stated_lengths import DIRECTIONS, LENGTH
from manitwin.models.generators.templates.template import Builder, Template
from manitwin.models.generators.templates.vocabulary import FILLER_WORDS, PLACES, PURPOSE, RELATIVE

_PART_NAMES = {
    "lid": ("cap",), "cap": ("lid",), "top": ("cap", "lid"), "stopper": ("cap",), "cork": ("cap",), "grip": ("handle",),
    "blade": ("head",), "strap": ("band",), "display": ("screen",), "bristle": ("bristles",), "edge": ("rim",), "rim": ("frame",),
    "outside": ("body",), "exterior": ("body",), "interior": ("inside",),
}  # fmt: skip
"""Synonyms of template slots, best match first."""
_COMMON_PARTS = ("handle", "lid", "cap", "rim", "blade", "knob", "spout", "strap", "base")
"""Common parts that a text may mention whether or not the object has them."""
_WITH = re.compile(r" (?:(?:, )?(?:and|that|which|it) )?(?:with|having|featuring|whose|has) ")
MOST_PIECES = 8
"""Number of comma-separated pieces that are searched for the object's name."""
_SOMEWHERE = re.compile(r" (?:in|on|at|near|around|along|under|above) the ")
_PIECES = re.compile(r" ?[,;:] ")
_LONGEST_SIDE_WORDS = {"", "long", "length", "across", "diameter", "longest"}
"""Directions that mean the longest side of a part, the only length that a part can be given."""
_SKIPPED_WORDS = frozenset(("are", "were", "each", "both", "length", "long", "size")) | FILLER_WORDS
_PLACE_PREPOSITIONS = frozenset({"next", "inside", "on", "at", "for", "to", "by", "near", "under", "without"})


def move_part_statements(plain: str, templates: Mapping[str, Template]) -> str:
    """Return a text in the form of ``normalise_lengths`` with statements on parts after the name moved behind 'with'.

    'a screwdriver , shaft 15 cm , red handle' becomes 'a screwdriver with a 15 cm shaft and a red handle'. Words after a length
    or amount are treated as after a comma: 'a hammer 16 oz red handle'. Raises UsageError for a length of a part that is not its
    longest side.
    """
    plain = _replace_compound_names(plain, templates)
    main, *told = _WITH.split(plain, maxsplit=1)
    name, template, behind = _split_at_name(main, templates)
    if template is None:
        return plain
    told, late = _split_trailing_lengths(told, template)
    if not (behind or late):
        return plain
    parts, others, beside = list[str](), list[str](), list[str]()
    for piece in behind:
        each = [_normalise_part_phrase(phrase, template) for phrase in re.split(r" and ", piece)]
        if len(each) > 1 and not all(each):
            each = [_normalise_part_phrase(piece, template)]
        if all(each):
            parts += [phrase for phrase in each if phrase is not None]
        elif _is_about_other_noun(piece):
            beside.append(piece)
        else:
            others.append(piece)
    parts += late
    main = " for ".join([" , ".join([name, *others]), *beside])
    return " with ".join([main, *([" and ".join(parts)] if parts else []), *told])


def _split_trailing_lengths(told: list[str], template: Template) -> tuple[list[str], list[str]]:
    """Return the statements after 'with' without lengths of further parts after a comma, and these lengths: ', blade 9 cm'."""
    if not told:
        return told, []
    first, *pieces = _PIECES.split(told[0])
    late = {at: _normalise_part_phrase(piece, template) for at, piece in enumerate(pieces) if LENGTH.search(piece)}
    kept = [piece for at, piece in enumerate(pieces) if late.get(at) is None]
    return [" , ".join([first, *kept])], [phrase for phrase in late.values() if phrase is not None]


def _replace_compound_names(plain: str, templates: Mapping[str, Template]) -> str:
    """Return a text with names that contain 'with' replaced by their categories: the saucer of a cup with saucer is no part."""
    for template in templates.values():
        for name in template.names:
            if " with " in name:
                plain = re.sub(rf"\b{name}\b", template.category, plain)
    return plain


def _is_about_other_noun(piece: str) -> bool:
    """Return whether the colours of a piece belong to a noun that is no part: gold accents, black ink."""
    words = [word for word in plain_words(_without_numbers(piece).split()) if word not in FILLER_WORDS]
    if len(words) < 2 or is_descriptive(words[-1]) or is_adjective(words[-1]) or not words[-1].isalpha():
        return False
    return named(words[-1]) is None and any(is_descriptive(word) for word in words[:-1])


def _split_at_name(main: str, templates: Mapping[str, Template]) -> tuple[str, Template | None, list[str]]:
    """Return the words up to the object's name, its template (None if no words name one), and the pieces after it."""
    pieces = [piece for piece in _PIECES.split(main) if piece.strip()]
    for at in range(min(len(pieces), MOST_PIECES)):
        head = " , ".join(pieces[: at + 1])
        cuts = _cut_behind_amounts(head)
        sure = [(name, rest) for name, rest in cuts if is_descriptive("".join(plain_words(rest.split())[-1:]))]
        for name, rest in (*sure, (head, ""), *cuts):
            try:
                found = find_category(_without_numbers(name).split(), name, templates)
            except UsageError:
                continue
            return name, templates[found.category], [*([rest] if rest else []), *pieces[at + 1 :]]
    return main, None, []


def _cut_behind_amounts(head: str) -> list[tuple[str, str]]:
    """Return the words up to and after each amount, where neither is empty."""
    cuts = []
    for amount in LENGTH.finditer(head):
        end = amount.end() if amount[3] in DIRECTIONS else amount.start(3)
        cuts.append((head[:end].strip(), head[end:].strip()))
    bare = without_amounts(head)
    if bare != " ".join(head.split()):
        words = head.split()
        cuts += [
            (" ".join(words[:at]), " ".join(words[at:]))
            for at in range(len(words) - 1, 0, -1)
            if _is_amount_end(words[:at])
        ]
    return [(name, rest) for name, rest in cuts if name and rest]


def _is_amount_end(words: list[str]) -> bool:
    """Return whether words end with a volume or mass."""
    return any(without_amounts(" ".join(words[-count:])) == "" for count in (1, 2, 3) if count <= len(words))


def _without_numbers(text: str) -> str:
    return LENGTH.sub(lambda m: "" if m[3] in DIRECTIONS else m[3], without_amounts(text))


def _normalise_part_phrase(phrase: str, template: Template) -> str | None:
    """Return a phrase on a part as 'a 12 cm red handle'; None if it names no part, or states nothing about it."""
    lengths = list(LENGTH.finditer(phrase))
    words = plain_words(LENGTH.sub(lambda m: "" if m[3] in DIRECTIONS else m[3], phrase).split())
    if len(lengths) > 1 or not _PLACE_PREPOSITIONS.isdisjoint(words[:1]):
        return None
    words = [
        word
        for at, word in enumerate(words)
        if word not in _SKIPPED_WORDS or (word == "and" and 0 < at < len(words) - 1)
    ]
    said = _part_at(words, len(words) - 1, template)
    if said is None or not (PURPOSE | PLACES).isdisjoint(said[1]):
        said = _part_at(words, 0, template)  # 'handle on the left'
    if said is None:
        return None
    part, others = said
    if not lengths:
        return " ".join(["a", *others, part])
    number, unit, direction = lengths[0].groups()
    if direction in DIRECTIONS and direction not in _LONGEST_SIDE_WORDS:
        raise UsageError(
            f"{phrase.strip()!r}: only the longest side of a part can be given, such as '{part} {number} {unit}'; leave"
            f" {direction!r} out or say it of the whole"
        )
    return " ".join(["a", number, unit, *others, part])


def _part_at(words: list[str], at: int, template: Template) -> tuple[str, list[str]] | None:
    """Return the part named by the words that end with, or start at, word ``at``, and the other words."""
    for length in (2, 1):
        start = max(at - length + 1, 0) if at else 0
        called = " ".join(words[start : start + length])
        part = find_part(called, template) or _part_of_adjective(called, template)
        part = part or (called.removesuffix("s") if called.removesuffix("s") in _COMMON_PARTS else None)
        if part is not None and len(words) >= start + length and not is_descriptive(called):
            return part, words[:start] + words[start + length :]
    return None


def find_part(word: str, template: Template) -> str | None:
    """Return the slot or part that a word means, including plurals and synonyms; None if it means none."""
    names = [word, word.removesuffix("s"), f"{word}s"]
    names += [other for name in names[:2] for other in _PART_NAMES.get(name, ())]
    for known in (template.slots, _built_parts(template.build, tuple(template.typical_measures().items()))):
        if (part := next((name for name in names if name in known), None)) is not None:
            return part
    return None


@cache
def _built_parts(build: Builder, measures: tuple[tuple[str, float], ...]) -> frozenset[str]:
    return frozenset(build(**dict(measures)).slots)


def _part_of_adjective(word: str, template: Template) -> str | None:
    """Return the part that an adjective such as 'handled' refers to; None for any other word."""
    for name in (*template.slots, *_COMMON_PARTS):
        if word in (f"{name}d", f"{name}ed", f"{name}{name[-1]}ed", f"{name.removesuffix('s')}ed"):
            return slot_name(name, template)
    return None


def leading_part_statement(words: list[str], template: Template) -> tuple[list[tuple[str, LookDescription]], list[str]]:
    """Return the statement on a part before the name ('a red handled hammer'), and the remaining words."""
    for at, word in enumerate(words):
        part = _part_of_adjective(word, template) or (word if word in template.slots else None)
        if part is not None and at:
            return [(part, parse_part_words(words[:at]))], words[at + 1 :]
    return [], words


def slot_name(word: str, template: Template) -> str:
    """Return the slot or part that a word means, including plurals and synonyms; else the word in the singular."""
    return find_part(word, template) or word.removesuffix("s")


def parse_part_statements(text: str, template: Template) -> list[tuple[str, LookDescription]]:
    """Return the statements on each part after 'with': 'a red handle, black head and green claw'.

    A part without a statement has that of the previous part: in 'a red handle and lid', both are red.
    """
    found: list[tuple[str, LookDescription]] = []
    before: list[str] = []
    mark, elsewhere = "", list[str]()
    for phrase in re.split(r"( and an? |^an? | and | , | with | and whose )", f" {text} ".replace("  ", " ")):
        mark = phrase.strip() if phrase.strip() in ("and", ",") else mark
        phrase, *place = _SOMEWHERE.split(phrase, maxsplit=1)  # 'a flower in the middle'
        elsewhere += [word for each in place for word in plain_words(each.split())]
        words = [word for word in plain_words(phrase.split()) if word not in FILLER_WORDS]
        words = _joined_names(words, template)
        if not words:
            continue
        names = [at for at, word in enumerate(words) if not is_descriptive(word) or word in template.slots]
        if not names and slot_name(words[-1], template) in template.slots:  # 'a cork' is a part, made of cork
            found.append((slot_name(words[-1], template), parse_part_words([*before, *words])))
            before = []
            continue
        if not names:
            before += [*words, "and"]  # 'red and white stripes'
            continue
        at = names[-1]  # the last, except in 'a handle in red'
        said = parse_part_words([*before, *words[:at], *words[at + 1 :]])
        found.append((slot_name(words[at], template), said if said != LookDescription() or not found else found[-1][1]))
        before = []
    if before and found and mark == ",":  # 'with a straw, pink': refers to the whole
        found.append(("", parse_look_description(before[:-1])))
    elif before:
        raise UsageError(f"no part is named that is {' '.join(before[:-1])}")
    if elsewhere and found:
        part, said = found[-1]
        found[-1] = (part, LookDescription(said.wish, said.relative, (*said.unused, *elsewhere)))
    return found


def assign_two_colors(words: list[str], template: Template) -> tuple[list[tuple[str, LookDescription]], list[str]]:
    """Return which part has which of two stated colours, and the remaining words.

    A black and white soccer ball has parts that usually have these colours; for other objects the words are unchanged.
    """
    usual = {slot: {look_of(each).rgb for each in choices if each} for slot, choices in template.slots.items()}
    for at in range(1, len(words) - 1):
        one, other = color_of(words[at - 1]), color_of(words[at + 1])
        if words[at] != "and" or one is None or other is None:
            continue
        for first, second in permutations(usual, 2):
            if one in usual[first] and other in usual[second]:
                parts = [(first, LookDescription(LookRequest(one))), (second, LookDescription(LookRequest(other)))]
                return parts, [*words[: at - 1], *words[at + 2 :]]
    return [], words


def _joined_names(words: list[str], template: Template) -> list[str]:
    """Return words with the two words of a slot name joined: the rear lamps are not the lamps."""
    joined = list[str]()
    for word in words:
        if joined and (pair := f"{joined[-1]} {word}") in template.slots:
            joined[-1] = pair
        else:
            joined.append(word)
    return joined


def parse_part_words(words: list[str]) -> LookDescription:
    """Return the meaning of words on a part, whose relative size a template cannot express."""
    said = parse_look_description([word for word in words if word not in RELATIVE])
    return LookDescription(said.wish, None, (*said.unused, *(word for word in words if word in RELATIVE)))
