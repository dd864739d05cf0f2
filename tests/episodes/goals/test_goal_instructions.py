"""Instructions of goals are grammatical of one thing and of a pair, and say what is done."""

from __future__ import annotations

import re

import pytest

from manitwin.episodes.goals.goal import SIGNATURES, Goal, Literal
from manitwin.episodes.goals.goal_instructions import FIXTURES, TEMPLATES, goal_instructions, is_fixture_unambiguous
from manitwin.episodes.tasks.task_instructions import task_instructions
from manitwin.twin.record import Language

OF_ONE = {"upright", "lifted", "pressed", "handed_over"}


def said(predicate: str, category: str) -> list[str]:
    told = {"color": "red", "material": "steel", "size": "12 x 9 x 8 cm", "shape": "long", "function": "work"}
    thing = Language(category=category, **told, caption=f"A {category}.", captions=[])
    bowl = Language(category="bowl", **told, caption="A bowl.", captions=[])
    literal = Literal(predicate, "object_00", None if predicate in OF_ONE else "object_01")
    words = {"object_00": thing, "object_01": bowl}
    return [
        each
        for held_out in (False, True)
        for each in goal_instructions(literal, words, seed=0, count=60, held_out=held_out)
    ]


@pytest.mark.parametrize("predicate", TEMPLATES)
def test_verbs_go_with_one_thing_and_with_a_pair(predicate: str) -> None:
    for each in said(predicate, "scissors"):
        assert not re.search(
            r"\b(?:them|they|scissors(?: for work)?) (?:is|has|points)\b|\bthem (?:are|point)\b", each
        ), each
    for each in said(predicate, "mug"):
        assert not re.search(r"\b(?:they|them|their|are|have)\b", each), each


def test_a_stir_is_not_said_to_go_around_once() -> None:
    assert not [each for each in said("stirred", "mug") if "once" in each]


def test_an_end_that_may_be_no_tip_is_not_called_one() -> None:
    """Of a capped marker the closed end of its body goes into the holder."""
    assert not [each for each in said("inserted", "marker") if "tip" in each]


def test_what_may_lie_on_something_is_not_said_to_stand_there() -> None:
    """A hammer goes onto a brick, and a bottle onto a loaf, as they lie there best."""
    assert not [each for each in said("on", "hammer") if "stand" in each]


def test_what_may_be_upside_down_is_not_said_to_have_fallen_over() -> None:
    assert not [each for each in said("upright", "mug") if "fall" in each]


def test_a_statement_is_not_joined_to_another_instruction() -> None:
    """ "Press the mug, and after that the lid is too close to the bowl: move it away" is no sentence."""
    told = {"color": "red", "material": "steel", "size": "12 x 9 x 8 cm", "shape": "long", "function": "work"}
    words = {
        name: Language(category=category, **told, caption=f"A {category}.", captions=[])
        for name, category in {"object_00": "mug", "object_01": "bowl", "object_02": "lid"}.items()
    }
    literals = (Literal("away_from", "object_02", "object_01"), Literal("near", "object_00", "object_01"))
    one = [t for seed in range(20) for t in task_instructions(Goal(literals[:1]), words, seed=seed)[0]]
    assert any("is too close" in each for each in one)
    for seed in range(20):
        spoken, held_out = task_instructions(Goal(literals), words, seed=seed)
        assert len(spoken) >= 3 and held_out
        for each in (*spoken, *held_out):
            assert not re.search(r"(?:^first|, then|, and then|, and after that|^) ?the ", each), each


@pytest.mark.parametrize(
    ("predicate", "other"),
    [("wiped", "cutting board"), ("inserted", "pen holder"), ("hung", "coat hook"), ("struck", "block of wood")],
)
def test_a_fixture_that_an_object_may_be_called_is_not_told_from_it(predicate: str, other: str) -> None:
    assert not is_fixture_unambiguous(predicate, ["mug", other])
    assert is_fixture_unambiguous(predicate, ["mug", "marker", "circuit board"])
    assert is_fixture_unambiguous("lifted", ["mug", other])


def test_what_the_templates_call_fixtures_is_what_is_looked_for() -> None:
    of_fixtures = {name for name, signature in SIGNATURES.items() if signature.second in ("fixture", "place")}
    assert (of_fixtures | {"struck"}) == set(FIXTURES)
    for predicate, nouns in FIXTURES.items():
        for template in TEMPLATES[predicate]:
            said = {noun for noun in nouns if re.search(rf"\b{noun}(?:ed)?\b", template)}
            assert said or template == "hang up {a}", template
