"""Which hulls a closing hand can reach, and that leaving out the others changes no bit of a trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import inverse, transform_points
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien import trial as sapien_trial
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.hand_clearance import HandReach
from rigid_boxes import FROM_ABOVE, PANDA, SETTINGS, above, block, box, try_one

MARGIN_M = 0.015
ALL = 10.0  # a margin that keeps every hull


def bar(mass_kg: float) -> RigidBody:
    """A bar of 0.36 m along y, of twelve hulls."""
    hulls = tuple(block([-0.015, y - 0.015, -0.015], [0.015, y + 0.015, 0.015]) for y in np.arange(-0.165, 0.17, 0.03))
    return replace(box([0.03, 0.36, 0.03], mass_kg), hulls=hulls)


def reachable_hulls(hulls: tuple[np.ndarray, ...], pose: np.ndarray, margin_m: float) -> np.ndarray:
    return HandReach(hulls).gaps_m(PANDA, inverse(pose)[None])[0] <= margin_m


def test_reach_is_told_by_the_boxes_of_hand_and_hull() -> None:
    y_m = np.array([0.0, 0.03, 0.06, 0.3])
    hulls = tuple(block([-0.01, y - 0.005, -0.002], [0.01, y + 0.005, 0.002]) for y in y_m)
    # the pad is 17.5 mm wide: the second hull begins 16.25 mm beside it, and the rest of the hand is farther above
    assert reachable_hulls(hulls, above([0, 0, 0]), 0.016).tolist() == [True, False, False, False]
    assert reachable_hulls(hulls, above([0, 0, 0]), 0.017).tolist() == [True, True, False, False]


def test_what_lies_between_the_open_fingers_is_reached_though_it_touches_neither() -> None:
    thin = block([-0.0005, -0.01, -0.005], [0.0005, 0.01, 0.005])
    assert reachable_hulls((thin,), above([0, 0, 0]), 0.0).tolist() == [True]


def test_no_hull_within_the_margin_of_any_opening_is_left_out() -> None:
    # against distances of random points of the hand's boxes to random small hulls: never too few
    rng = np.random.default_rng(2)
    hulls = tuple(
        np.array(trimesh.creation.icosphere(subdivisions=0, radius=0.01).vertices) + center
        for center in rng.uniform(-0.08, 0.08, (60, 3))
    )
    pose = above([0.01, 0.02, -0.03], Rotation.from_euler("xyz", [0.4, -0.7, 1.1]).as_matrix())
    reached = reachable_hulls(hulls, pose, MARGIN_M)
    nearest = np.full(len(hulls), np.inf)
    for opening_m in np.linspace(0, PANDA.opening_m, 9):
        for box_to_gripper, half_m in PANDA.boxes(opening_m):
            object_to_box = inverse(pose @ box_to_gripper)
            for number, hull in enumerate(hulls):
                local = transform_points(object_to_box, hull)
                outside = np.maximum(np.abs(local) - half_m, 0)
                nearest[number] = min(nearest[number], np.linalg.norm(outside, axis=1).min())
    assert reached[nearest <= MARGIN_M].all()
    assert 5 < reached.sum() < 55, "both kinds are there"


@pytest.mark.parametrize("mass_kg", [0.2, 0.8])
def test_leaving_out_hulls_changes_no_bit_of_the_results(mass_kg: float, monkeypatch: pytest.MonkeyPatch) -> None:
    body = bar(mass_kg)
    rng = np.random.default_rng(5)
    poses = np.stack(
        [
            above([0, y, rng.uniform(-0.005, 0.005)], Rotation.from_euler("z", turn).as_matrix() @ FROM_ABOVE)
            for y, turn in zip((0.0, 0.01, -0.05, 0.1, -0.16, 0.17), rng.uniform(-0.3, 0.3, 6), strict=True)
        ]
    )
    some = [reachable_hulls(body.hulls, pose, MARGIN_M) for pose in poses]
    assert all(0 < reached.sum() < 8 for reached in some), "most are left out"
    left_out = SapienTrial().run(body, PANDA, poses, SETTINGS)
    monkeypatch.setattr(sapien_trial, "REACH_MARGIN_M", ALL)
    assert SapienTrial().run(body, PANDA, poses, SETTINGS) == left_out
    assert "held" in {result.outcome for result in left_out}


def flanged_bar(flange_m: float) -> tuple[RigidBody, np.ndarray, TrialSettings]:
    """A bar that slides down between weakly pressing fingers until its flange, ``flange_m`` above them, rests on them.

    The hand comes from the side and closes along x; 2 mu F = 5 N, less than the weight of 0.8 kg and more than the slides'
    inertial force.
    """
    sideways = Rotation.from_euler(
        "x", 90, degrees=True
    ).as_matrix()  # approach along -y, the finger's sides are up and down
    top = PANDA.pad_half_extents_m[0] + flange_m
    hulls = (
        block([-0.025, -0.005, -0.10], [0.025, 0.005, top + 0.005]),
        block([-0.05, -0.005, top], [0.05, 0.005, top + 0.006]),
    )
    body = replace(box([0.02, 0.01, 0.1], 0.8), hulls=hulls)
    return body, above([0, 0, 0], sideways), TrialSettings(force_n=5.0, finger_friction=0.5)


def test_object_that_strays_is_tried_again_with_all_hulls(monkeypatch: pytest.MonkeyPatch) -> None:
    body, pose, settings = flanged_bar(0.0175)
    assert reachable_hulls(body.hulls, pose, MARGIN_M).tolist() == [True, False]
    without = try_one(SapienTrial(), replace(body, hulls=body.hulls[:1]), pose, settings)
    assert without.outcome == "drops", "nothing but the flange stops it"
    result = try_one(SapienTrial(), body, pose, settings)
    assert result.outcome == "held"
    monkeypatch.setattr(sapien_trial, "REACH_MARGIN_M", ALL)
    assert try_one(SapienTrial(), body, pose, settings) == result


def test_hand_that_reaches_no_hull_misses() -> None:
    body = bar(0.2)
    pose = above([0.3, 0, 0])
    assert not reachable_hulls(body.hulls, pose, MARGIN_M).any()
    assert try_one(SapienTrial(), body, pose).outcome == "misses"


def test_a_grasp_that_collides_at_once_is_judged_with_hulls_left_out() -> None:
    near, far = box([0.09, 0.04, 0.04], 0.2), np.array([[0, y, z] for y in (0.4, 0.5) for z in (0.4, 0.5)], float)
    hull = np.concatenate([far, np.add(far, [0.1, 0, 0])])
    body = replace(near, hulls=(*near.hulls, hull))
    assert not reachable_hulls(body.hulls, above([0, 0, 0]), MARGIN_M)[1]
    assert SapienTrial().run(body, PANDA, above([0, 0, 0])[None], SETTINGS)[0].outcome == "collides"


def test_motion_of_a_hull_is_bounded_from_above_and_not_by_much() -> None:
    rng = np.random.default_rng(3)
    hulls = tuple(rng.uniform(-0.02, 0.02, (20, 3)) + center for center in rng.uniform(-0.1, 0.1, (12, 3)))
    turns = Rotation.from_rotvec(rng.normal(0, 0.2, (9, 3))).as_matrix()
    looks = np.tile(inverse(above([0.01, 0.02, -0.03])), (9, 1, 1))
    looks[1:, :3, :3] = turns[1:] @ looks[0, :3, :3]
    looks[1:, :3, 3] += rng.normal(0, 0.01, (8, 3))
    bounds = HandReach(hulls).motions_m(looks)
    for hull, bound in zip(hulls, bounds, strict=True):
        moved = max(
            np.linalg.norm(transform_points(look, hull) - transform_points(looks[0], hull), axis=1).max()
            for look in looks
        )
        assert moved <= bound < moved + 0.03 * np.sqrt(3)
    assert (HandReach(hulls).motions_m(looks[:1]) == 0).all()


def test_fingers_close_freely_up_to_the_faces_of_a_box() -> None:
    hulls = (block([-0.012, -0.02, -0.02], [0.012, 0.02, 0.02]),)
    pose = inverse(above([0, 0, 0]))
    travel_m = HandReach(hulls).free_travel_m(PANDA, pose, np.ones(1, bool), 0.0)
    assert travel_m == pytest.approx(PANDA.opening_m / 2 - 0.012, abs=1e-4)
    assert HandReach(hulls).free_travel_m(PANDA, pose, np.ones(1, bool), 0.003) == pytest.approx(travel_m - 0.003)


def test_fingers_that_close_freely_stay_off_what_they_close_on() -> None:
    rng = np.random.default_rng(0)
    free = []
    for _ in range(30):
        cloud = rng.normal(size=(40, 3)) * rng.uniform(0.004, 0.02, 3) + rng.uniform(-0.01, 0.01, 3)
        hull = trimesh.convex.convex_hull(cloud)
        pose = inverse(above([0, 0, 0], Rotation.random(rng=rng).as_matrix()))
        travel_m = HandReach((np.array(hull.vertices),)).free_travel_m(PANDA, pose, np.ones(1, bool), 0.001)
        if travel_m <= 0:
            continue
        free.append(travel_m)
        inside = transform_points(pose, trimesh.sample.sample_surface(hull, 4000, seed=1)[0])
        for center, half_m in PANDA.boxes(PANDA.opening_m - 2 * travel_m)[len(PANDA.palm_boxes) :]:
            apart = np.abs(transform_points(inverse(center), inside)) - half_m
            assert apart.max(1).min() > 0.00099
    assert len(free) > 10 and max(free) > 0.02


@pytest.mark.parametrize("width_m", [0.01, 0.03, 0.06])
def test_free_closing_that_is_not_simulated_again_changes_no_bit(
    width_m: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    body, pose = box([width_m, 0.05, 0.04], 0.2), above([0.004, 0.01, 0])
    short = try_one(SapienTrial(), body, pose)
    monkeypatch.setattr(HandReach, "free_travel_m", lambda *_: 0.0)
    assert try_one(SapienTrial(), body, pose) == short
    assert short.outcome == "held"
