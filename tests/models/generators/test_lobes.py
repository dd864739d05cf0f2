"""Outlines of several round things that touch, of one with a stem or a crown, and of what has another form."""

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.generators.lift.photo_generation import generate_from_photo
from manitwin.models.generators.lift.touching_round_objects import count_bulges, reject_several_round


def _discs(*discs: tuple[int, int, int]) -> np.ndarray:
    """Return a mask (400, 500) of discs, each by its centre and radius."""
    mask = np.zeros((400, 500), np.uint8)
    for x, y, radius in discs:
        cv2.circle(mask, (x, y), radius, 1, -1)
    return mask > 0


def _ellipse(long: int, short: int) -> np.ndarray:
    return cv2.ellipse(np.zeros((400, 500), np.uint8), (250, 200), (long, short), 20, 0, 360, 1, -1) > 0


@pytest.mark.parametrize(
    ("mask", "count"),
    [
        (_discs((250, 200, 150)), 1),
        (_ellipse(200, 60), 1),
        (_discs((250, 250, 120)) | (np.indices((400, 500))[0] < 135) & (abs(np.indices((400, 500))[1] - 250) < 9), 1),
        (_discs((250, 260, 120), (250, 110, 70)), 1),
        (_discs((150, 200, 100), (330, 200, 100)), 2),
        (_discs((150, 200, 100), (320, 210, 80)), 2),
        (_discs((130, 230, 80), (270, 200, 80), (400, 240, 80)), 3),
    ],
    ids=["one", "long", "stem", "crown", "two", "a smaller one", "three"],
)
def test_bellies_are_counted_and_stems_and_crowns_are_none(mask: np.ndarray, count: int) -> None:
    assert count_bulges(mask) == count


def test_two_tomatoes_that_touch_are_no_tomato() -> None:
    two = _discs((150, 200, 100), (330, 200, 100))
    rgba = np.dstack([np.full((400, 500, 3), (200, 40, 30)), np.where(two, 255, 0)]).astype(np.uint8)
    with pytest.raises(Rejected, match="crop the photo to one") as caught:
        generate_from_photo(rgba, "beef tomato")
    assert caught.value.reason == "several_objects" and caught.value.stage == "generate"


@pytest.mark.parametrize("name", ["tennis balls", "pool ball"])
def test_two_balls_that_touch_are_no_ball(name: str) -> None:
    with pytest.raises(Rejected, match=r"its outline has 2 bellies .* has not; crop the photo to one of them$"):
        reject_several_round(_discs((150, 200, 100), (330, 200, 100)), name)


def test_of_a_name_that_is_only_likely_most_has_to_be_round() -> None:
    two, one = _discs((150, 200, 100), (330, 200, 100)), _discs((250, 200, 150))
    with pytest.raises(Rejected, match=r"one round thing has not; .* say what it is with --name") as caught:
        reject_several_round(two, None, [("lemon", 0.4), ("apple", 0.2), ("dumbbell", 0.1)])
    assert caught.value.reason == "several_objects"
    reject_several_round(two, None, [("lemon", 0.3), ("dumbbell", 0.6)])
    reject_several_round(one, None, [("lemon", 0.4), ("apple", 0.2)])
    reject_several_round(two, "dumbbell", [("lemon", 0.9)])


@pytest.mark.parametrize("name", [None, "dumbbell", "bunch of grapes", "cherries", "ginger"])
def test_what_is_not_said_to_be_one_round_thing_may_have_any_outline(name: str | None) -> None:
    reject_several_round(_discs((150, 200, 100), (330, 200, 100)), name)
