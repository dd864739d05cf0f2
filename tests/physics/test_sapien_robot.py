"""A robot in SAPIEN: it goes where it is told, and holds what is between its fingers."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
import sapien
from sapien import physx

from manitwin.geometry.poses import inverse, transform
from manitwin.physics.sapien.robot import SapienRobot
from manitwin.physics.shared_target import SharedTarget
from manitwin.physics.trial import TrialSettings
from manitwin.robots.definition import definition_path, read_definition
from manitwin.robots.grippers.gripper import load_gripper
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.robots.links import read_urdf_links
from manitwin.robots.load import load_robot, shipped_robots
from manitwin.robots.robot import Robot

DT = 1 / 240
FORCE_N = 50.0


def has_jaws(name: str) -> bool:
    """Whether a robot's hand is one of two jaws, by its file: to load all robots while tests are collected takes a second."""
    definition, _ = read_definition(definition_path(name))
    return isinstance(load_gripper(definition.hand.gripper), ParallelGripper)


class Held:
    """A robot at home with a box between its fingers."""

    def __init__(self, robot: Robot, half_m: tuple[float, float, float], mass_kg: float, shift_x_m: float = 0.0):
        self.system = physx.PhysxCpuSystem()
        self.scene = sapien.Scene([self.system])
        self.scene.set_timestep(DT)
        self.robot = SapienRobot(self.scene, robot, finger_force_n=FORCE_N)
        self.box = physx.PhysxRigidDynamicComponent()
        shape = physx.PhysxCollisionShapeBox(np.array(half_m, np.float32), physx.PhysxMaterial(0.5, 0.5, 0.0))
        shape.contact_offset = 0.002
        self.box.attach(shape)
        self.box.set_mass(mass_kg)
        self.box.set_inertia(np.full(3, mass_kg * 1e-3, np.float32))
        self.box.solver_position_iterations = 50
        self.box.disable_gravity = True
        self.entity = sapien.Entity()
        self.entity.add_component(self.box)
        between = transform(translation=np.array([shift_x_m, 0, robot.gripper.tip_depth_m]))
        self.entity.pose = sapien.Pose(self.robot.gripper_pose() @ between)
        self.scene.add_entity(self.entity)
        self.target = SharedTarget(robot.gripper.opening_m, TrialSettings(force_n=FORCE_N, finger_friction=1.0))

    def close(self, seconds: float = 0.8) -> None:
        for _ in range(round(seconds / (4 * DT))):
            self.robot.set_opening_target(2 * self.target.advance_target(self.robot.opening_m() / 2))
            for _ in range(4):
                self.system.step()

    def let_hang(self, seconds: float) -> float:
        """Give the box its weight; returns how far it moves in the hand."""
        before = self.in_hand()
        self.box.disable_gravity = False
        for _ in range(round(seconds / DT)):
            self.system.step()
        return float(np.linalg.norm((self.in_hand() - before)[:3, 3]))

    def in_hand(self) -> np.ndarray:
        return inverse(self.robot.gripper_pose()) @ self.entity.pose.to_transformation_matrix()

    def presses_n(self) -> list[float]:
        """The force along X of the grasp frame by each finger."""
        across = self.robot.gripper_pose()[:3, 0]
        forces = []
        for name in self.robot.robot.finger_links:
            link = self.robot.links[name]
            impulses = [p.impulse for c in self.system.get_contacts() if link in c.bodies for p in c.points]
            forces.append(abs(float(np.sum(impulses, axis=0) @ across)) / DT)
        return forces


@pytest.mark.parametrize("name", shipped_robots())
def test_grasp_frame_is_where_pinocchio_has_it(name: str):
    robot = load_robot(name)
    simulated = SapienRobot(sapien.Scene([physx.PhysxCpuSystem()]), robot)
    model = pin.buildModelFromXML(robot.urdf)
    data = model.createData()
    rng = np.random.default_rng(2)
    for _ in range(3):
        joints = pin.neutral(model)
        arm_rad = []
        for joint in robot.arm_joints:
            at = model.joints[model.getJointId(joint)].idx_q
            joints[at] = rng.uniform(model.lowerPositionLimit[at], model.upperPositionLimit[at])
            arm_rad.append(joints[at])
        hand = robot.open_hand / 2
        for joint, value in zip(robot.finger_joints, hand, strict=True):
            joints[model.joints[model.getJointId(joint)].idx_q] = value
        simulated.put(np.array(arm_rad), hand)
        pin.framesForwardKinematics(model, data, joints)
        tip, finger = (
            data.oMf[model.getFrameId(link)].homogeneous for link in (robot.tip_link, last_finger(simulated))
        )
        assert np.allclose(simulated.tip_pose(), tip, atol=2e-5)
        assert np.allclose(simulated.gripper_pose(), tip @ robot.gripper_to_tip, atol=2e-5)
        assert np.allclose(simulated.joint_positions(), arm_rad, atol=1e-6)
        assert np.allclose(simulated.hand_positions(), hand, atol=1e-6)
        assert np.allclose(
            simulated.links[last_finger(simulated)].entity_pose.to_transformation_matrix(), finger, atol=2e-5
        )


def last_finger(robot: SapienRobot) -> str:
    return [name for name in robot.robot.finger_links if name in robot.links][-1]


@pytest.mark.parametrize("name", [name for name in shipped_robots() if has_jaws(name)])
def test_fingers_meet_a_box_in_the_middle_and_hold_it_through_a_swing(name: str):
    held = Held(load_robot(name), (0.03, 0.02, 0.02), 0.3)
    held.close()
    plus_n, minus_n = held.presses_n()
    assert plus_n == pytest.approx(FORCE_N, rel=0.03) and minus_n == pytest.approx(FORCE_N, rel=0.03)
    assert np.allclose(held.in_hand()[:3, 3], [0, 0, held.robot.robot.gripper.tip_depth_m], atol=5e-4)
    assert held.robot.opening_m() == pytest.approx(0.06, abs=5e-4)
    before, home = held.in_hand(), held.robot.robot.home_rad
    held.box.disable_gravity = False
    worst_rad, swing, rate = 0.0, 0.25, np.pi  # a swing of all joints to 0.25 rad and back in 2 s
    for step in range(480):
        time_s = step * DT
        goal = home + swing * (1 - np.cos(rate * time_s)) / 2
        held.robot.set_targets(goal, np.full_like(home, swing * rate * np.sin(rate * time_s) / 2))
        held.system.step()
        worst_rad = max(worst_rad, float(np.abs(held.robot.joint_positions() - goal).max()))
    assert worst_rad < 0.006
    assert np.linalg.norm((held.in_hand() - before)[:3, 3]) < 0.001


def test_friction_carries_what_coulomb_says_and_no_more():
    # two fingers of 50 N, friction the mean of 1.0 and 0.5 (PhysX combines by average): 75 N, 7.6 kg
    carried, dropped = (Held(load_robot("panda"), (0.03, 0.02, 0.02), mass) for mass in (6.0, 9.5))
    for held in (carried, dropped):
        held.close()
    assert carried.let_hang(0.3) < 0.01
    assert dropped.let_hang(0.3) > 0.03


def test_a_thin_and_light_box_is_held_and_not_run_through():
    held = Held(load_robot("panda"), (0.001, 0.02, 0.02), 0.01, shift_x_m=0.02)
    held.close(1.0)
    assert held.robot.opening_m() == pytest.approx(0.002, abs=5e-4)
    assert abs(held.in_hand()[0, 3]) < 0.001
    assert held.let_hang(0.5) < 0.001


def test_empty_fingers_close_at_the_speed_of_their_target():
    robot = load_robot("panda")
    system = physx.PhysxCpuSystem()
    scene = sapien.Scene([system])
    scene.set_timestep(DT)
    simulated = SapienRobot(scene, robot)
    for step in range(1, 73):
        simulated.set_opening_target(0.08 - 2 * 0.1 * step * DT)
        system.step()
    assert simulated.opening_m() == pytest.approx(0.02, abs=0.003)
    assert np.allclose(simulated.finger_positions_m(), simulated.opening_m() / 2, atol=1e-4)
    assert np.allclose(simulated.joint_positions(), robot.home_rad, atol=1e-3)  # gravity does not act on it


def test_state_beyond_the_limits_is_clipped():
    robot = load_robot("panda")
    simulated = SapienRobot(sapien.Scene([physx.PhysxCpuSystem()]), robot)
    simulated.set_state(np.zeros(7), 0.2)
    assert simulated.joint_positions()[3] == pytest.approx(-0.0698, abs=1e-6)
    assert simulated.opening_m() == pytest.approx(0.08, abs=1e-6)


def test_a_second_robot_reads_no_file():
    robot = load_robot("panda")
    SapienRobot(sapien.Scene([physx.PhysxCpuSystem()]), robot)
    misses = read_urdf_links.cache_info().misses
    SapienRobot(sapien.Scene([physx.PhysxCpuSystem()]), robot)
    assert read_urdf_links.cache_info().misses == misses
