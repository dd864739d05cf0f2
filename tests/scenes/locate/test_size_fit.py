"""The size of a thing of which only the shape is known, by depth."""

from __future__ import annotations

import numpy as np
import pytest

from manitwin.geometry.poses import transform_points
from manitwin.scenes.locate.estimate import LEAST_SCORE, pose_distances_m
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.size_fit import fit_size
from seen_solids import seen_from


def test_a_scaled_model_is_that_of_the_scaled_mesh(stool: PoseModel) -> None:
    twice = stool.scaled(2.0)
    assert twice.diameter_m == pytest.approx(2 * stool.diameter_m)
    origin, down = 2 * stool.center + np.array([0, 0, 1.0]), np.array([[0.0, 0, -1]])
    far, _ = twice.caster.first_hits(origin[None], down)
    near, _ = stool.caster.first_hits((stool.center + np.array([0, 0, 0.5]))[None], down)
    assert far[0] == pytest.approx(2 * near[0], abs=1e-6)
    assert np.allclose(twice.symmetry_poses[0], np.eye(4))


@pytest.mark.parametrize(
    "factor",
    [
        pytest.param(0.72, marks=pytest.mark.slow),
        pytest.param(1.0, marks=pytest.mark.slow),
        pytest.param(1.37, marks=pytest.mark.slow),
    ],
)
def test_the_true_size_is_found_and_the_pose_with_it(stool: PoseModel, factor: float) -> None:
    true = stool.scaled(factor)
    seen = seen_from(true, 0.6, table=True)
    fit = fit_size(seen.view, seen.mask, stool)
    assert fit.factor == pytest.approx(factor, rel=0.03) and fit.low <= factor * 1.01 and fit.high >= factor * 0.99
    assert fit.high / fit.low < 1.12 and fit.shape_off_m is not None and fit.shape_off_m < 0.003
    (pose,) = fit.location.poses
    off_m = pose_distances_m(fit.model, pose.object_to_camera[None], seen.object_to_camera)[0]
    assert off_m < 0.05 * fit.model.diameter_m
    middle = transform_points(pose.object_to_camera, fit.model.center[None])[0]
    assert np.allclose(middle, transform_points(seen.object_to_camera, true.center[None])[0], atol=0.006)


@pytest.mark.slow
def test_another_shape_has_no_size(stool: PoseModel, jar: PoseModel) -> None:
    seen = seen_from(jar, 0.6)
    fit = fit_size(seen.view, seen.mask, stool)
    assert fit.location.status == "none" and fit.location.best_score < LEAST_SCORE and fit.shape_off_m is None
