"""Every answer is derived a second time by code of its own from the files, and by MuJoCo."""

from __future__ import annotations

import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from manitwin.scenes.scene_files import scene_files
from manitwin.scenes.vqa.part_words import ALL_ROUND
from manitwin.scenes.vqa.question import YES_NO, Question
from manitwin.scenes.vqa.references import region
from manitwin.scenes.vqa.templates import FAMILIES
from manitwin.scenes.vqa.write import generate_questions
from scene_answers import rederived
from second_scene import SecondScene, SecondView


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


def test_a_place_near_the_border_of_two_regions_is_in_neither() -> None:
    assert [region(0.5, y) for y in (0.3, 0.31, 0.36, 0.37)] == ["top center", None, None, "center"]
    assert region(0.68, 0.5) is None and region(0.9, 0.1) == "top right"


def test_a_thing_is_said_to_be_where_its_middle_is_too(
    questions: list[Question], views: dict[tuple[str, str], SecondView]
) -> None:
    asked = [each for each in questions if each.family == "locate_and_grasp"]
    assert asked
    for each in asked:
        view = views[each.scene_id, each.camera]
        rows, columns = np.nonzero(view.mask(next(iter(each.evidence["objects"]))))
        middle = (columns.min() + columns.max() + 1) / 2 / view.width, (rows.min() + rows.max() + 1) / 2 / view.height
        assert region(*middle) == each.answer.split(";")[0]


def test_points_are_asked_about_where_their_words_mean_one_place(questions: list[Question]) -> None:
    labels = {each.evidence["label"] for each in questions if each.family == "interaction_point_occluded"}
    assert not labels & ALL_ROUND


def test_heights_are_not_compared_from_right_above(
    questions: list[Question], views: dict[tuple[str, str], SecondView]
) -> None:
    asked = {(each.scene_id, each.camera) for each in questions if each.family == "taller"}
    assert asked and all(abs(views[place].to_world[2, 2]) <= np.sin(np.radians(60)) for place in asked)


def test_held_out_wordings_are_asked_in_val_only(scenes: Path) -> None:
    asked, _ = generate_questions(scene_files(scenes)[:1], per_scene=40, validation_share=1.0)
    assert {each.split for each in asked} == {"val"}
    assert all(each.held_out and each.template == len(FAMILIES[each.family].paraphrases) - 1 for each in asked)


def test_training_never_has_the_held_out_wording(questions: list[Question]) -> None:
    assert all(not each.held_out and each.template < 3 for each in questions)
