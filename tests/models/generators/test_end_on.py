"""Outlines that are only the end of a thing: what is said of them, and what is no such outline."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.generators.lift.end_on import is_elliptical_end_view, reject_end_view
from manitwin.models.generators.lift.photo_generation import generate_from_photo
from manitwin.models.generators.lift.roundness import is_round, is_round_along
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.evidence import extract_evidence
from manitwin.models.generators.templates.fitting.fit import assemble_fit, build_fitted_object
from manitwin.models.generators.templates.fitting.least_squares import PlacedView
from manitwin.models.generators.templates.fitting.residual import Residual
from manitwin.models.generators.templates.fitting.view import View

ABOVE, ASIDE = np.array([0.0, -np.cos(np.radians(70)), np.sin(np.radians(70))]), np.array([0.0, -1.0, 0.0])
TALL, WIDE = np.array([0.06, 0.06, 0.15]), np.array([0.15, 0.15, 0.06])


def _ellipse(across_px: int, high_px: int) -> np.ndarray:
    rgba = np.zeros((640, 640, 4), np.uint8)
    cv2.ellipse(rgba, (320, 320), (across_px, high_px), 0, 0, 360, (150, 140, 120, 255), -1)
    return rgba


@pytest.mark.parametrize(
    ("name", "half_axes_px"),
    [("glass", (120, 220)), ("jar", (170, 220)), pytest.param("bucket", (120, 220), marks=pytest.mark.slow)],
)
def test_a_rim_seen_from_above_is_no_tall_thing(name: str, half_axes_px: tuple[int, int]) -> None:
    with pytest.raises(
        Rejected, match=f"hardly that of a {name}: how long it is does not show; take the photo from the side"
    ):
        generate_from_photo(_ellipse(*half_axes_px), name)


@pytest.mark.parametrize("name", [pytest.param("bowl", marks=pytest.mark.slow), "egg"])
def test_what_has_an_ellipse_for_its_outline_is_made(name: str) -> None:
    assert generate_from_photo(_ellipse(170, 220), name).notes["primitive"] == f"template:{name}"


@pytest.mark.slow
def test_a_circle_is_no_end_of_a_long_thing_that_is_only_likely() -> None:
    circle = _ellipse(200, 200)
    made = generate_from_photo(circle, None, likely=[("salt shaker", 0.6)]).notes["primitive"]
    assert made != "shape of template:salt shaker"
    assert is_elliptical_end_view(TALL, ABOVE, circle)
    assert not is_elliptical_end_view(TALL, ASIDE, circle) and not is_elliptical_end_view(WIDE, ABOVE, circle)


def test_only_a_long_thing_that_the_camera_looks_along_is_its_end() -> None:
    ellipse, rectangle = _ellipse(120, 220), np.zeros((640, 640, 4), np.uint8)
    rectangle[200:440, 100:540] = 255
    with pytest.raises(Rejected, match="hardly that of an urn"):
        reject_end_view(TALL, ABOVE, 0.94, ellipse, "urn")
    reject_end_view(TALL, ASIDE, 0.94, ellipse, "urn")
    reject_end_view(WIDE, ABOVE, 0.94, ellipse, "urn")
    reject_end_view(TALL, ABOVE, 0.99, ellipse, "urn")
    reject_end_view(TALL, ABOVE, 0.94, rectangle, "urn")


@pytest.mark.parametrize(
    ("category", "upright", "along"), [("plate", True, False), ("screwdriver", False, True), ("mug", False, False)]
)
def test_what_lies_is_round_about_its_length(category: str, upright: bool, along: bool) -> None:
    template = load_templates()[category]
    made = build_fitted_object(template, {name: measure.typical for name, measure in template.measures.items()})
    left = Residual(iou=0.9, outline=0.01, edges=0.5, shading=0.5, hidden=0.0, edge_px=10)
    found = assemble_fit(made, PlacedView(View(0.0, 0.5, 0.0, 0.1), True), left, extract_evidence(_ellipse(100, 100)))
    assert (is_round(found), is_round_along(found)) == (upright, along)


def test_a_rod_that_no_template_explains_is_turned_about_its_length() -> None:
    assert generate_from_photo(_ellipse(220, 120), "egg").notes["primitive"] == "revolution"
