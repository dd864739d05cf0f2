"""Solids that an outline was lifted to, against what a thing of that name is like: round or not, and of which proportions."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.geometry.solids.shapes import box, cylinder
from manitwin.models.generators.lift.photo_generation import fit_or_lift, generate_from_photo
from manitwin.models.generators.lift.usual_shape import (
    LEAST_TURNED_SHARE,
    proportion_conflict,
    revolution_conflict,
    revolution_share,
)


def outline(points: list[tuple[float, float]]) -> np.ndarray:
    """An RGBA picture of a polygon and of its mirror image about the picture's middle column."""
    rgba = np.zeros((600, 600, 4), np.uint8)
    mask = np.zeros((600, 600), np.uint8)
    whole = points + [(600 - x, y) for x, y in reversed(points)]
    cv2.fillPoly(mask, [np.round(whole).astype(np.int32)], 1)
    rgba[mask > 0] = (120, 120, 130, 255)
    return rgba


TOE = outline([(235, 110), (230, 200), (215, 300), (190, 400), (180, 470), (190, 520)])
"""A high shoe seen from its toe."""
STUB = outline([(270, 120), (270, 480)])
"""A bar six times as long as wide."""


def test_a_square_bar_is_not_round_and_a_hexagonal_one_nearly() -> None:
    assert revolution_share(cylinder(0.02, 0.1)) > 0.95
    assert revolution_share(cylinder(0.02, 0.1) - cylinder(0.018, 0.2)) > 0.95  # a hollow counts as filled
    assert revolution_share(cylinder(0.02, 0.1, sides=6)) > LEAST_TURNED_SHARE
    assert revolution_share(box(0.04, 0.04, 0.1)) < LEAST_TURNED_SHARE - 0.04


@pytest.mark.parametrize(
    "name",
    ["shoe", "sneaker", "hairbrush", "toothpaste", "nail clipper", "headphones", "toy car", "glue gun", "backpack"],
)
def test_what_is_not_round_by_its_template_or_its_prior_is_no_body_of_revolution(name: str) -> None:
    why = revolution_conflict(name)
    assert why is not None and "is not round" in why


@pytest.mark.parametrize(
    "name",
    [
        "mug",
        "cup and saucer",
        "pump bottle",
        "kettle",
        "screwdriver",
        "pencil",
        "basket",
        "potted plant",
        "deodorant",
        "snow globe",
        None,
    ],
)
def test_what_is_round_but_for_its_handle_and_what_nobody_knows_may_be_one(name: str | None) -> None:
    assert revolution_conflict(name) is None


@pytest.mark.parametrize(
    ("name", "extents", "side"),
    [
        ("pencil", (0.06, 0.02, 0.02), "wide"),
        ("yellow pencil", (0.06, 0.02, 0.02), "wide"),
        ("book", (0.2, 0.03, 0.02), "wide"),
        ("laptop", (0.33, 0.23, 0.008), "thick"),
    ],
)
def test_proportions_that_no_such_thing_has_are_told(name: str, extents: tuple[float, ...], side: str) -> None:
    why = proportion_conflict(name, np.array(extents))
    assert why is not None and f"times as long as {side}" in why


@pytest.mark.parametrize(
    ("name", "extents"),
    [
        ("pencil", (0.18, 0.0075, 0.007)),
        ("pencil", (0.0075, 0.18, 0.007)),  # however it lies
        ("box", (0.4, 0.02, 0.01)),  # of any proportions
        ("boot", (0.3, 0.28, 0.1)),  # a kind of shoe, but none that the template makes
        ("figurine", (0.1, 0.01, 0.01)),  # no template
        (None, (0.1, 0.01, 0.01)),
    ],
)
def test_proportions_within_twice_the_usual_and_of_what_is_not_known_are_not(
    name: str | None, extents: tuple[float, ...]
) -> None:
    assert proportion_conflict(name, np.array(extents)) is None


def test_a_shoe_seen_from_its_toe_is_refused_and_a_vase_of_that_outline_made() -> None:
    with pytest.raises(Rejected, match=r"a shoe is not round; take the photo from another side.*several photos"):
        fit_or_lift(None, TOE, "shoe")
    assert fit_or_lift(None, TOE, "vase").notes["primitive"] == "revolution"


def test_a_pencil_seen_nearly_from_its_end_is_refused_and_a_candle_of_that_outline_made() -> None:
    with pytest.raises(Rejected, match=r"a pencil is so .* times"):
        fit_or_lift(None, STUB, "pencil")
    assert fit_or_lift(None, STUB, "candle").notes["primitive"] == "revolution"


def test_what_lies_flat_may_be_thinner_than_the_template_where_little_of_it_is_missing() -> None:
    assert proportion_conflict("spatula", np.array([0.3, 0.08, 0.0045])) is None  # 0.02 of its length
    assert "thick" in (proportion_conflict("door knob", np.array([0.06, 0.06, 0.008])) or "")


def test_an_outline_that_the_template_of_the_name_covers_badly_is_not_lifted_under_that_name() -> None:
    mask = np.zeros((240, 320), np.uint8)  # somebody who lies on a ball and holds something up
    cv2.line(mask, (60, 170), (250, 150), 1, 34)
    cv2.line(mask, (110, 160), (120, 50), 1, 18)
    cv2.line(mask, (250, 150), (270, 225), 1, 30)
    for middle, radius in (((55, 160), 24), ((140, 200), 36)):
        cv2.circle(mask, middle, radius, 1, -1)
    rgba = np.dstack([np.full((240, 320, 3), (60, 110, 160), np.uint8), 255 * mask])
    with pytest.raises(Rejected, match=r"no dumbbell that the template makes has this outline .* overlap 0\.\d\d"):
        generate_from_photo(rgba, "dumbbell")
    assert generate_from_photo(rgba, "gizmo").notes["primitive"] == "inflation", (
        "of a name without a template the outline is all"
    )
