"""What two pads bear of weight and slides, in closed form, and what both engines make of more than that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.grasp_filters import INSET, PadContacts, pad_contacts
from manitwin.physics.mujoco.trial import MujocoTrial
from manitwin.physics.pad_loads import PAD_ARM_M, PressedPads, jams, load_share, torque_ratio
from manitwin.physics.sapien.trial import SapienTrial
from manitwin.physics.trial import GraspTrial
from manitwin.physics.trial_recording import RecordingTrial
from manitwin.robots.grippers.gripper import require_kind
from manitwin.robots.grippers.parallel import ParallelGripper
from rigid_boxes import PANDA, SETTINGS, above, block, box, try_one

JAWS = require_kind(PANDA, ParallelGripper)
FRICTION, FORCE_N = 0.75, 50.0  # the mean of 0.5 and the fingertips' 1.0
LOAD_M_S2 = (9.81, 3.6)  # weight, and the peak of a slide


def touched(body: RigidBody, pose: np.ndarray) -> PadContacts:
    return pad_contacts(JAWS, pose[None], RayCaster.of_hulls(body.hulls), body.center_of_mass_m)


def share(body: RigidBody, pose: np.ndarray) -> float:
    pads = touched(body, pose).pads
    said = load_share(pads, pose[None], body.center_of_mass_m, mass_kg=body.mass_kg, force_n=FORCE_N, friction=FRICTION)
    return float(said[0])


def test_torque_ratio_is_one_where_friction_just_holds_the_weight() -> None:
    # m (g + a) l = 2 mu F r: 0.05 m from the axis, 2 * 0.75 * 50 N * 7 mm
    mass_kg = 2 * FRICTION * FORCE_N * PAD_ARM_M / (0.05 * sum(LOAD_M_S2))
    assert torque_ratio(np.array([0.05]), mass_kg=mass_kg, force_n=FORCE_N, friction=FRICTION) == pytest.approx(1)


@pytest.mark.parametrize("roll", [0, 1, 2, 3])
def test_moment_about_the_closing_axis_is_borne_by_friction_alone(roll: int) -> None:
    # beside the pads across the closing axis, whichever way up: no moment about the two others
    turned = np.linalg.matrix_power(np.array([[1.0, 0, 0], [0, 0, -1.0], [0, 1.0, 0]]), roll) @ np.diag([1.0, -1, -1])
    body = box([0.02, 0.04, 0.04], 0.1, center_m=(0, 0.1, 0))
    force = 0.1 * sum(LOAD_M_S2) / (2 * FRICTION * FORCE_N)
    moment = 0.1 * sum(LOAD_M_S2) * 0.1 / (2 * FRICTION * FORCE_N * PAD_ARM_M)
    assert share(body, above([0, 0, 0], turned)) == pytest.approx(np.hypot(force, moment))


@pytest.mark.parametrize("side", [-1, 1])
@pytest.mark.parametrize("width_m", [0.005, 0.03])
def test_moment_across_the_closing_axis_is_borne_by_opposite_ends_of_the_pads_and_by_the_width(
    side: int, width_m: float
) -> None:
    mass_kg, beside_m = 0.3, 0.1
    body = box([width_m, 0.04, 0.04], mass_kg, center_m=(side * beside_m, 0, 0))
    limit_nm = FORCE_N * (2 * INSET * JAWS.pad_half_extents_m[1] + FRICTION * width_m)
    force = mass_kg * sum(LOAD_M_S2) / (2 * FRICTION * FORCE_N)
    expected = np.hypot(force, mass_kg * sum(LOAD_M_S2) * beside_m / limit_nm)
    assert share(body, above([0, 0, 0])) == pytest.approx(expected)


def test_pads_that_touch_with_a_quarter_of_their_area_bear_half_the_torque() -> None:
    body, pose = box([0.02, 0.04, 0.04], 0.1, center_m=(0, 0.1, 0)), above([0, 0, 0])
    whole = touched(body, pose).pads
    quarter = replace(whole, touching=whole.touching / 4)

    def torque(pads: PressedPads) -> float:
        loads = {"mass_kg": body.mass_kg, "force_n": FORCE_N, "friction": FRICTION}
        said = load_share(pads, pose[None], body.center_of_mass_m, **loads, flat=False)
        return float(np.sqrt(said[0] ** 2 - force**2))

    force = body.mass_kg * sum(LOAD_M_S2) / (2 * FRICTION * FORCE_N)
    assert whole.touching[0] == 1
    assert torque(quarter) == pytest.approx(2 * torque(whole))


def test_pads_that_touch_at_one_end_bear_a_moment_one_way_only() -> None:
    # a wall with a step on each side: the +X pad (object's -X) presses at its far end, the -X pad at its near one
    hulls = (
        block([-0.003, -0.02, -0.015], [0.003, 0.02, 0.015]),
        block([0.003, -0.02, -0.009], [0.009, 0.02, -0.003]),
        block([-0.009, -0.02, 0.003], [-0.003, 0.02, 0.009]),
    )

    def stepped(beside_m: float) -> float:
        body = box([0.01, 0.04, 0.03], 0.1, center_m=(beside_m, 0, 0))
        return share(RigidBody(hulls, 0.1, body.center_of_mass_m, body.inertia_kg_m2, 0.5, 0.5), above([0, 0, 0]))

    assert max(stepped(0.1), stepped(-0.1)) > 3 * min(stepped(0.1), stepped(-0.1))


@pytest.mark.parametrize("engine", [SapienTrial(), MujocoTrial()], ids=["sapien", "mujoco"])
@pytest.mark.parametrize("width_m", [0.005, 0.03])
def test_what_tips_out_of_the_pads_has_no_lever_but_too_large_a_share(engine: GraspTrial, width_m: float) -> None:
    """A weight beside the pads along the closing axis, as of a vessel that hangs by its wall: the axis passes through it."""
    pose = above([0, 0, 0])
    bodies = {beside_m: box([width_m, 0.04, 0.04], 0.6, center_m=(beside_m, 0, 0)) for beside_m in (0.06, 0.08, 0.3)}
    assert all(touched(body, pose).lever_m[0] < 1e-9 for body in bodies.values())
    assert share(bodies[0.06], pose) < share(bodies[0.08], pose) < 0.7
    assert share(bodies[0.3], pose) > 1.2
    for beside_m, body in bodies.items():
        result = try_one(engine, body, pose)
        assert result.outcome == ("drops" if beside_m == 0.3 else "held")
        assert beside_m == 0.3 or result.displacement_m < 0.0005


@pytest.mark.parametrize("engine", [SapienTrial(), MujocoTrial()], ids=["sapien", "mujoco"])
@pytest.mark.parametrize(("width_m", "turns_flat"), [(0.015, True), (0.06, False)])
def test_pads_turn_flat_what_is_thinner_than_pad_over_friction_and_jam_on_the_rest(
    engine: RecordingTrial, width_m: float, turns_flat: bool
) -> None:
    """A plate turned by t between pads of width d is w + d t wide: closing gives 2 F d/2 and costs 2 mu F w/2 for each radian."""
    pad_m = 2 * JAWS.pad_half_extents_m[0]
    assert jams(np.array([width_m]), pad_m, FRICTION)[0] != turns_flat
    turned = above([0, 0, 0.038])
    turned[:3, :3] = turned[:3, :3] @ Rotation.from_euler("z", 4, degrees=True).as_matrix()
    recording = engine.record(box([width_m, 0.1, 0.1], 0.7), PANDA, turned, SETTINGS)
    last = max(number for number, phase in enumerate(recording.phases) if phase == "close")
    left_deg = np.degrees(np.arccos(min(1.0, float(np.abs(recording.object_to_hand[last, 0, :3]).max()))))
    assert left_deg < 1 if turns_flat else left_deg > 3
