"""Outlines of several things of one name that touch, of one, and names in the plural."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.generators.lift.heaps import FAR_OUTLINE, GROWN, is_plural, reject_heap
from manitwin.models.generators.lift.made_photo import from_photo
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.evidence import evidence_of
from manitwin.models.generators.templates.fitting.fit import Fitted, fitted, made_of
from manitwin.models.generators.templates.fitting.least_squares import Placed
from manitwin.models.generators.templates.fitting.residual import Residual
from manitwin.models.generators.templates.fitting.view import View


def _ellipses(*ellipses: tuple[tuple[int, int], tuple[int, int], int]) -> np.ndarray:
    """Return a cut-out (480, 640, 4) of ellipses, each by its centre, half axes and turn in degrees."""
    rgba = np.zeros((480, 640, 4), np.uint8)
    for center, half, turn in ellipses:
        cv2.ellipse(rgba, center, half, turn, 0, 360, (180, 130, 60, 255), -1)
    return rgba


PILE = _ellipses(((220, 300), (105, 80), 0), ((400, 305), (100, 75), 10), ((310, 185), (95, 80), -20))
"""Widest in the middle: no waist tells that it is three."""


def _far(category: str, outline: float) -> Fitted:
    template = load_templates()[category]
    made = made_of(template, template.typical())
    left = Residual(iou=0.8, outline=outline, edges=0.5, shading=0.5, hidden=0.0, edge_px=10)
    return fitted(made, Placed(View(0.0, 0.3, 0.0, 0.2), True), left, evidence_of(PILE))


@pytest.mark.parametrize(
    "name", [pytest.param("onion", marks=pytest.mark.slow), pytest.param("potato", marks=pytest.mark.slow), "potatoes"]
)
def test_a_pile_is_no_onion_and_no_potato(name: str) -> None:
    with pytest.raises(Rejected, match="but several objects that touch or hide one another may have it") as caught:
        from_photo(PILE, name)
    assert caught.value.reason == "several_objects" and caught.value.stage == "generate"


def test_one_potato_of_its_own_shape_is_made() -> None:
    one = _ellipses(((300, 240), (170, 110), 15), ((380, 250), (120, 95), 40))
    assert from_photo(one, "potato").notes["primitive"] == "template:potato"


def test_names_in_the_plural_and_what_grows_are_held_to_the_outline_of_one() -> None:
    for name, category in (("mug", "mug"), ("scissors", "scissors")):
        reject_heap(_far(category, 2 * FAR_OUTLINE), name, category)
    reject_heap(_far("carrot", 0.9 * FAR_OUTLINE), "carrots", "carrot")
    with pytest.raises(Rejected, match=r"no mug has this outline .*; if 'red mugs' is one, name it in the singular"):
        reject_heap(_far("mug", 2 * FAR_OUTLINE), "red mugs", "mug")
    with pytest.raises(Rejected, match=r"no carrot has this outline .*; crop the photo to one of them"):
        reject_heap(_far("carrot", 2 * FAR_OUTLINE), "carrot", "carrot")


def test_what_grows_has_templates() -> None:
    assert set(load_templates()) >= GROWN


@pytest.mark.parametrize(
    ("name", "plural"),
    [
        ("carrots", True),
        ("red beets", True),
        ("kitchen knives", True),
        ("tomatoes", True),
        ("batteries", True),
        ("carrot", False),
        ("scissors", False),
        ("headphones", False),
        ("box of matches", False),
        ("bus", False),
        ("flumps", False),
    ],
)
def test_plurals_are_told_from_names_that_end_so(name: str, plural: bool) -> None:
    assert is_plural(name) is plural
