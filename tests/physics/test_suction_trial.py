"""The suction trial against closed forms: pull-off, shear and tilt where they must begin; no seal, no hold."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh

from manitwin.geometry.poses import transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.suction import lip_load
from manitwin.physics.suction_trial import SuctionTrial
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.suction import SuctionGripper
from rigid_boxes import FROM_ABOVE, SLIDE_PEAK_M_S2, box

CUP = load_gripper("suction")
assert isinstance(CUP, SuctionGripper)
SETTINGS = TrialSettings(force_n=CUP.force_n, finger_friction=CUP.finger_friction)
FROM_SIDE = np.array([[0.0, 0, -1], [0, 1, 0], [1, 0, 0]])  # approaches along -X
EXTENTS_M = [0.06, 0.06, 0.06]
RADIUS_M, VACUUM_N, FRICTION = CUP.lip_radius_m, CUP.force_n, 0.5


def at(lip_m: list[float], rotation: np.ndarray = FROM_ABOVE) -> np.ndarray:
    """The grasp whose lip's centre is at ``lip_m``."""
    return transform(rotation, np.array(lip_m) - rotation[:, 2] * CUP.tip_depth_m)


def try_one(body: RigidBody, pose: np.ndarray, settings: TrialSettings = SETTINGS) -> TrialResult:
    return SuctionTrial().run(body, CUP, pose[None], settings)[0]


def quiet(settings: TrialSettings = SETTINGS) -> TrialSettings:
    """Settings whose paths are so slow that only the weight counts."""
    return replace(settings, lift_m=1e-6, slide_m=1e-6)


def test_force_is_pressure_times_area() -> None:
    assert CUP.force_n == pytest.approx(60_000 * np.pi * 0.015**2)


@pytest.mark.parametrize(("share", "outcome"), [(0.999, "held"), (1.001, "drops")])
def test_hanging_weight_is_pulled_off_at_pressure_times_area(share: float, outcome: str) -> None:
    body = box(EXTENTS_M, share * VACUUM_N / 9.81, FRICTION)
    assert try_one(body, at([0, 0, 0.03]), quiet()).outcome == outcome


@pytest.mark.parametrize(("share", "outcome"), [(0.999, "held"), (1.001, "drops")])
def test_weight_beside_the_cup_slides_off_at_friction_times_force(share: float, outcome: str) -> None:
    # the centre of mass in the lip's plane: shear alone, neither tilt nor pull
    body = box(EXTENTS_M, share * FRICTION * VACUUM_N / 9.81, FRICTION, center_m=(0.03, 0, 0))
    assert try_one(body, at([0.03, 0, 0], FROM_SIDE), quiet()).outcome == outcome


@pytest.mark.parametrize(("share", "outcome"), [(0.999, "held"), (1.001, "drops")])
def test_weight_off_the_axis_peels_the_lip(share: float, outcome: str) -> None:
    # 2 m g l / r + m g = V
    lever_m = 0.04
    mass_kg = share * VACUUM_N / 9.81 / (1 + 2 * lever_m / RADIUS_M)
    body = box([0.12, 0.06, 0.06], mass_kg, FRICTION, center_m=(lever_m, 0, 0))
    assert try_one(body, at([0, 0, 0.03]), quiet()).outcome == outcome


def test_slides_need_their_peak_acceleration_on_top_of_the_weight() -> None:
    # upwards slide, hanging: pull m (g + a); sideways: shear m a / mu and tilt 2 m a l / r beside the pull m g
    lever_m = 0.03
    worst = max(9.81 + SLIDE_PEAK_M_S2, 9.81 + SLIDE_PEAK_M_S2 * max(1 / FRICTION, 2 * lever_m / RADIUS_M))
    limit_kg = VACUUM_N / worst
    outcomes = [try_one(box(EXTENTS_M, s * limit_kg, FRICTION), at([0, 0, 0.03])).outcome for s in (0.99, 1.01)]
    assert outcomes == ["held", "slips"]


def test_thing_pressed_on_from_below_holds_far_more_than_the_vacuum_pulls() -> None:
    body = box(EXTENTS_M, 2 * VACUUM_N / 9.81, FRICTION)
    assert try_one(body, at([0, 0, -0.03], np.eye(3)), quiet()).outcome == "held"


def test_object_that_comes_off_falls_freely() -> None:
    # off at once: after the way at which the lift gives up, s = g t^2 / 2, looked at every 16 steps
    result = try_one(box(EXTENTS_M, 3 * VACUUM_N / 9.81, FRICTION), at([0, 0, 0.03]), quiet())
    steps = np.ceil(np.sqrt(2 * 0.02 / 9.81) * 240 / 16) * 16
    assert result.outcome == "drops"
    assert result.displacement_m == pytest.approx(9.81 * steps * (steps + 1) / 2 / 240**2, rel=1e-6)


def test_cup_in_the_air_misses_and_tool_in_the_object_collides() -> None:
    body = box(EXTENTS_M, 0.1, FRICTION)
    assert try_one(body, at([0, 0, 0.03 + 1.5 * CUP.reach_m])).outcome == "misses"
    assert try_one(body, at([0, 0, 0])).outcome == "collides"
    assert try_one(body, at([0, 0, 0.03 + 0.5 * CUP.reach_m])).outcome == "held"  # pressed on until it meets


def test_cup_feels_the_surface_and_not_the_hulls() -> None:
    ring = trimesh.creation.annulus(0.005, 0.04, 0.02)  # a hole that the hull closes
    hull = np.array(ring.convex_hull.vertices)
    body = RigidBody((hull,), 0.1, np.zeros(3), 1e-5 * np.eye(3), FRICTION, FRICTION)
    assert try_one(body, at([0, 0, 0.01])).outcome == "held"
    assert try_one(replace(body, surface=RayCaster(ring)), at([0, 0, 0.01])).outcome == "misses"


def test_weaker_vacuum_and_slippery_lip_hold_less() -> None:
    body = box(EXTENTS_M, 1.2, FRICTION)
    assert try_one(body, at([0, 0, 0.03])).outcome == "held"
    assert try_one(body, at([0, 0, 0.03]), replace(SETTINGS, force_n=VACUUM_N / 2)).outcome == "slips"
    side = box(EXTENTS_M, 1.2, FRICTION, center_m=(0.03, 0, 0))
    assert try_one(side, at([0.03, 0, 0], FROM_SIDE), quiet()).outcome == "held"
    slippery = replace(quiet(), finger_friction=0.1)
    assert try_one(replace(side, friction_static=0.1), at([0.03, 0, 0], FROM_SIDE), slippery).outcome == "drops"


def test_twist_is_carried_to_friction_times_force_times_radius() -> None:
    # a pair of forces about the axis is a twist alone
    inward = np.array([0.0, 0, -1])
    force = np.array([0.0, 3.0, 0])
    arm = np.array([0.2, 0, 0])
    share = lip_load(force, arm, inward, vacuum_force_n=VACUUM_N, friction=FRICTION, lip_radius_m=RADIUS_M)
    assert share == pytest.approx(np.hypot(3.0, 3.0 * 0.2 / RADIUS_M) / (FRICTION * VACUUM_N))
