"""Outlines of several things of one name that touch, of one, and names in the plural."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.generators.lift.photo_generation import generate_from_photo
from manitwin.models.generators.lift.several_objects import (
    MOST_OUTLINE_DISTANCE,
    PRODUCE,
    is_plural,
    reject_several_objects,
)
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.evidence import extract_evidence
from manitwin.models.generators.templates.fitting.fit import TemplateFit, assemble_fit, build_fitted_object
from manitwin.models.generators.templates.fitting.least_squares import PlacedView
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


def _far(category: str, outline: float) -> TemplateFit:
    template = load_templates()[category]
    made = build_fitted_object(template, template.typical_measures())
    left = Residual(iou=0.8, outline=outline, edges=0.5, shading=0.5, hidden=0.0, edge_px=10)
    return assemble_fit(made, PlacedView(View(0.0, 0.3, 0.0, 0.2), True), left, extract_evidence(PILE))


@pytest.mark.parametrize(
    "name", [pytest.param("onion", marks=pytest.mark.slow), pytest.param("potato", marks=pytest.mark.slow), "potatoes"]
)
def test_a_pile_is_no_onion_and_no_potato(name: str) -> None:
    with pytest.raises(Rejected, match="but several objects that touch or hide one another may have it") as caught:
        generate_from_photo(PILE, name)
    assert caught.value.reason == "several_objects" and caught.value.stage == "generate"


def test_one_potato_of_its_own_shape_is_made() -> None:
    one = _ellipses(((300, 240), (170, 110), 15), ((380, 250), (120, 95), 40))
    assert generate_from_photo(one, "potato").notes["primitive"] == "template:potato"


def test_names_in_the_plural_and_what_grows_are_held_to_the_outline_of_one() -> None:
    for name, category in (("mug", "mug"), ("scissors", "scissors")):
        reject_several_objects(_far(category, 2 * MOST_OUTLINE_DISTANCE), name, category)
    reject_several_objects(_far("carrot", 0.9 * MOST_OUTLINE_DISTANCE), "carrots", "carrot")
    with pytest.raises(Rejected, match=r"no mug has this outline .*; if 'red mugs' is one, name it in the singular"):
        reject_several_objects(_far("mug", 2 * MOST_OUTLINE_DISTANCE), "red mugs", "mug")
    with pytest.raises(Rejected, match=r"no carrot has this outline .*; crop the photo to one of them"):
        reject_several_objects(_far("carrot", 2 * MOST_OUTLINE_DISTANCE), "carrot", "carrot")


def test_what_grows_has_templates() -> None:
    assert set(load_templates()) >= PRODUCE


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
