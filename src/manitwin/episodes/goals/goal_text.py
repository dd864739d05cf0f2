"""Text form of goals, as in attempts and tasks: ``in(a, c) and near(b, c, 0.1), with undisturbed(d)``."""

from __future__ import annotations

import re
from typing import NoReturn

from manitwin.episodes.goals.goal import SIGNATURES, Goal, Literal
from manitwin.errors import UsageError
from manitwin.formats.printable import printable_line

STAYS = ", with "
MOST_CHARACTERS = 10_000

_LITERAL = re.compile(r"([a-z_]{1,40})\(([^()]{1,400})\)")
_NUMBER = re.compile(r"\d+(?:\.\d+)?(?:e[+-]?\d+)?")
_EXAMPLE = "give literals such as in(object_00, object_01), joined by and"


def parse_goal(text: str) -> Goal:
    """Parse the ``str`` of a goal; raises UsageError with a one-line message naming the invalid part."""
    if len(text) > MOST_CHARACTERS:
        raise UsageError(f"the goal has {len(text)} characters; give at most {MOST_CHARACTERS}")
    come_true, with_, stay = text.strip().partition(STAYS)
    stays = _literals(stay, text) if with_ else ()
    return Goal(_literals(come_true, text), stays)


def _literals(text: str, whole: str) -> tuple[Literal, ...]:
    return tuple(_literal(part.strip(), whole) for part in text.split(" and "))


def _literal(text: str, whole: str) -> Literal:
    found = _LITERAL.fullmatch(text)
    if found is None:
        _refuse(whole, text)
    predicate, arguments = found[1], [each.strip() for each in found[2].split(",")]
    signature = SIGNATURES.get(predicate)
    if signature is None:
        return Literal(predicate, arguments[0])  # raises with the valid predicates
    value = None
    if signature.unit is not None and len(arguments) > 1 and _NUMBER.fullmatch(arguments[-1]):
        value = float(arguments.pop())
    if not all(arguments) or len(arguments) > 2:
        _refuse(whole, text)
    return Literal(predicate, arguments[0], arguments[1] if len(arguments) > 1 else None, value)


def _refuse(whole: str, part: str) -> NoReturn:
    shown = printable_line(whole, max_characters=80)
    raise UsageError(f"{shown}: {printable_line(part, max_characters=60)!r} is not a literal; {_EXAMPLE}")
