"""Plain solids seen from above: what they are, how they lie, and outlines that no solid is believed for."""

from __future__ import annotations

import dataclasses
import io
from collections.abc import Iterator

import cv2
import numpy as np
import pytest
import trimesh

from kept_solids import kept_solids
from manitwin.errors import Rejected
from manitwin.models.generators.lift import photo_generation, unnamed_shape
from manitwin.models.generators.lift.hint import ShapeHint
from manitwin.models.generators.lift.photo_generation import generate_from_photo
from manitwin.models.generators.lift.plain_solids import PlainSolids, is_preferred_to_lifted
from manitwin.models.generators.templates.fitting.fit import TemplateFit, fit
from manitwin.models.generators.templates.fitting.residual import Residual
from manitwin.models.generators.templates.fitting.view import View, normalised

SIDE_PX = 640
TOP, SIDE = (200, 190, 170, 255), (120, 110, 95, 255)


@pytest.fixture(scope="module", autouse=True)
def solids_fitted_once() -> Iterator[None]:
    """Fit plain solids once to each picture, for each hint."""
    with kept_solids():
        yield


def _seen(
    outline_m: np.ndarray, height_m: float, elevation_deg: float, *, top: float = 1.0, yaw_rad: float = 0.5
) -> np.ndarray:
    """An RGBA picture of a convex outline (N, 2) raised to a height, its upper face scaled by ``top`` and lighter."""
    lower = np.column_stack([outline_m, np.zeros(len(outline_m))])
    upper = np.column_stack([top * outline_m, np.full(len(outline_m), height_m)])
    points, _, _ = normalised(np.concatenate([lower, upper]))
    flat, _ = View(yaw_rad, np.radians(elevation_deg), 0.0, 0.15).project(points)
    flat = (flat - (flat.min(0) + flat.max(0)) / 2) / np.ptp(flat, axis=0).max()
    pixels = np.rint(0.8 * SIDE_PX * flat + SIDE_PX / 2).astype(np.int32)
    rgba = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    cv2.fillConvexPoly(rgba, cv2.convexHull(pixels), SIDE)
    cv2.fillConvexPoly(rgba, cv2.convexHull(pixels[len(lower) :]), TOP)
    return rgba


def _rounded(x_m: float, y_m: float, radius_m: float) -> np.ndarray:
    angles = np.radians(np.arange(0, 90, 6))
    corner = radius_m * np.column_stack([np.cos(angles), np.sin(angles)])
    middle = np.array([x_m / 2 - radius_m, y_m / 2 - radius_m])
    quarters = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    return np.concatenate([(corner + middle) * signs for signs in quarters])


def _circle(width_m: float) -> np.ndarray:
    angles = np.radians(np.arange(0, 360, 4))
    return width_m / 2 * np.column_stack([np.cos(angles), np.sin(angles)])


def test_a_nameless_slab_on_a_table_lies_and_is_as_thick_as_it_looks() -> None:
    job = generate_from_photo(_seen(_rounded(0.20, 0.13, 0.02), 0.016, 30), None)
    assert job.notes["primitive"] == "slab" and job.notes["rests"] == "lying"
    assert job.notes["source"] == "plain solid fitted to the photo"
    assert job.known is None and not job.metric and "category" not in job.notes
    measures = job.notes["measures"]
    assert measures["width"] == pytest.approx(0.13 / 0.20, rel=0.08)
    assert measures["thick"] == pytest.approx(0.016 / 0.20, rel=0.25)
    assert job.notes["view"]["elevation_deg"] == pytest.approx(30, abs=5)


@pytest.mark.parametrize(("elevation_deg", "yaw_rad"), [(30.0, 0.7), pytest.param(55.0, 0.15, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "sides", [(0.22, 0.10, 0.06), (0.10, 0.07, 0.20), (0.12, 0.09, 0.05), (0.11, 0.11, 0.11)], ids=str
)
def test_a_block_has_the_proportions_that_it_shows_from_whatever_side(
    sides: tuple[float, float, float], yaw_rad: float, elevation_deg: float
) -> None:
    width, depth, height = sides
    found = photo_generation.plain_solids(
        _seen(_rounded(width, depth, 0.002), height, elevation_deg, yaw_rad=yaw_rad), ShapeHint(boxy=True)
    ).close_fit
    assert found is not None and found.category in ("box", "cutting board") and found.upright
    extents = np.ptp(found.made.mesh.vertices, axis=0)
    across = np.sort(extents[:2])[::-1] / extents[2]
    assert across == pytest.approx(np.sort([width, depth])[::-1] / height, rel=0.12)


def test_a_block_seen_from_a_corner_is_no_body_of_revolution() -> None:
    job = generate_from_photo(_seen(_rounded(0.11, 0.11, 0.002), 0.11, 30, yaw_rad=0.7), None)
    assert job.notes["primitive"] == "box" and job.notes["rests"] == "standing"


def test_the_side_that_the_photo_shows_is_the_front() -> None:
    """A slab whose narrow side is towards the camera, whatever side of a slab the solid has there."""
    job = generate_from_photo(_seen(_rounded(0.13, 0.20, 0.02), 0.016, 35, yaw_rad=0.1), None)
    width, depth, height = np.ptp(trimesh.load(io.BytesIO(job.glb), "glb").to_mesh().vertices, axis=0)[[0, 2, 1]]
    assert (
        job.notes["primitive"] == "slab"
        and depth / width == pytest.approx(0.20 / 0.13, rel=0.1)
        and height < 0.3 * width
    )
    assert abs(job.notes["view"]["yaw_deg"]) < 45


def test_a_cylinder_seen_from_above_is_as_high_as_it_is() -> None:
    found = photo_generation.plain_solids(_seen(_circle(0.08), 0.10, 35), ShapeHint()).close_fit
    assert found is not None and found.category == "can"
    extents = np.ptp(found.made.mesh.vertices, axis=0)
    assert extents[2] / extents[0] == pytest.approx(0.10 / 0.08, rel=0.08)


def test_a_disc_whose_edge_is_seen_is_one_where_its_outline_alone_may_be_an_egg() -> None:
    found = photo_generation.plain_solids(_seen(_circle(0.10), 0.008, 30), ShapeHint()).close_fit
    assert found is not None and found.category == "coaster"
    ellipse = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    cv2.ellipse(ellipse, (320, 320), (240, 130), 0, 0, 360, TOP, -1)
    assert photo_generation.plain_solids(ellipse, ShapeHint()).close_fit is None
    with pytest.raises(Rejected, match="the outline is an ellipse"):
        generate_from_photo(ellipse, None)


@pytest.mark.slow
def test_a_rectangle_of_which_no_edge_is_seen_may_be_anything() -> None:
    front = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    cv2.rectangle(front, (120, 60), (520, 580), TOP, -1)
    assert photo_generation.plain_solids(front, ShapeHint()).close_fit is None


def test_what_is_as_thick_as_a_bowl_is_no_disc() -> None:
    assert (
        photo_generation.plain_solids(_seen(_circle(0.10), 0.025, 55), ShapeHint(flat=True, round=True)).close_fit
        is None
    )


def test_what_is_said_to_be_open_or_of_another_form_is_not_tried() -> None:
    slab = _seen(_rounded(0.20, 0.13, 0.02), 0.016, 30)
    assert photo_generation.plain_solids(slab, ShapeHint(container=True)).close_fit is None
    assert photo_generation.plain_solids(slab, ShapeHint(round=True)).close_fit is None
    assert photo_generation.plain_solids(slab, ShapeHint(flat=True)).close_fit is not None


@pytest.fixture(scope="module")
def torn_front() -> tuple[np.ndarray, TemplateFit]:
    """The front of a box with a torn corner, which no rectangle explains whole, and a slab fitted to it."""
    front = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    cv2.rectangle(front, (120, 60), (520, 580), TOP, -1)
    cv2.rectangle(front, (120, 60), (240, 122), (0, 0, 0, 0), -1)
    slab = fit("book", front)
    assert slab is not None
    return front, slab


@pytest.mark.parametrize(
    ("outline", "primitive"), [(0.0029, "box"), pytest.param(0.0018, "shape of template:book", marks=pytest.mark.slow)]
)
def test_the_front_of_a_box_is_a_likely_thing_seen_at_an_angle_only_where_that_explains_it_closely(
    outline: float, primitive: str, torn_front: tuple[np.ndarray, TemplateFit], monkeypatch: pytest.MonkeyPatch
) -> None:
    front, slab = torn_front
    close = dataclasses.replace(slab, residual=Residual(0.9862, outline, 0.2, 0.3, 0.0, 200))
    monkeypatch.setattr(unnamed_shape, "fit", lambda *arguments, **options: close)
    job = generate_from_photo(front, None, likely=[("book", 0.4)])
    assert job.notes["primitive"] == primitive


@pytest.fixture(scope="module")
def seen() -> TemplateFit:
    found = photo_generation.plain_solids(_seen(_circle(0.08), 0.10, 35), ShapeHint()).close_fit
    assert found is not None
    return found


@pytest.mark.parametrize(
    ("left", "category", "lifted", "rather"),
    [
        ((0.97, 0.0035, 0.30), "cutting board", "revolution", True),
        ((0.97, 0.0035, 0.30), "can", "inflation", True),
        ((0.97, 0.0035, 0.55), "box", "revolution", False),  # its edges are not seen
        ((0.95, 0.0035, 0.30), "box", "inflation", False),
        ((0.997, 0.0006, 0.70), "box", "revolution", True),  # the outline to the pixel
        ((0.997, 0.0006, 0.70), "cutting board", "revolution", False),  # a glass from the side has it too
        ((0.997, 0.0006, 0.70), "box", "box", False),  # the front of a box has any depth
        ((0.997, 0.0006, 0.85), "box", "revolution", False),  # edges that it would show are missing
    ],
)
def test_a_plain_solid_is_preferred_to_a_lifted_outline_by_its_edges_or_its_exact_outline(
    left: tuple[float, float, float], category: str, lifted: str, rather: bool, seen: TemplateFit
) -> None:
    plain = dataclasses.replace(seen, category=category, residual=Residual(*left, 0.3, 0.0, 200))
    assert is_preferred_to_lifted(plain, lifted) is rather


@pytest.mark.parametrize(("edges", "primitive"), [(0.3, "cylinder"), (0.55, "revolution")])
def test_what_is_nearly_explained_is_the_plain_solid_where_its_edges_are_seen(
    edges: float, primitive: str, seen: TemplateFit, monkeypatch: pytest.MonkeyPatch
) -> None:
    near = dataclasses.replace(seen, residual=Residual(0.97, 0.0035, edges, 0.3, 0.0, 200))
    monkeypatch.setattr(photo_generation, "plain_solids", lambda *arguments: PlainSolids(None, near))
    monkeypatch.setattr(unnamed_shape, "turned_solid", lambda *arguments: None)  # beside it: test_turned_solid
    assert generate_from_photo(_seen(_circle(0.08), 0.10, 35), None).notes["primitive"] == primitive


@pytest.mark.slow
def test_what_is_no_such_thing_as_its_template_makes_is_the_plain_solid_that_explains_it() -> None:
    thick = _seen(_rounded(0.20, 0.10, 0.03), 0.05, 30)
    assert generate_from_photo(thick, "envelope").notes["primitive"] == "slab"
    with pytest.raises(Rejected, match="seen at an angle"):
        generate_from_photo(thick, "frisbee")
