"""Boxes seen from a corner: their sides from the outline, and what is no box."""

from __future__ import annotations

import itertools

import cv2
import numpy as np
import pytest

from manitwin.errors import Rejected
from manitwin.models.generators.lift.lifting import ShapeHint, lift
from manitwin.models.generators.lift.photo_generation import generate_from_photo
from manitwin.models.generators.lift.seen_corners import box_sides, fit_corner_box, six_corners
from manitwin.models.generators.templates.fitting.view import View, normalised

SIDE_PX = 640
LIGHT = np.array([[0.35, 0.5, 0.8]])
CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
FACES = [(axis, side) for axis in range(3) for side in (-0.5, 0.5)]


def _drawn(sides: tuple[float, float, float], view: View) -> np.ndarray:
    """An RGBA picture of a box, its faces grey by how they are turned to a light."""
    corners = CORNERS * sides
    points, _, _ = normalised(corners)
    flat, _ = view.project(points)
    pixels = np.rint(
        (flat - (flat.min(0) + flat.max(0)) / 2) / np.ptp(flat, axis=0).max() * 0.8 * SIDE_PX + SIDE_PX / 2
    )
    rgba = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    for axis, side in FACES:
        own = CORNERS[:, axis] == side
        normal = np.eye(3)[axis] * np.sign(side)
        if (view.camera_position - points[own].mean(0)) @ normal <= 0:
            continue
        grey = int(90 + 130 * abs(float(np.asarray(LIGHT @ normal)[0])))
        cv2.fillConvexPoly(rgba, cv2.convexHull(pixels[own].astype(np.int32)), (grey, grey, grey - 30, 255))
    return rgba


@pytest.mark.parametrize("sides", [(0.2, 0.05, 0.07), (0.1, 0.1, 0.1), (0.08, 0.05, 0.2), (0.3, 0.2, 0.06)])
@pytest.mark.parametrize(("yaw_deg", "elevation_deg"), [(35, 30), (-50, 42), (60, 22)])
def test_the_sides_of_a_box_follow_from_its_outline(
    sides: tuple[float, float, float], yaw_deg: float, elevation_deg: float
) -> None:
    view = View(np.radians(yaw_deg), np.radians(elevation_deg), 0.0, 0.02)
    corners = six_corners(_drawn(sides, view)[..., 3] > 127)
    assert corners is not None
    found = box_sides(corners)
    assert found is not None
    width, depth, height = found
    across = sorted(sides[:2])
    assert np.array(sorted((width, depth))) / height == pytest.approx(np.array(across) / sides[2], rel=0.1)


@pytest.mark.parametrize(
    "sides",
    [
        (0.2, 0.05, 0.07),
        *(pytest.param(sides, marks=pytest.mark.slow) for sides in ((0.08, 0.05, 0.2), (0.3, 0.2, 0.06))),
    ],
)
def test_a_nameless_box_from_near_is_a_box_of_these_sides_and_is_not_called_one(
    sides: tuple[float, float, float],
) -> None:
    rgba = _drawn(sides, View(0.7, 0.55, 0.0, 0.2))
    found = fit_corner_box(rgba)
    assert found is not None
    measured = np.sort(np.ptp(found.made.mesh.vertices, axis=0))
    assert measured / measured[-1] == pytest.approx(np.sort(sides) / max(sides), rel=0.06)
    job = generate_from_photo(rgba, None)
    assert job.notes["primitive"] == "box" and job.notes["source"] == "the outline's six corners"
    assert job.known is None and not job.metric


def test_a_box_of_which_one_face_is_seen_is_not_known_by_its_corners() -> None:
    rgba = _drawn((0.2, 0.1, 0.15), View(0.0, 0.0, 0.0, 0.02))
    assert six_corners(rgba[..., 3] > 127) is None
    assert fit_corner_box(rgba) is None


def test_a_nut_from_above_is_no_box() -> None:
    angles = np.radians(np.arange(0, 360, 60))
    corners = np.rint(320 + 200 * np.column_stack([np.cos(angles), np.sin(angles)])).astype(np.int32)
    rgba = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    cv2.fillConvexPoly(rgba, corners, (120, 120, 120, 255))
    cv2.circle(rgba, (320, 320), 90, (0, 0, 0, 0), -1)
    assert fit_corner_box(rgba) is None


def test_corners_of_which_opposite_edges_do_not_agree_are_of_no_box() -> None:
    kite = np.array([[0, 0], [4, -3], [9, -1], [9, 2], [5, 9], [0, 7]], float)
    assert box_sides(kite) is None


def _ellipse(across_px: int, high_px: int) -> np.ndarray:
    rgba = np.zeros((SIDE_PX, SIDE_PX, 4), np.uint8)
    cv2.ellipse(rgba, (320, 320), (across_px, high_px), 0, 0, 360, (150, 90, 60, 255), -1)
    return rgba


@pytest.mark.parametrize("half_axes_px", [(240, 130), (120, 250)])
def test_an_ellipse_without_a_name_is_a_disc_as_well_as_an_egg(half_axes_px: tuple[int, int]) -> None:
    with pytest.raises(Rejected, match=r"a disc seen at an angle .* --name") as caught:
        lift(_ellipse(*half_axes_px), ShapeHint())
    assert caught.value.reason == "generator_failed"


def test_a_circle_and_an_ellipse_that_is_said_to_be_round_are_solids_of_revolution() -> None:
    assert lift(_ellipse(200, 200), ShapeHint()).notes["primitive"] == "revolution"
    assert lift(_ellipse(150, 250), ShapeHint(round=True)).notes["primitive"] == "revolution"


@pytest.mark.slow
def test_a_long_speaker_is_a_box_that_lies_and_no_speaker_on_its_end() -> None:
    view = View(np.radians(40), np.radians(35), np.radians(12), 0.2)
    made = generate_from_photo(_drawn((0.2, 0.055, 0.07), view), "speaker")
    assert made.notes["primitive"] == "box" and made.known is None
    measures = made.notes["measures"]
    sides = np.array([measures["width"], measures["depth"], 1.0]) * measures["height_m"]
    assert sides[:2].max() / sides[2] == pytest.approx(0.2 / 0.07, rel=0.1)
    assert sides[:2].min() / sides[2] == pytest.approx(0.055 / 0.07, rel=0.15)
