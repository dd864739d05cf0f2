"""A grasp belongs to what its fingertips touch: solids of known parts, and grasps put on them by hand."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import trimesh

from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.description_parser import read_text
from manitwin.models.generators.templates.object_sampling import make_object
from manitwin.pipeline.grasp_regions import PartedSolid, region_columns

DEPTH_M, OPENING_M = 0.1, 0.08
DOWN, SIDE = np.array([0.0, 0.0, -1.0]), np.array([0.0, 1.0, 0.0])


def solid_of(category: str) -> tuple[PartedSolid, tuple[str, ...]]:
    templates = load_templates()
    made = make_object(templates[category], read_text(category, templates), np.random.default_rng(0))
    solid = trimesh.Trimesh(made.mesh.vertices, made.mesh.faces, process=False)
    ids = tuple(f"p{place}" for place in range(len(made.mesh.names)))
    return PartedSolid(solid, RayCaster(solid), made.mesh.part.astype(np.uint8), ids, 0.03, OPENING_M), made.mesh.names


def grasp_at(
    middle_m: np.ndarray, closing: np.ndarray, width_m: float, approach: np.ndarray = DOWN
) -> dict[str, np.ndarray]:
    pose = transform(np.column_stack([closing, np.cross(approach, closing), approach]), middle_m - DEPTH_M * approach)
    return {
        "gripper_to_object": pose[None],
        "depth_m": np.array([DEPTH_M]),
        "width_m": np.array([width_m]),
    }


def point(name: str, held: PartedSolid, part: int) -> dict[str, Any]:
    """A point on the face of a part that is nearest to its middle."""
    faces = np.flatnonzero(held.labels == part)
    centers = held.solid.triangles_center[faces]
    nearest = centers[np.linalg.norm(centers - centers.mean(0), axis=1).argmin()]
    return {"id": name, "position_m": nearest.tolist()}


def row(held: PartedSolid, grasp: dict[str, np.ndarray], grasp_points: list[dict[str, Any]]) -> dict[str, Any]:
    functional = [{"id": "f0", "position_m": [0.0, 0.0, 9.0]}]
    return {name: column[0] for name, column in region_columns(grasp, held, functional, grasp_points).items()}


def test_grasp_at_a_hammers_neck_is_no_grasp_of_its_claw() -> None:
    held, names = solid_of("hammer")
    handle, claw = names.index("handle"), names.index("claw")
    ends = held.solid.triangles_center[held.labels == claw]
    neck_m = np.array([ends[:, 0].min() - 0.02, 0.0, 0.016])  # below the head, nearer to the claw than to the grip
    points = [point("claw", held, claw), point("handle", held, handle)]
    away = [np.linalg.norm(neck_m - each["position_m"]) for each in points]
    assert away[0] < away[1]
    found = row(held, grasp_at(neck_m, SIDE, 0.032), points)
    assert found["part_id"] == f"p{handle}" and found["grasp_point_id"] == ""


def test_grasp_of_a_teapots_knob_does_not_carry_the_handles_scenario() -> None:
    held, names = solid_of("teapot")
    lid, handle = names.index("lid"), names.index("handle")
    top = held.solid.triangles_center[held.labels == lid]
    knob_m = np.array([0.0, 0.0, top[:, 2].max() - 0.006])
    around = top[np.abs(top[:, 2] - knob_m[2]) < 0.004]
    width_m = 2 * float(np.hypot(around[:, 0], around[:, 1]).max())
    handle_point = point("g0", held, handle)
    found = row(held, grasp_at(knob_m, SIDE, width_m), [handle_point])
    assert found["part_id"] == f"p{lid}" and found["grasp_point_id"] == ""
    there = np.array(handle_point["position_m"])
    at_handle = row(held, grasp_at(there, SIDE, 0.012), [handle_point])
    assert at_handle["part_id"] == f"p{handle}"


def test_edge_of_a_wall_is_held_by_the_wall_and_a_place_well_inside_a_part_by_that_alone() -> None:
    held, names = solid_of("cup")
    rim, body = names.index("rim"), names.index("body")
    centers = held.solid.triangles_center
    edge_m = centers[held.labels == rim].copy()
    edge_m = edge_m[np.abs(np.arctan2(edge_m[:, 1], edge_m[:, 0])).argmin()]  # towards +x
    wall_m = edge_m - [0, 0, 0.012]
    over_the_rim = grasp_at(wall_m, np.array([1.0, 0, 0]), 0.004)
    at_rim = {"id": "g0", "position_m": edge_m.tolist()}
    found = row(held, over_the_rim, [at_rim])
    assert found["part_id"] in (f"p{body}", f"p{names.index('inside')}") and found["grasp_point_id"] == "g0"
    floor = point("g1", held, names.index("base"))
    assert row(held, over_the_rim, [floor])["grasp_point_id"] == ""


def bar(told: bool) -> PartedSolid:
    """A bar along X whose half towards +X is another part."""
    solid = trimesh.creation.box((0.3, 0.02, 0.02)).subdivide().subdivide().subdivide()
    labels = (
        np.where(solid.triangles_center[:, 0] > 0, 1, 0).astype(np.uint8)
        if told
        else np.full(len(solid.faces), 255, np.uint8)
    )
    return PartedSolid(solid, RayCaster(solid), labels, ("p0", "p1") if told else (), 0.03, OPENING_M)


ON_BAR = {"id": "g0", "position_m": [0.01, 0.01, 0.0]}


@pytest.mark.parametrize(
    ("at_m", "told", "part", "served"),
    [
        (0.02, True, "p1", "g0"),
        (-0.02, True, "p0", ""),  # 3 cm away and on the other part
        (-0.015, False, "", "g0"),  # no parts are told: the radius alone decides
        (0.06, True, "p1", ""),
        (-0.06, False, "", ""),
    ],
)
def test_point_is_served_on_its_own_part_within_the_radius(at_m: float, told: bool, part: str, served: str) -> None:
    found = row(bar(told), grasp_at(np.array([at_m, 0, 0]), SIDE, 0.02), [ON_BAR])
    assert (found["part_id"], found["grasp_point_id"]) == (part, served)


def test_grasp_across_a_border_is_of_the_part_that_more_of_the_pads_touch() -> None:
    assert row(bar(True), grasp_at(np.array([0.003, 0, 0]), SIDE, 0.02), [ON_BAR])["part_id"] == "p1"
    assert row(bar(True), grasp_at(np.array([-0.003, 0, 0]), SIDE, 0.02), [ON_BAR])["part_id"] == "p0"


@pytest.mark.parametrize("closing", [SIDE, -SIDE])
def test_hand_turned_by_half_a_turn_holds_the_same_part(closing: np.ndarray) -> None:
    held = bar(True)
    sides = np.where(held.solid.triangles_center[:, 1] > 0, 1, 0).astype(np.uint8)  # one fingertip on each
    across = PartedSolid(held.solid, held.surface, sides, held.part_ids, held.radius_m, OPENING_M)
    assert row(across, grasp_at(np.array([0.02, 0, 0]), closing, 0.02), [])["part_id"] == "p0"


@pytest.mark.parametrize("width_m", [0.04, 0.1])
def test_fingertips_that_end_away_from_the_surface_touch_nothing(width_m: float) -> None:
    found = row(bar(True), grasp_at(np.array([0.02, 0, 0]), SIDE, width_m), [ON_BAR])
    assert (found["part_id"], found["grasp_point_id"]) == ("", "")


@pytest.mark.parametrize("beside_m", [-0.025, -0.012, 0.012, 0.025])
def test_what_one_fingertip_meets_first_and_pushes_to_the_other_is_held(beside_m: float) -> None:
    # a fifth of a clamp's grasps have the thing beside the middle of the open hand
    found = row(bar(True), grasp_at(np.array([0.02, beside_m, 0]), SIDE, 0.02), [ON_BAR])
    assert (found["part_id"], found["grasp_point_id"]) == ("p1", "g0")


@pytest.mark.parametrize(("above_m", "told"), [(0.002, "p0"), (0.0085, "p0"), (0.011, "")])
def test_a_thin_bar_under_the_border_of_the_pads_is_held(above_m: float, told: str) -> None:
    """Pads are 18 mm high: of a bar of 2 mm they hold what is less than 9 mm from their middle."""
    bar = trimesh.creation.box([0.2, 0.02, 0.002])
    held = PartedSolid(bar, RayCaster(bar), np.zeros(len(bar.faces), np.uint8), ("p0",), 0.03, OPENING_M)
    found = row(held, grasp_at(np.array([0.0, 0.0, above_m]), SIDE, 0.02), [])
    assert found["part_id"] == told


def test_a_hand_without_two_pads_touches_what_is_nearest() -> None:
    held = bar(True)
    hand = PartedSolid(held.solid, held.surface, held.labels, held.part_ids, held.radius_m, opening_m=None)
    found = row(hand, grasp_at(np.array([0.02, 0, 0]), SIDE, 0.05), [ON_BAR])
    assert (found["part_id"], found["grasp_point_id"]) == ("p1", "g0")


def test_no_grasps_hold_nothing() -> None:
    none = {"gripper_to_object": np.zeros((0, 4, 4)), "depth_m": np.zeros(0), "width_m": np.zeros(0)}
    columns = region_columns(none, bar(True), [], [ON_BAR])
    assert {name: len(column) for name, column in columns.items()} == dict.fromkeys(columns, 0)
