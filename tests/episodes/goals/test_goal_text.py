"""Goals as text: what is written is read again, and what is no goal is refused in one line."""

from __future__ import annotations

import pytest

from manitwin.episodes.goals.goal import Goal, Literal
from manitwin.episodes.goals.goal_text import parse_goal
from manitwin.errors import UsageError

GOALS = (
    Goal((Literal("in", "object_00", "object_01"), Literal("near", "object_02", "object_01", 0.15))),
    Goal((Literal("pressed", "object_00", None, 7.5),), (Literal("upright", "object_00"), Literal("undisturbed", "a"))),
    Goal((Literal("hung", "object_00", "peg"), Literal("left_of", "object_01", "object_02"))),
)


@pytest.mark.parametrize("goal", GOALS, ids=str)
def test_a_goal_is_read_as_it_was_written(goal: Goal) -> None:
    assert parse_goal(str(goal)) == goal
    assert Goal.from_json(goal.to_json()) == goal


@pytest.mark.parametrize(
    ("text", "cause"),
    [
        ("in(a b)", "needs a second argument"),
        ("in(a, b", "is not a literal"),
        ("", "is not a literal"),
        ("inn(a, b)", "did you mean 'in'"),
        ("in(a, b) or on(a, b)", "is not a literal"),
        ("in(a, b, 3)", "is not a literal"),
        ("near(a, b, -1)", "is not a literal"),
        ("in(a, b) and in(a, b)", "repeats a literal"),
        ("in(a,, b)", "is not a literal"),
    ],
)
def test_what_is_no_goal_is_refused_in_one_line(text: str, cause: str) -> None:
    with pytest.raises(UsageError, match=cause) as refused:
        parse_goal(text)
    assert "\n" not in str(refused.value)
