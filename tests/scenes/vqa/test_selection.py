"""Which drafts are asked."""

from __future__ import annotations

import random

import numpy as np
import pytest

from manitwin.scenes.vqa.question import BOX, CHOICE, POINT, Draft
from manitwin.scenes.vqa.scene_understanding import are_sides_unambiguous
from manitwin.scenes.vqa.selection import _balanced_choices, chosen
from manitwin.scenes.vqa.sweeps import ObstacleContact, SweptPath


def drafts(family: str, kind: str, count: int) -> list[Draft]:
    return [Draft(family, "front", kind, {}, f"{number}", "", {"objects": {}}) for number in range(count)]


def test_a_family_of_which_a_scene_has_few_questions_is_asked_beside_the_common_ones() -> None:
    common = [
        *drafts("point_at_object", POINT, 30),
        *drafts("box_of_object", BOX, 30),
        *drafts("touch_point", POINT, 30),
    ]
    rare = drafts("locate_and_grasp", POINT, 1)
    asked = chosen([[*common, *rare]], 9, random.Random(1))[0]
    assert [each.family for each in asked].count("locate_and_grasp") == 1


def test_a_slide_that_misses_or_hits_by_less_than_the_eye_sees_is_not_asked() -> None:
    def way(near_m: float, touch_m: float) -> SweptPath:
        return SweptPath({"can": ObstacleContact(near_m, touch_m)}, 1.0)

    assert way(0.101, np.inf).is_hit_within(0.1) is False and way(0.099, np.inf).is_hit_within(0.1) is None
    assert way(0.05, 0.079).is_hit_within(0.1) is True and way(0.05, 0.085).is_hit_within(0.1) is None
    two = {"can": ObstacleContact(0.02, 0.04), "box": ObstacleContact(0.03, 0.055)}
    assert (
        not SweptPath(two, 1.0).is_order_certain()
        and SweptPath({**two, "box": ObstacleContact(0.04, 0.061)}, 1.0).is_order_certain()
    )


@pytest.mark.parametrize(
    ("one", "other", "apart"), [((0, 2), (3, 5), True), ((0, 4), (3, 6), True), ((0, 6), (2, 3), False)]
)
def test_a_side_is_in_doubt_where_one_thing_reaches_over_the_middle_of_the_other(
    one: tuple[float, float], other: tuple[float, float], apart: bool
) -> None:
    assert are_sides_unambiguous(one, other) is apart and are_sides_unambiguous(other, one) is apart


def test_choices_that_words_still_tell_are_balanced_again() -> None:
    rng = random.Random(8)
    found = []
    for scene in range(1500):
        options = tuple(rng.sample(["the box", "the can", "the pin", "the key"], 3))
        # bulky things are right sixteen times as often as small ones: one round of keeping cannot make that even
        weights = [16 if option in ("the box", "the can") else 1 for option in options]
        found.append(
            (scene, Draft("slide_hits", "front", CHOICE, {}, rng.choices(options, weights)[0], "", {}, options))
        )
    kept = _balanced_choices(found, rng)
    for option in ("the box", "the pin"):
        offered = [draft for _, draft in kept if option in draft.options]
        assert sum(draft.answer == option for draft in offered) / len(offered) == pytest.approx(1 / 3, abs=0.1)
    assert len(kept) > 150


def test_places_among_which_one_is_right_are_not_thinned_for_their_numbers() -> None:
    options = ("<p0>", "<p1>", "<p2>", "<p3>")
    found = [
        (scene, Draft("object_for_function", "front", CHOICE, {"use": "cut"}, "<p3>", "", {}, options))
        for scene in range(600)
    ]
    assert len(_balanced_choices(found, random.Random(2))) > 350  # 0.7 of them, as of any family
