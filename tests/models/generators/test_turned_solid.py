"""Bodies of revolution that stand before a camera that looks down at them, fitted with its perspective."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Iterator

import cv2
import numpy as np
import pytest

from kept_solids import kept_solids
from manitwin.models.generators.lift import photo_generation, unnamed_shape
from manitwin.models.generators.lift.photo_generation import generate_from_photo
from manitwin.models.generators.lift.plain_solids import PlainSolids
from manitwin.models.generators.lift.turned_solid import turned_solid
from manitwin.models.generators.lift.unnamed_shape import REVOLUTION_SOURCE, TEMPLATE_SOURCE
from manitwin.models.generators.templates.fitting.fit import TemplateFit, fit
from manitwin.models.generators.templates.fitting.view import View, normalised

SIDE_PX = 640
SIDE, TOP = (130, 90, 60, 255), (220, 200, 170, 255)
BOTTLE = ((0.035, 0.0), (0.035, 0.10), (0.014, 0.14), (0.014, 0.18))
CAN = ((0.027, 0.0), (0.033, 0.008), (0.033, 0.112), (0.027, 0.12))


@pytest.fixture(scope="module", autouse=True)
def solids_fitted_once() -> Iterator[None]:
    """Fit plain and turned solids once to each picture."""
    with kept_solids():
        yield


def _seen(profile: tuple[tuple[float, float], ...], elevation_deg: float) -> np.ndarray:
    """An RGBA picture of a profile (radius, height), m, turned about the vertical; its upper end is lighter."""
    angles = np.radians(np.arange(0, 360, 3))
    circle = np.column_stack([np.cos(angles), np.sin(angles)])
    rings = [np.column_stack([radius * circle, np.full(len(circle), height)]) for radius, height in profile]
    points, _, _ = normalised(np.concatenate(rings))
    flat, _ = View(0.0, np.radians(elevation_deg), 0.0, 0.2).project(points)
    flat = (flat - (flat.min(0) + flat.max(0)) / 2) / np.ptp(flat, axis=0).max()
    pixels = np.rint(0.8 * SIDE_PX * flat + SIDE_PX / 2).astype(np.int32).reshape(len(rings), -1, 2)
    rgba = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    for lower, upper in itertools.pairwise(pixels):
        cv2.fillConvexPoly(rgba, cv2.convexHull(np.concatenate([lower, upper])), SIDE)
    cv2.fillConvexPoly(rgba, cv2.convexHull(pixels[-1]), TOP)
    return rgba


@pytest.mark.parametrize("elevation_deg", [40.0, 55.0])
def test_what_is_seen_from_above_is_as_high_as_it_is(elevation_deg: float) -> None:
    found = unnamed_shape.turned_solid(_seen(BOTTLE, elevation_deg))
    assert found is not None and found.upright
    assert np.degrees(found.view.elevation_rad) == pytest.approx(elevation_deg, abs=7.0)
    width, depth, height = np.ptp(found.made.mesh.vertices, axis=0)
    radii, heights = np.transpose(BOTTLE)
    assert width == pytest.approx(depth, rel=0.01)
    assert height / width == pytest.approx(np.ptp(heights) / (2 * radii.max()), rel=0.06)


def test_a_nameless_bottle_seen_from_above_is_that_body_and_stands(monkeypatch: pytest.MonkeyPatch) -> None:
    job = generate_from_photo(_seen(BOTTLE, 55.0), None)
    assert job.notes["primitive"] == "revolution" and job.notes["source"] == REVOLUTION_SOURCE
    assert job.notes["rests"] == "standing" and job.known is None and not job.metric
    monkeypatch.setattr(unnamed_shape, "turned_solid", turned_solid)  # fitted again, and not kept
    assert generate_from_photo(_seen(BOTTLE, 55.0), None).glb == job.glb


def test_a_can_is_no_open_one_because_that_is_what_it_may_be_called() -> None:
    job = generate_from_photo(_seen(CAN, 30.0), None, likely=[("trash can", 0.4)])
    assert job.notes["primitive"] == "revolution" and job.notes["source"] == REVOLUTION_SOURCE


@pytest.fixture(scope="module")
def can() -> tuple[np.ndarray, TemplateFit, TemplateFit]:
    """A picture, the body of revolution fitted to it, and a can that was."""
    rgba = _seen(CAN, 30.0)
    turned, other = unnamed_shape.turned_solid(rgba), fit("can", rgba)
    assert turned is not None and other is not None
    return rgba, turned, other


@pytest.mark.parametrize(("dearer", "source"), [(0.005, TEMPLATE_SOURCE), (0.02, REVOLUTION_SOURCE)])
def test_a_likely_name_speaks_where_both_explain_a_photo_as_well(
    dearer: float, source: str, can: tuple[np.ndarray, TemplateFit, TemplateFit], monkeypatch: pytest.MonkeyPatch
) -> None:
    rgba, turned, other = can
    left = dataclasses.replace(turned.residual, iou=turned.residual.iou - dearer)
    monkeypatch.setattr(unnamed_shape, "fit", lambda *arguments, **options: dataclasses.replace(other, residual=left))
    monkeypatch.setattr(photo_generation, "plain_solids", lambda *arguments: PlainSolids())
    assert generate_from_photo(rgba, None, likely=[("can", 0.3)]).notes["source"] == source


@pytest.mark.parametrize(("dearer", "primitive"), [(-0.01, "cylinder"), (0.01, "revolution")])
def test_a_plain_cylinder_stands_where_no_other_body_of_revolution_explains_the_photo_better(
    dearer: float, primitive: str, can: tuple[np.ndarray, TemplateFit, TemplateFit], monkeypatch: pytest.MonkeyPatch
) -> None:
    rgba, turned, other = can
    left = dataclasses.replace(turned.residual, shading=turned.residual.shading + dearer / 0.15)
    near = dataclasses.replace(other, residual=left)
    monkeypatch.setattr(photo_generation, "plain_solids", lambda *arguments: PlainSolids(near, near))
    assert generate_from_photo(rgba, None).notes["primitive"] == primitive
