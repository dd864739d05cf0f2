"""Wordings by a model: what is kept keeps its slots and its meaning, and the answers stay."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from manitwin.errors import ConfigError
from manitwin.models.fakes.openai_chat import FakeOpenAi
from manitwin.models.fakes.server import FakeServer
from manitwin.scenes.vqa.rephrasing import fill_slots, rejection_reason
from manitwin.scenes.vqa.templates import FAMILIES
from manitwin.scenes.vqa.write import QUESTIONS, REPHRASINGS, write_vqa

GAP = "{size}Roughly how many centimetres lie between {a} and {b}?"
OTHER = "{size}By how many centimetres is the space between {a} and {b} wider than the table?"


@pytest.mark.parametrize(
    ("family", "text", "reason"),
    [
        ("gap", GAP, None),
        ("gap", "{size}Roughly how many centimetres lie between {a} and the other?", "slot_lost"),
        ("gap", "{size}How many centimetres lie between {a}, {a} and {b}?", "slot_lost"),
        ("gap", "{size}How many centimetres lie between {a.__class__} and {b}?", "slot_lost"),
        ("gap", "{size}Within 5 centimetres, how far is {a} from {b}?", "number_of_its_own"),
        ("gap", "{size}How many inches lie between {a} and {b}?", "meaning_changed"),
        ("gap", "{size}how wide is the gap between {a} and {b} in centimetres?", "same_words"),
        ("gap", "{size}In centimetres, what distance separates {a} from {b}?", "held_out"),
        ("gap", "{size}How far is\n{a} from {b} in centimetres?", "no_question"),
        ("gap", "{size}{a} and {b}, centimetres", "no_question"),
        ("side_in_picture", "In the picture, does {a} sit to the left of {b}?", "meaning_changed"),
        ("slide", "{robot}{A} is slid {cm} cm {d}: will it bump into some object?", None),
        ("slide", "If {a} is slid {cm} cm {d}, is there a collision? {robot}.", "frame_not_first"),
        ("slide", "{robot}If {a} is not slid {cm} cm {d}, is there a collision?", "meaning_changed"),
        ("part_visible", "Can the {part} of {a} not be seen in this picture?", "meaning_changed"),
    ],
)
def test_a_wording_is_kept_only_with_its_slots_and_its_meaning(family: str, text: str, reason: str | None) -> None:
    assert rejection_reason(family, text) == reason


def test_no_wording_of_the_own_ones_would_be_refused_but_as_known() -> None:
    for name, family in FAMILIES.items():
        assert [rejection_reason(name, text) for text in family.paraphrases[:-1]] == ["same_words"] * 3, name


def test_slots_are_filled_with_a_capital_where_a_sentence_begins() -> None:
    slots = {"robot": "The robot looks along +x. ", "a": "the red mug", "A": "The red mug", "cm": "5", "d": "forward"}
    assert fill_slots("{robot}{a} is slid {cm} cm {d}. {a}?", slots) == (
        "The robot looks along +x. The red mug is slid 5 cm forward. The red mug?"
    )


def test_a_model_words_the_questions_of_train_and_what_asks_something_else_is_dropped(
    scenes: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def answer(name: str, schema: dict, text: str, pictures: list[bytes]) -> dict[str, Any]:
        if name == "vqa_wordings":
            return {"wordings": [GAP, OTHER, "Which?"] if "gap between" in text else ["What is this?"]}
        assert name == "vqa_same" and "1. " + GAP in text and "2. " in text
        return {"same": [1, 7]}

    monkeypatch.setenv("MANITWIN_VLM_KEY", "rehearsal-key")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    with FakeServer(FakeOpenAi(answer=answer)) as server:
        done = write_vqa(scenes, tmp_path / "out", vlm=f"openai:any@{server.url}/v1", validation_share=0.0)
    told = json.loads((tmp_path / "out" / REPHRASINGS).read_text())
    assert told["model"] == "any" and told["families"]["gap"]["kept"] == [GAP]
    assert [each["reason"] for each in told["families"]["gap"]["dropped"]] == ["asks_something_else", "no_question"]
    asked = [json.loads(line) for line in (tmp_path / "out" / QUESTIONS).read_text().splitlines()]
    worded = [each for each in asked if each["rephrased"]]
    assert len(worded) == done.rephrased > 0
    for each in worded:
        assert (
            each["family"] == "gap"
            and " cm between its two farthest points. Roughly how many centimetres lie " in each["question"]
        )
        assert "{" not in each["question"] and each["template"] == 4 and not each["held_out"]
    write_vqa(scenes, tmp_path / "plain", validation_share=0.0)
    plain = [json.loads(line) for line in (tmp_path / "plain" / QUESTIONS).read_text().splitlines()]
    assert sorted((each["family"], each["answer"]) for each in asked) == sorted(
        (each["family"], each["answer"]) for each in plain
    )
    assert not (tmp_path / "plain" / REPHRASINGS).exists()


def test_an_unknown_model_is_an_error_before_anything_is_written(scenes: Path, tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="cannot word questions; give openai:MODEL@URL"):
        write_vqa(scenes, tmp_path / "out", vlm="rules")
    assert not (tmp_path / "out").exists()
