"""Poses told of noisy pictures, against the poses from which they were drawn."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh
from PIL import Image
from scipy.spatial import cKDTree

from manitwin.geometry.poses import transform_points
from manitwin.scenes.locate.estimate import (
    AMBIGUOUS_MARGIN,
    AMBIGUOUS_SIGMA,
    LEAST_SCORE,
    Location,
    locate_in_view,
    margins,
)
from manitwin.scenes.locate.input_files import read_view, view_of_cloud
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.pose_scoring import PixelSamples, scores_of
from manitwin.scenes.locate.search import Candidates, observed_points
from seen_solids import seen_from


def add(model: PoseModel, found: np.ndarray, true: np.ndarray) -> float:
    """ADD by its definition, as a share of the diameter: without symmetries, and not by the project's own function."""
    there = transform_points(true, model.points) - transform_points(found, model.points)
    return float(np.linalg.norm(there, axis=1).mean() / model.diameter_m)


@pytest.mark.parametrize("hidden", [pytest.param(0.0, marks=pytest.mark.slow), 0.5])
def test_a_body_without_symmetry_is_found_also_half_hidden(stool: PoseModel, hidden: float) -> None:
    seen = seen_from(stool, 0.6, hidden_right=hidden)
    found = locate_in_view(seen.view, seen.mask, stool)
    assert found.status == "found" and found.poses[0].score > LEAST_SCORE
    assert add(stool, found.poses[0].object_to_camera, seen.object_to_camera) < 0.03
    assert found.poses[0].visible_share == pytest.approx(1 - hidden, abs=0.08)


def test_a_hidden_knob_is_said_to_be_ambiguous_and_one_in_sight_is_not(jar: PoseModel) -> None:
    hidden, shown = seen_from(jar, np.pi), seen_from(jar, 0.7)
    unsure = locate_in_view(hidden.view, hidden.mask, jar)
    assert unsure.status == "ambiguous"
    assert min(pose.score for pose in unsure.poses) >= unsure.best_score - AMBIGUOUS_MARGIN
    knobs = [pose.object_to_camera[:3, :3] @ [1, 0, 0] for pose in unsure.poses]
    assert all(knob[2] > 0 for knob in knobs), "each of them has it on the far side"
    sure = locate_in_view(shown.view, shown.mask, jar)
    assert sure.status == "found"
    assert add(jar, sure.poses[0].object_to_camera, shown.object_to_camera) < 0.05


def test_another_thing_and_one_of_another_size_are_refused(stool: PoseModel, jar: PoseModel) -> None:
    seen = seen_from(stool, 0.6)
    larger = PoseModel.of_mesh("larger", trimesh.creation.box((0.17, 0.12, 0.12)))
    for other in (jar, larger):
        answer = locate_in_view(seen.view, seen.mask, other)
        assert answer.status == "none" and not answer.poses and answer.best_score < LEAST_SCORE
        assert f"{answer.best_score:.0%} of what is seen" in answer.reason


@pytest.mark.slow
def test_a_body_of_revolution_has_one_pose_and_any_turn_of_it_is_the_same() -> None:
    can = PoseModel.of_mesh("can", trimesh.creation.cylinder(0.035, 0.11, sections=64))
    seen = seen_from(can, 1.0)
    found = locate_in_view(seen.view, seen.mask, can)
    assert found.status == "found" and can.symmetries.axis is not None
    axis = found.poses[0].object_to_camera[:3, 2] @ seen.object_to_camera[:3, 2]
    assert abs(axis) > np.cos(np.deg2rad(3)), "either end may be up"


@pytest.mark.parametrize(
    "mesh",
    [
        trimesh.creation.box((0.06, 0.06, 0.06)),
        pytest.param(trimesh.creation.cylinder(0.025, 0.14, sections=6), marks=pytest.mark.slow),
        trimesh.creation.icosphere(subdivisions=3, radius=0.035),
    ],
    ids=["cube", "hexagonal prism", "ball"],
)
def test_a_cube_a_prism_and_a_ball_have_one_pose(mesh: trimesh.Trimesh) -> None:
    model = PoseModel.of_mesh("regular", mesh)
    seen = seen_from(model, 0.6)
    found = locate_in_view(seen.view, seen.mask, model)
    assert found.status == "found"
    there = transform_points(seen.object_to_camera, model.points)
    apart, _ = cKDTree(there).query(transform_points(found.poses[0].object_to_camera, model.points))
    assert apart.mean() < 0.03 * model.diameter_m


def test_what_a_pose_shows_too_much_far_from_the_thing_speaks_against_it_and_not_for_it() -> None:
    told_apart, both = (candidates_of(far) for far in (0, 20))
    assert margins(told_apart)[1][1] > AMBIGUOUS_SIGMA
    assert margins(both)[0][1] > margins(told_apart)[0][1]
    assert margins(both)[1][1] > margins(told_apart)[1][1]


def candidates_of(far: int) -> Candidates:
    """Two poses: the second explains 150 pixels of 2400 less, and shows ``far`` of 1200 too much that stand for 182 each."""
    inside, about = 2400, 1200
    weight = np.concatenate([np.full(inside, 3.0), np.full(about, 182.0)])
    gains = np.zeros((2, inside + about))
    gains[:, :inside] = 1.0
    gains[1, :150], gains[1, inside : inside + far] = 0.0, -1.0
    nothing = np.zeros(inside + about)
    evidence = PixelSamples(np.zeros((inside + about, 3)), nothing, nothing, weight, inside, nothing)
    return Candidates(np.tile(np.eye(4), (2, 1, 1)), scores_of(gains, evidence), 0.005, evidence, gains)


def test_the_same_view_has_the_same_answer_and_a_cloud_of_it_the_same_pose(stool: PoseModel) -> None:
    seen = seen_from(stool, 2.1)
    first, again = (locate_in_view(seen.view, seen.mask, stool) for _ in range(2))
    assert np.array_equal(first.poses[0].object_to_camera, again.poses[0].object_to_camera)
    points = seen.view.points(np.flatnonzero(seen.mask & (seen.view.depth_m > 0)))
    by_cloud: Location = locate_in_view(*view_of_cloud(points, "cloud"), stool)
    assert by_cloud.status == "found"
    assert add(stool, by_cloud.poses[0].object_to_camera, seen.object_to_camera) < 0.05


def test_depths_in_steps_of_a_centimetre_show_the_thing_and_no_other(
    stool: PoseModel, jar: PoseModel, tmp_path: Path
) -> None:
    seen = seen_from(stool, 0.6)
    depth = np.rint(np.nan_to_num(seen.view.depth_m, posinf=0.0) / 0.01).astype(np.uint8)
    k, (height, width) = seen.view.intrinsics, depth.shape
    camera = {"fx": k[0, 0], "fy": k[1, 1], "cx": k[0, 2] - 0.5, "cy": k[1, 2] - 0.5, "width": width, "height": height}
    (tmp_path / "camera.json").write_text(json.dumps(camera | {"depth_unit_m": 0.01}))
    Image.fromarray(depth).save(tmp_path / "depth.png")
    view, _ = read_view(tmp_path / "depth.png", tmp_path / "camera.json", None, None)
    found = locate_in_view(view, seen.mask, stool)
    assert found.status == "found" and add(stool, found.poses[0].object_to_camera, seen.object_to_camera) < 0.05
    assert locate_in_view(view, seen.mask, jar).status == "none"


def test_too_little_is_no_answer(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6)
    few = seen.mask & (np.cumsum(seen.mask).reshape(seen.mask.shape) <= 60)
    answer = locate_in_view(seen.view, few, stool)
    assert answer.status == "none" and "pixels show it" in answer.reason


def test_points_far_behind_a_mask_are_no_part_of_the_thing(stool: PoseModel) -> None:
    seen = seen_from(stool, 0.6)
    wide = seen.mask.copy()
    wide[:2] = True  # the backdrop, 0.7 m behind
    points = observed_points(seen.view, wide, stool.diameter_m, np.random.default_rng(0))
    assert points[:, 2].max() < 1.0
