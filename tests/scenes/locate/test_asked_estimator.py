"""Guesses of others in the place of the search, with the same checks afterwards."""

from __future__ import annotations

import shlex
import sys

import numpy as np
import pytest
import trimesh

from located_views import BrickView, brick_view
from manitwin.config import ServicesConfig
from manitwin.models.fakes.catalog import serving
from manitwin.models.pose_estimators.from_spec import pose_estimator
from manitwin.scenes.locate.estimate import locate_in_view, pose_distances_m
from manitwin.scenes.locate.external_estimator import ExternalEstimator, pose_request
from manitwin.scenes.locate.pose_model import PoseModel

SERVICES = ServicesConfig(retries=0, timeout_s=120)
PROGRAM = f"command:{shlex.quote(sys.executable)} -m manitwin.models.fakes.pose_estimator {{request}} {{out}}"


@pytest.fixture(scope="module")
def seen(tmp_path_factory: pytest.TempPathFactory) -> BrickView:
    return brick_view(tmp_path_factory.mktemp("brick"))


def asked(seen: BrickView, spec: str) -> ExternalEstimator:
    return ExternalEstimator(pose_estimator(spec, SERVICES), lambda twin_id: seen.twin, 7)


@pytest.mark.slow
def test_poor_guesses_of_a_program_are_aligned_and_the_one_that_explains_is_found(seen: BrickView) -> None:
    guess = asked(seen, PROGRAM)
    raw = guess(seen.view, seen.mask, seen.model)
    assert pose_distances_m(seen.model, raw, seen.object_to_camera).min() > 0.01, "none of them is the pose"
    found = locate_in_view(seen.view, seen.mask, seen.model, guess=guess)
    assert found.status == "found" and guess.model == "rehearsal"
    apart = pose_distances_m(seen.model, found.poses[0].object_to_camera[None], seen.object_to_camera)
    assert apart[0] < 0.003


def test_a_server_is_asked_the_same(seen: BrickView) -> None:
    with serving("pose") as server:
        served = asked(seen, server.spec)(seen.view, seen.mask, seen.model)
    assert served == pytest.approx(asked(seen, PROGRAM)(seen.view, seen.mask, seen.model))


def test_guesses_of_another_thing_are_refused_as_any(seen: BrickView) -> None:
    other = PoseModel.of_mesh("slab", trimesh.creation.box((0.2, 0.15, 0.01)))
    poses = np.array([seen.object_to_camera] * 3)
    found = locate_in_view(seen.view, seen.mask, other, guess=lambda view, mask, model: poses)
    assert found.status == "none" and not found.poses


def test_the_question_has_the_cameras_pixels_at_whole_numbers_and_the_twin_in_metres(seen: BrickView) -> None:
    asked_of = pose_request(seen.view, seen.mask, seen.model, seen.twin, 7)
    camera, k = asked_of.document["camera"], seen.view.intrinsics
    assert camera["cx"] == pytest.approx(k[0, 2] - 0.5) and camera["fx"] == pytest.approx(k[0, 0])
    mesh = trimesh.load(trimesh.util.wrap_as_stream(asked_of.files["model.ply"]), file_type="ply")
    assert mesh.extents == pytest.approx([0.04, 0.06, 0.1], abs=1e-6)
    assert asked_of.document["files"]["rgb"] is None and "rgb.png" not in asked_of.files
    assert asked_of.document["depth_unit_m"] == 0.0001 and asked_of.document["seed"] == 7
