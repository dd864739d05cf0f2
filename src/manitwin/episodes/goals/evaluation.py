"""Goal evaluator, used for planner checks, recorded episodes, and policies in the environment."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from manitwin.episodes.goals import functional, spatial, tool_use
from manitwin.episodes.goals.goal import SIGNATURES, Goal, Literal
from manitwin.episodes.goals.spatial import Judgement
from manitwin.episodes.goals.world_state import WorldState

JUDGES: Mapping[str, Callable[[WorldState, Literal], Judgement]] = {
    "on": spatial.on,
    "in": spatial.inside,
    **dict.fromkeys(spatial.SIDES, spatial.beside),
    "near": spatial.near,
    "away_from": spatial.away_from,
    "upright": spatial.upright,
    "lifted": spatial.lifted,
    "touching": spatial.touching,
    "undisturbed": spatial.undisturbed,
    "pushed_to": spatial.pushed_to,
    "hung": functional.hung,
    "inserted": functional.inserted,
    "poured": functional.poured,
    "pressed": functional.pressed,
    "struck": functional.struck,
    "stirred": tool_use.stirred,
    "wiped": tool_use.wiped,
    "cut_motion": tool_use.cut_motion,
    "aimed": tool_use.aimed,
    "handed_over": functional.handed_over,
}
assert JUDGES.keys() == SIGNATURES.keys(), "every predicate has a judge"


@dataclass(frozen=True)
class Evaluation:
    """Evaluation of a goal on a state: the judgement of each literal in ``literals`` and in ``stays``."""

    goal: Goal
    literals: tuple[Judgement, ...]
    stays: tuple[Judgement, ...]

    @property
    def reached(self) -> bool:
        """True if every literal holds."""
        return all(each.holds for each in (*self.literals, *self.stays))

    @property
    def true_already(self) -> tuple[Literal, ...]:
        """Literals of ``goal.literals`` that hold; at the start there should be none."""
        return tuple(literal for literal, judged in zip(self.goal.literals, self.literals, strict=True) if judged.holds)

    @property
    def failure(self) -> str | None:
        """The first literal that does not hold, and why: ``in(object_00, object_01): on_the_rim``."""
        for literal, judgement in zip(
            (*self.goal.literals, *self.goal.stays), (*self.literals, *self.stays), strict=True
        ):
            if not judgement.holds:
                return f"{literal}: {judgement.failure}"
        return None

    def to_json(self) -> list[dict[str, Any]]:
        """Return every literal with its judgement as plain values."""
        return [
            {
                "literal": str(literal),
                "holds": judged.holds,
                "failure": judged.failure,
                "measured": dict(judged.measured),
            }
            for literal, judged in zip(
                (*self.goal.literals, *self.goal.stays), (*self.literals, *self.stays), strict=True
            )
        ]


def judge(state: WorldState, literal: Literal) -> Judgement:
    """Judge one literal; raises UsageError for objects, places or fixtures that the state does not contain."""
    return JUDGES[literal.predicate](state, literal)


def evaluate(state: WorldState, goal: Goal) -> Evaluation:
    """Judge every literal of a goal on a state; raises UsageError for objects that the state does not contain."""
    return Evaluation(
        goal,
        tuple(judge(state, each) for each in goal.literals),
        tuple(judge(state, each) for each in goal.stays),
    )
