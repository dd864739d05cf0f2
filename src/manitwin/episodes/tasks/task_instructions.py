"""Instructions of tasks: instructions of the literals joined in order; some templates and conjunctions are held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial

from manitwin.episodes.goals.goal import Goal
from manitwin.episodes.goals.goal_instructions import goal_instructions
from manitwin.twin.record import Language

COUNT, HELD_OUT = 6, 2
JOINTS = ("{first}, then {second}", "first {first}, and then {second}", "{first}, and after that {second}")
HELD_OUT_JOINTS = ("{first}; once that is done, {second}",)


def task_instructions(
    goal: Goal, words: Mapping[str, Language], *, seed: int
) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return instructions and held-out instructions, which share no template; raises UsageError without a template."""
    told, held = [], []
    for place, literal in enumerate(goal.literals):
        of = partial(goal_instructions, literal, words, seed=seed + place, joined=len(goal.literals) > 1)
        told.append(of(count=COUNT))
        held.append(of(count=HELD_OUT, held_out=True))
    return _joined(told, JOINTS), _joined(held, HELD_OUT_JOINTS)


def _joined(each: Sequence[Sequence[str]], joints: Sequence[str]) -> tuple[str, ...]:
    """Return as many sentences as the literal with the most instructions has, each joined from left to right."""
    said: dict[str, None] = {}
    for place in range(max(len(part) for part in each)):
        sentence = each[0][place % len(each[0])]
        for part in each[1:]:
            sentence = joints[place % len(joints)].format(first=sentence, second=part[place % len(part)])
        said[sentence] = None
    return tuple(said)
