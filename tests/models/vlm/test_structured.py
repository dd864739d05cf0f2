"""One repair for an answer that cannot be used, one more question for what contradicts it."""

from __future__ import annotations

import json
from collections.abc import Sequence

import pytest
from mug_question import MUG, Mug, Scripted, question

from manitwin.errors import BadReply, Unavailable
from manitwin.models.vlm.structured import ask, json_object_in

GOOD = json.dumps(MUG)
HEAVY = json.dumps(MUG | {"mass_kg": 3.0})


def too_heavy(mug: Mug) -> Sequence[str]:
    return [f"{mug.mass_kg:g} kg is heavier than any mug"] if mug.mass_kg > 1 else []


def test_good_answer_is_asked_for_once() -> None:
    chat = Scripted([GOOD])
    answered = ask(chat, question(), Mug, too_heavy)
    assert (answered.value.mass_kg, answered.findings, len(chat.asked)) == (0.4, (), 1)


@pytest.mark.parametrize(
    ("bad", "names"),
    [
        ("I would say glass.", "no JSON"),
        (json.dumps({"material": "glass"}), "reason"),
        (json.dumps(MUG | {"material": "wood"}), "material"),
        (json.dumps(MUG | {"mass_kg": 50}), "mass_kg"),
        ('{"reason": "x", "material": "glass", "mass_kg": NaN}', "NaN"),
        ("[1, 2]", "not an object"),
    ],
)
def test_unusable_answer_is_repaired_with_its_error(bad: str, names: str) -> None:
    chat = Scripted([bad, GOOD])
    assert ask(chat, question(), Mug).value.material == "glass"
    turns = chat.asked[1][1]
    assert [turn.role for turn in turns] == ["assistant", "user"]
    assert turns[0].text == bad
    assert names in turns[1].text


def test_answer_that_stays_unusable_is_a_bad_reply_that_says_why() -> None:
    chat = Scripted(["no", json.dumps(MUG | {"material": "wood"})])
    with pytest.raises(BadReply, match=r"scripted-1 gave no usable answer to 'mug'.*material"):
        ask(chat, question(), Mug)
    assert len(chat.asked) == 2


def test_contradiction_is_asked_about_once_and_resolved() -> None:
    chat = Scripted([HEAVY, GOOD])
    answered = ask(chat, question(), Mug, too_heavy)
    assert (answered.value.mass_kg, answered.findings) == (0.4, ())
    assert "3 kg is heavier than any mug" in chat.asked[1][1][1].text


def test_contradiction_that_stays_is_returned_with_the_answer() -> None:
    chat = Scripted([HEAVY, HEAVY])
    answered = ask(chat, question(), Mug, too_heavy)
    assert (answered.value.mass_kg, answered.findings) == (3.0, ("3 kg is heavier than any mug",))
    assert len(chat.asked) == 2


def test_repair_and_contradiction_have_a_turn_each() -> None:
    chat = Scripted(["no", HEAVY, GOOD])
    assert ask(chat, question(), Mug, too_heavy).value.mass_kg == 0.4
    assert [len(turns) for _, turns in chat.asked] == [0, 2, 4]


def test_failure_of_the_model_is_passed_on() -> None:
    with pytest.raises(Unavailable, match="gone"):
        ask(Scripted(["no", Unavailable("gone")]), question(), Mug)


@pytest.mark.parametrize(
    "text",
    [
        '{"a": 1}',
        '  {"a": 1}\n',
        '```json\n{"a": 1}\n```',
        '```\n{"a": 1}\n```',
        'Here you are:\n```json\n{"a": 1}\n```\nAnything else?',
        'The answer is {"a": 1}. I am {sure} of it.',
        '<think>maybe {"a": 2}? no</think>{"a": 1}',
        'First {"a": 2}, or rather {"a": 1}',
    ],
)
def test_object_is_found(text: str) -> None:
    assert json_object_in(text) == {"a": 1}


def test_control_characters_inside_texts_are_taken() -> None:
    assert json_object_in('{"a": "two\nlines\tand \x1b[2J \x0b", "b": [{"c": "\x9b"}]}') == {
        "a": "two lines and  [2J  ",
        "b": [{"c": " "}],
    }


def test_braces_inside_texts_end_nothing() -> None:
    assert json_object_in('so: {"a": "}{", "b": {"c": 1}} done') == {"a": "}{", "b": {"c": 1}}


@pytest.mark.parametrize("text", ["", "no", "[1]", "7", '{"a": 1', '{"a": NaN}', '{"a": -Infinity}', '{"a":' * 5000])
def test_what_is_no_object_is_said(text: str) -> None:
    with pytest.raises(ValueError):
        json_object_in(text)
