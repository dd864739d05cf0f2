"""The grasp trial against closed forms, in every engine: what must hold holds, what cannot hold fails for the right reason."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.sapien.trial import LEAST_TIMESTEP_S, SapienTrial
from manitwin.physics.trial import GraspTrial
from rigid_boxes import FROM_ABOVE, PANDA, SETTINGS, SLIDE_PEAK_M_S2, above, block, box, try_one

ENGINES = (SapienTrial(), MujocoTrial())
CUBE_M = [0.04, 0.04, 0.04]

pytestmark = pytest.mark.parametrize("engine", ENGINES, ids=lambda engine: engine.name)


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_box_holds_below_and_slips_above_the_weight_that_friction_carries(engine: GraspTrial, friction: float) -> None:
    # 2 mu F = m (g + a), mu the mean of finger and object, a the peak of the upward slide
    limit_kg = 2 * (1 + friction) / 2 * 50 / (9.81 + SLIDE_PEAK_M_S2)
    held = try_one(engine, box(CUBE_M, 0.85 * limit_kg, friction), above([0, 0, 0]))
    heavy = try_one(engine, box(CUBE_M, 1.15 * limit_kg, friction), above([0, 0, 0]))
    assert held.outcome == "held"
    assert held.displacement_m < 0.002
    assert heavy.outcome == "slips"


@pytest.mark.parametrize("force_n", [20.0, 80.0])
def test_limit_grows_with_the_closing_force(engine: GraspTrial, force_n: float) -> None:
    limit_kg = 2 * 0.75 * force_n / (9.81 + SLIDE_PEAK_M_S2)
    settings = replace(SETTINGS, force_n=force_n)
    outcomes = [
        try_one(engine, box(CUBE_M, share * limit_kg), above([0, 0, 0]), settings).outcome for share in (0.85, 1.15)
    ]
    assert outcomes == ["held", "slips"]


def test_box_too_heavy_even_at_rest_drops(engine: GraspTrial) -> None:
    limit_kg = 2 * 0.75 * 50 / 9.81
    assert try_one(engine, box(CUBE_M, 1.2 * limit_kg), above([0, 0, 0])).outcome == "drops"


def test_longer_slides_carry_less_as_their_peak_is_higher(engine: GraspTrial) -> None:
    mass_kg = 0.9 * 2 * 0.75 * 50 / (9.81 + SLIDE_PEAK_M_S2)
    assert mass_kg > 1.1 * 2 * 0.75 * 50 / (9.81 + 2 * SLIDE_PEAK_M_S2)
    assert try_one(engine, box(CUBE_M, mass_kg), above([0, 0, 0])).outcome == "held"
    long = replace(SETTINGS, slide_m=0.2)
    assert try_one(engine, box(CUBE_M, mass_kg), above([0, 0, 0]), long).outcome == "slips"


def test_fingers_press_with_the_closing_force(engine: GraspTrial) -> None:
    for force_n in (20.0, 50.0):
        result = try_one(engine, box(CUBE_M, 0.2), above([0, 0, 0]), replace(SETTINGS, force_n=force_n))
        assert result.finger_forces_n == pytest.approx((force_n, force_n), rel=0.02)


def test_sphere_between_the_pads_holds(engine: GraspTrial) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=1, radius=0.02)
    inertia = 0.4 * 0.1 * 0.02**2 * np.eye(3)
    body = RigidBody((np.array(sphere.vertices),), 0.1, np.zeros(3), inertia, 0.5, 0.5)
    assert try_one(engine, body, above([0, 0, 0])).outcome == "held"


def test_sphere_beyond_the_middle_of_the_pads_is_squeezed_out(engine: GraspTrial) -> None:
    # 17 mm off the centre of 20 mm: the pads' edges meet it at 45 degrees and more, beyond the friction cone of 0.3
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=0.02)
    body = RigidBody((np.array(sphere.vertices),), 0.1, np.zeros(3), 1.6e-5 * np.eye(3), 0.0, 0.0)
    settings = replace(SETTINGS, finger_friction=0.6)
    outcome = try_one(engine, body, above([0, 0, 0.017 + PANDA.pad_half_extents_m[1]]), settings).outcome
    assert outcome in {"misses", "drops"}


def test_grasp_in_the_air_misses(engine: GraspTrial) -> None:
    for tip_m in ([0, 0, 0.1], [0, 0.06, 0], [0.3, 0, 0]):
        result = try_one(engine, box(CUBE_M, 0.2), above(tip_m))
        assert result.outcome == "misses"
        assert result.finger_forces_n == (0.0, 0.0)


def test_walls_outside_the_fingers_are_missed(engine: GraspTrial) -> None:
    walls = tuple(block([x - 0.005, -0.02, -0.02], [x + 0.005, 0.02, 0.02]) for x in (-0.085, 0.085))
    body = replace(box([0.18, 0.04, 0.04], 0.2), hulls=walls)
    assert try_one(engine, body, above([0, 0, 0])).outcome == "misses"


def test_one_finger_alone_holds_nothing(engine: GraspTrial) -> None:
    # a wall that one finger pushes aside, weightless, and that the other one never meets
    wall = block([0.02, -0.02, -0.02], [0.025, 0.02, 0.02])
    body = replace(box([0.005, 0.04, 0.04], 0.2), hulls=(wall,), center_of_mass_m=np.array([0.0225, 0, 0]))
    short = replace(SETTINGS, close_time_s=0.3)
    assert try_one(engine, body, above([0, 0, 0]), short).outcome == "misses"


@pytest.mark.parametrize(
    ("extents_m", "tip_m"),
    [
        (CUBE_M, [0.03, 0, 0]),  # a finger stands in it
        ([0.09, 0.04, 0.04], [0, 0, 0]),  # wider than the stroke: jammed between both fingers
        ([0.03, 0.03, 0.12], [0, 0, 0]),  # reaches into the palm
        ([0.0802, 0.04, 0.04], [0.0006, 0, 0]),  # half a millimetre into one finger
    ],
)
def test_object_that_the_open_hand_overlaps_collides(
    engine: GraspTrial, extents_m: list[float], tip_m: list[float]
) -> None:
    result = try_one(engine, box(extents_m, 0.2), above(tip_m))
    assert result.outcome == "collides"
    assert result.steps == 1


def test_object_that_the_hand_overlaps_with_its_last_hull_only_collides(engine: GraspTrial) -> None:
    in_the_palm = block([-0.01, -0.01, 0.06], [0.01, 0.01, 0.08])
    body = replace(box(CUBE_M, 0.2), hulls=(*box(CUBE_M, 0.2).hulls, in_the_palm))
    assert try_one(engine, box(CUBE_M, 0.2), above([0, 0, 0])).outcome == "held"
    assert try_one(engine, body, above([0, 0, 0])).outcome == "collides"


def test_object_that_the_fingers_tunnel_into_never_counts(engine: GraspTrial) -> None:
    # so light for the force that no solver keeps the fingers out of it: they end inside it, or meet as if it were not there
    mass_kg = {"sapien": 1e-3, "mujoco": 1e-5}[engine.name]
    result = try_one(engine, box(CUBE_M, mass_kg), above([0, 0, 0]), replace(SETTINGS, force_n=1000.0))
    assert result.outcome in {"penetrates", "misses"}
    assert try_one(engine, box(CUBE_M, 0.1), above([0, 0, 0])).outcome == "held", "heavy enough to resist"


def test_box_that_just_fits_is_held(engine: GraspTrial) -> None:
    assert try_one(engine, box([0.079, 0.04, 0.04], 0.2), above([0, 0, 0])).outcome == "held"


def test_mass_properties_are_the_bodys_own_not_those_of_its_hulls(engine: GraspTrial) -> None:
    extents = [0.03, 0.2, 0.03]
    far = try_one(engine, box(extents, 1.5, center_m=(0, 0.09, 0)), above([0, 0, 0]))
    near = try_one(engine, box(extents, 1.5, center_m=(0, 0.09, 0)), above([0, 0.085, 0]))
    assert near.outcome == "held"
    assert far.outcome in {"drops", "slips"}
    assert far.rotation_rad > 0.05


def test_more_inertia_turns_slower_under_the_same_weight(engine: GraspTrial) -> None:
    # gripped off its centre of mass it turns about the pads: the same torque, twenty times the inertia
    light = box([0.03, 0.2, 0.03], 1.5, center_m=(0, 0.09, 0))
    slow = replace(light, inertia_kg_m2=20 * light.inertia_kg_m2)
    short = replace(SETTINGS, lift_time_s=0.2)
    turned = [try_one(engine, body, above([0, 0, 0]), short).steps for body in (light, slow)]
    assert turned[1] > turned[0]


def test_verdict_does_not_depend_on_how_the_object_lies_about_the_vertical(engine: GraspTrial) -> None:
    body = box([0.03, 0.05, 0.04], 0.4)
    turns = [Rotation.from_euler("z", angle, degrees=True).as_matrix() for angle in (0, 35, 90, 200)]
    for turn in turns:
        turned = replace(body, hulls=(body.hulls[0] @ turn.T,), inertia_kg_m2=turn @ body.inertia_kg_m2 @ turn.T)
        result = try_one(engine, turned, above([0, 0, 0], turn @ FROM_ABOVE))
        assert result.outcome == "held"
        assert result.displacement_m < 0.001


def test_same_arguments_give_the_same_bits_in_any_order(engine: GraspTrial) -> None:
    body = box([0.03, 0.09, 0.04], 1.0)
    poses = np.stack([above([0, 0.02, 0]), above([0, -0.03, 0.005]), above([0, 0.04, 0])])
    first = engine.run(body, PANDA, poses, SETTINGS)
    assert first == engine.run(body, PANDA, poses, SETTINGS)
    assert first == engine.run(body, PANDA, poses[::-1], SETTINGS)[::-1]
    assert engine.run(body, PANDA, poses[:0], SETTINGS) == []


def test_no_trial_takes_more_time_than_allowed(engine: GraspTrial) -> None:
    body = box([0.03, 0.05, 0.04], 0.2)
    assert try_one(engine, body, above([0, 0, 0])).outcome == "held"
    settings = replace(SETTINGS, max_steps=200)
    short = try_one(engine, body, above([0, 0, 0]), settings)
    assert short.outcome == "unstable"
    # of the engine's own steps, the same time; a brief trial that tells nothing is run as a whole at the least step
    step_s = 0.001 if engine.name == "mujoco" else LEAST_TIMESTEP_S
    assert short.steps * step_s == pytest.approx(200 * settings.timestep_s, abs=step_s)
