"""Poses within a rim: on end, deep where asked; as it stands, turned about the vertical; leaning, upper side up."""

from __future__ import annotations

import numpy as np
import pytest
from placing_skills import POOL, around, placed

from manitwin.episodes.skills.within_rim import LET_GO_M, leaning_pose, pose_in_orientation, pose_on_end
from manitwin.geometry.poses import transform, transform_points
from manitwin.scenes.layouts.pool import Pool, PoolBody, PoolTwin, StandingPose
from manitwin.scenes.layouts.stacking import ContainerOpening, container_opening
from rigid_boxes import box
from twin_folders import twin_id

SPOT = around(placed(0, "dice", 0.45, -0.2), placed(1, "mixing bowl", 0.5, 0.1))
DICE, VESSEL = POOL.body(SPOT.objects[0].twin_id), SPOT.parts(1)
BAR = box([0.03, 0.24, 0.03], 0.2)


def mouth() -> ContainerOpening:
    found = container_opening(SPOT.body(1), SPOT.objects[1].object_to_world)
    assert found is not None
    return found


def below_rim_m(pose: np.ndarray | None) -> float:
    assert pose is not None
    return float(mouth().center_m[2] - transform_points(pose, DICE.parts.whole)[:, 2].min())


@pytest.mark.parametrize("seed", range(4))
def test_on_end_it_is_deep_where_asked_for_and_else_below_the_rim(seed: int) -> None:
    shallow, deep = (
        pose_on_end(DICE, VESSEL, mouth(), np.random.default_rng(seed), deep=deep) for deep in (False, True)
    )
    assert below_rim_m(shallow) == pytest.approx(min(LET_GO_M, 0.8 * mouth().depth_m), abs=1e-6)
    assert below_rim_m(shallow) < below_rim_m(deep) < mouth().depth_m


@pytest.mark.parametrize("seed", range(4))
def test_as_it_stands_it_is_turned_about_the_vertical_alone(seed: int) -> None:
    tilted = np.array([[1.0, 0, 0], [0, 0.8, -0.6], [0, 0.6, 0.8]])
    pose = pose_in_orientation(DICE, tilted, VESSEL, mouth(), np.random.default_rng(seed))
    assert 0 < below_rim_m(pose) < mouth().depth_m
    assert pose is not None
    assert (pose[:3, :3] @ tilted.T)[2] == pytest.approx([0, 0, 1], abs=1e-9)


def bar() -> PoolBody:
    """A bar, 24 cm along Y."""
    name = twin_id(90)
    lying = StandingPose(0, transform(None, np.array([0, 0, 0.015])), 1.0, 0.13)
    return Pool([PoolTwin(name, "0", "bar", (lying,), False, ())], {name: BAR}.__getitem__).body(name)


def test_what_leans_has_an_end_below_the_rim_and_its_upper_side_up() -> None:
    rng, found = np.random.default_rng(0), list[np.ndarray]()
    for _ in range(60):
        pose = leaning_pose(bar(), np.eye(3), VESSEL, mouth(), rng)
        if pose is not None:
            found.append(pose)
    assert len(found) > 10
    points, center = np.concatenate(BAR.hulls), mouth().center_m
    for pose in found:
        assert pose[2, 2] > 0, "the side that was up"
        assert abs(pose[2, 0]) < 1e-9, "tilted along its length alone"
        low_m = transform_points(pose, points)[:, 2].min() - center[2]
        assert -mouth().depth_m < low_m <= 0
        assert np.linalg.norm(pose[:2, 3] - center[:2]) <= mouth().radius_m
    lower_ends = {bool(pose[2, 1] > 0) for pose in found}
    assert lower_ends == {True, False}, "either end"


def test_nothing_is_within_too_narrow_a_rim() -> None:
    narrow = ContainerOpening(mouth().center_m, 0.01, mouth().depth_m)
    assert pose_on_end(DICE, VESSEL, narrow, np.random.default_rng(0), deep=True) is None
    assert pose_in_orientation(DICE, np.eye(3), VESSEL, narrow, np.random.default_rng(0)) is None
