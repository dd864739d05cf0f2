"""Every answer is derived a second time by code of its own from the files, and by MuJoCo."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import pytest

from manitwin.scenes.scene_files import scene_files
from manitwin.scenes.vqa.question import YES_NO, Question
from manitwin.scenes.vqa.templates import FAMILIES
from manitwin.scenes.vqa.write import ask_scenes
from scene_answers import SecondScene, SecondView, rederived


@pytest.fixture(scope="module")
def views(scenes: Path) -> dict[tuple[str, str], SecondView]:
    """The second reader's views by scene and camera."""
    found = {}
    for file in scene_files(scenes):
        scene = SecondScene(file.parent, scenes.parent / "set")
        found |= {(file.parent.name, camera): SecondView(scene, camera) for camera in scene.facts["cameras"]}
    return found


def agrees(question: Question, views: dict[tuple[str, str], SecondView]) -> bool:
    return bool(rederived(json.loads(json.dumps(question.to_json())), views[question.scene_id, question.camera]))


def test_every_answer_is_derived_again(questions: list[Question], views: dict[tuple[str, str], SecondView]) -> None:
    assert len(questions) > 60
    assert [each.question for each in questions if not agrees(each, views)] == []


def test_a_wrong_answer_is_not_derived_again(
    questions: list[Question], views: dict[tuple[str, str], SecondView]
) -> None:
    turned = {"yes": "no", "no": "yes", "left": "right", "right": "left", "<p0>": "<p1>", "<p1>": "<p0>"}
    asked = [each for each in questions if each.answer in each.options and each.answer in turned]
    assert len({each.family for each in asked}) >= 5
    some = [next(each for each in asked if each.family == family) for family in sorted({each.family for each in asked})]
    assert not any(agrees(replace(each, answer=turned[each.answer]), views) for each in some)


def test_all_categories_and_their_wording(questions: list[Question]) -> None:
    counts = Counter(each.category for each in questions)
    assert set(counts) == {family.category for family in FAMILIES.values()}
    for each in questions:
        assert "{" not in each.question
        assert each.category == FAMILIES[each.family].category
        assert each.evidence["objects"]
        assert "right" not in each.question or any(
            frame in each.question for frame in ("robot", "picture", "camera", "bottom right")
        )


def test_no_answer_of_a_yes_no_family_is_common(questions: list[Question]) -> None:
    families = {each.family for each in questions if each.kind == YES_NO}
    assert families
    for family in families:
        answers = Counter(each.answer for each in questions if each.family == family)
        assert max(answers.values()) <= 0.55 * answers.total()


def test_held_out_wordings_are_asked_in_val_only(scenes: Path) -> None:
    asked, _ = ask_scenes(scene_files(scenes)[:1], per_scene=40, validation_share=1.0)
    assert {each.split for each in asked} == {"val"}
    assert all(each.held_out and each.template == len(FAMILIES[each.family].paraphrases) - 1 for each in asked)


def test_training_never_has_the_held_out_wording(questions: list[Question]) -> None:
    assert all(not each.held_out and each.template < 3 for each in questions)
