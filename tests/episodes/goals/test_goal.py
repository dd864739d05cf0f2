"""The goal language: what can be written, what is refused, and that it is read as it was written."""

from __future__ import annotations

import json
from typing import Any

import pytest

from manitwin.episodes.goals.goal import SIGNATURES, Goal, Literal
from manitwin.errors import UsageError


def test_a_literal_reads_as_a_formula_and_takes_its_default_value() -> None:
    assert str(Literal("in", "object_00", "object_01")) == "in(object_00, object_01)"
    assert str(Literal("near", "object_00", "object_01")) == "near(object_00, object_01, 0.1)"
    assert str(Literal("pressed", "object_00", value=7)) == "pressed(object_00, 7)"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("inn", "a", "b"), "'in'"),
        (("in", "a"), "needs a second argument, a object"),
        (("upright", "a", "b"), "takes one argument"),
        (("on", "a", "a"), "two different objects"),
        (("on", "a", "b", 0.1), "takes no value"),
        (("near", "a", "b", -1.0), "give one from 0"),
        (("near", "a", "b", float("nan")), "give one from 0"),
    ],
)
def test_what_no_goal_can_say_is_refused(arguments: tuple[Any, ...], message: str) -> None:
    with pytest.raises(UsageError, match=message):
        Literal(*arguments)


def test_every_goal_is_read_as_it_was_written() -> None:
    for name, signature in SIGNATURES.items():
        literal = Literal(name, "object_00", "object_01" if signature.second else None)
        goal = Goal((literal,), (Literal("undisturbed", "object_02"),))
        assert Goal.from_json(json.loads(json.dumps(goal.to_json()))) == goal


@pytest.mark.parametrize(
    "said",
    [
        {}, [], None, "in(a, b)", {"literals": []}, {"literals": [{"predicate": "in"}]}, {"literals": 3},
        {"literals": [{"predicate": "upright", "subject": "a"}], "stay": []},
        {"literals": [{"predicate": "upright", "subject": "a", "obj": "b"}]},
        {"literals": [{"predicate": "near", "subject": "a", "second": "b", "value": "far"}]},
        {"literals": [{"predicate": "near", "subject": "a", "second": "b", "value": True}]},
        {"literals": [{"predicate": ["in"], "subject": "a", "second": "b"}]},
        {"literals": [{"predicate": "upright", "subject": "a"}] * 2},
    ],
)  # fmt: skip
def test_what_is_no_goal_is_one_line(said: Any) -> None:
    with pytest.raises(UsageError) as error:
        Goal.from_json(said)
    assert "\n" not in str(error.value)
