"""The grasp trial against closed forms: what must hold holds, what cannot hold fails, and for the right reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import transform
from manitwin.simulate.gripper import load_gripper
from manitwin.simulate.rigid_body import RigidBody
from manitwin.simulate.sapien_trial import SapienTrial
from manitwin.simulate.trial import TrialResult, TrialSettings

PANDA = load_gripper("panda")
SETTINGS = TrialSettings(force_n=50.0, finger_friction=1.0)
FROM_ABOVE = np.diag([1.0, -1.0, -1.0])
PEAK_ACCELERATION_M_S2 = 10 / np.sqrt(3) * 0.1 / 0.4**2  # of a quintic path of 0.1 m in 0.4 s


def above(tip_m: list[float], rotation: np.ndarray = FROM_ABOVE) -> np.ndarray:
    return transform(rotation, np.array(tip_m) - rotation[:, 2] * PANDA.tip_depth_m)


def box(extents_m: list[float], mass_kg: float, friction: float = 0.5, center_m: tuple = (0, 0, 0)) -> RigidBody:
    x, y, z = np.square(extents_m)
    inertia = mass_kg / 12 * np.diag([y + z, x + z, x + y])
    hull = np.array(trimesh.creation.box(extents_m).vertices)
    return RigidBody((hull,), mass_kg, np.array(center_m, float), inertia, friction, friction)


def try_one(body: RigidBody, pose: np.ndarray, settings: TrialSettings = SETTINGS) -> TrialResult:
    return SapienTrial().run(body, PANDA, pose[None], settings)[0]


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_box_holds_below_and_slips_above_the_weight_that_friction_carries(friction: float) -> None:
    # 2 mu F = m (g + a), mu the mean of finger and object
    limit_kg = 2 * (1 + friction) / 2 * 50 / (9.81 + PEAK_ACCELERATION_M_S2)
    held = try_one(box([0.04, 0.04, 0.04], 0.85 * limit_kg, friction), above([0, 0, 0]))
    heavy = try_one(box([0.04, 0.04, 0.04], 1.15 * limit_kg, friction), above([0, 0, 0]))
    assert held.outcome == "held"
    assert held.displacement_m < 0.002
    assert heavy.outcome == "slips"


def test_box_too_heavy_even_at_rest_drops() -> None:
    limit_kg = 2 * 0.75 * 50 / 9.81
    assert try_one(box([0.04, 0.04, 0.04], 1.2 * limit_kg), above([0, 0, 0])).outcome == "drops"


def test_fingers_press_with_the_closing_force() -> None:
    for force_n in (20.0, 50.0):
        result = try_one(box([0.04, 0.04, 0.04], 0.2), above([0, 0, 0]), replace(SETTINGS, force_n=force_n))
        assert result.finger_forces_n == pytest.approx((force_n, force_n), rel=0.02)


def test_sphere_between_the_pads_holds() -> None:
    sphere = trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    inertia = 0.4 * 0.1 * 0.02**2 * np.eye(3)
    body = RigidBody((np.array(sphere.vertices),), 0.1, np.zeros(3), inertia, 0.5, 0.5)
    assert try_one(body, above([0, 0, 0])).outcome == "held"


def test_grasp_in_the_air_misses() -> None:
    assert try_one(box([0.04, 0.04, 0.04], 0.2), above([0, 0, 0.1])).outcome == "misses"


def test_walls_outside_the_fingers_are_missed() -> None:
    walls = [trimesh.creation.box([0.01, 0.04, 0.04]).vertices + np.array([x, 0, 0]) for x in (-0.085, 0.085)]
    body = replace(box([0.18, 0.04, 0.04], 0.2), hulls=tuple(walls))
    assert try_one(body, above([0, 0, 0])).outcome == "misses"


def test_open_hand_in_the_object_collides() -> None:
    assert try_one(box([0.04, 0.04, 0.04], 0.2), above([0.03, 0, 0])).outcome == "collides"
    assert try_one(box([0.09, 0.04, 0.04], 0.2), above([0, 0, 0])).outcome == "collides"
    assert try_one(box([0.03, 0.03, 0.12], 0.2), above([0, 0, 0])).outcome == "collides"


def test_box_that_just_fits_is_held() -> None:
    assert try_one(box([0.079, 0.04, 0.04], 0.2), above([0, 0, 0])).outcome == "held"


def test_mass_properties_are_the_bodys_own_not_those_of_its_hulls() -> None:
    extents = [0.03, 0.2, 0.03]
    far = try_one(box(extents, 1.5, center_m=(0, 0.09, 0)), above([0, 0, 0]))
    near = try_one(box(extents, 1.5, center_m=(0, 0.09, 0)), above([0, 0.085, 0]))
    assert near.outcome == "held"
    assert far.outcome in {"drops", "slips"}
    assert far.rotation_rad > 0.05


def test_verdict_does_not_depend_on_how_the_object_lies_about_the_vertical() -> None:
    body = box([0.03, 0.05, 0.04], 0.4)
    turns = [Rotation.from_euler("z", angle, degrees=True).as_matrix() for angle in (0, 35, 90, 200)]
    for turn in turns:
        turned = replace(body, hulls=(body.hulls[0] @ turn.T,), inertia_kg_m2=turn @ body.inertia_kg_m2 @ turn.T)
        result = try_one(turned, above([0, 0, 0], turn @ FROM_ABOVE))
        assert result.outcome == "held"
        assert result.displacement_m < 0.001


def test_same_arguments_give_the_same_bits_in_any_order() -> None:
    body = box([0.03, 0.09, 0.04], 1.0)
    poses = np.stack([above([0, 0.02, 0]), above([0, -0.03, 0.005]), above([0, 0.04, 0])])
    first = SapienTrial().run(body, PANDA, poses, SETTINGS)
    assert first == SapienTrial().run(body, PANDA, poses, SETTINGS)
    assert first == SapienTrial().run(body, PANDA, poses[::-1], SETTINGS)[::-1]


def test_no_trial_takes_more_steps_than_allowed() -> None:
    body = box([0.03, 0.05, 0.04], 0.2)
    assert try_one(body, above([0, 0, 0])).steps <= SETTINGS.max_steps
    short = try_one(body, above([0, 0, 0]), replace(SETTINGS, max_steps=300))
    assert short.outcome == "unstable"
    assert short.steps == 300
