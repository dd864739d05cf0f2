"""Robot in a SAPIEN scene: an articulation whose arm and hand follow joint targets; two jaws share one target."""

from __future__ import annotations

import numpy as np
import sapien
from sapien import physx

from manitwin.physics.sapien.articulation import LinkContact, build_articulation, drive_joints
from manitwin.physics.sapien.body import CONTACT_OFFSET_M
from manitwin.physics.sapien.fingers import finger_collision_groups
from manitwin.physics.sapien.hand import MAX_DRIVE_FORCE
from manitwin.physics.sapien.shapes import HAND_COLLISION_GROUPS, SECOND_ARM_COLLISION_GROUPS
from manitwin.physics.sapien.visuals import add_robot_visuals
from manitwin.robots.grippers.multi_finger import MultiFingerGripper
from manitwin.robots.grippers.suction import SuctionGripper
from manitwin.robots.links import Link, read_rigid_bodies
from manitwin.robots.robot import Robot

# Trajectories are tracked within 0.003 rad with velocity feed-forward. 50 solver iterations and 50 N held 298 of 304 objects
# in transit, while 20 iterations let heavy ones turn between the fingers. With gains of 3000 and 300 the hand overshoots by
# 1.6 mm, where the plan allows 1 mm: fingers touched the table in 26 of 1,200 episodes.
ARM_STIFFNESS_NM_RAD, ARM_DAMPING_NM_S_RAD, ARM_TORQUE_LIMIT_NM = 1e4, 1e3, 200.0
FINGER_STIFFNESS_N_M, FINGER_DAMPING_N_S_M = 1e4, 100.0
# Armature inertia of the motors as in MuJoCo Menagerie for the Panda (arm and fingers) and the UR5e; a URDF does not state
# it. Without it contacts of fingers of 15 g are soft: 50 N press them 0.7 mm into a brick at 1/120 s and 32 iterations, with
# it 0.1 mm.
ARM_ARMATURE_KG_M2, FINGER_ARMATURE_KG = 0.1, 0.1
# Spring of the plunger: half compressed, as in a grasp, the lip presses with 2 N. Under vacuum the plunger is blocked;
# otherwise it would extend to its stop with any object heavier than 0.2 kg, and jerk it up.
PLUNGER_STIFFNESS_N_M, PLUNGER_DAMPING_N_S_M, PLUNGER_FORCE_N, PLUNGER_ARMATURE_KG = 200.0, 5.0, 200.0, 0.02
BLOCKED_STIFFNESS_N_M = 2e4
SOLVER_ITERATIONS = 50


class SapienRobot:
    """A single-arm robot with its base at its URDF's root (the world's origin), initially at home with open hand.

    ``links`` are its bodies by the names of their first links; links fixed to a link are part of its body. Arm positions
    ``(n,)`` rad are in the order of ``robot.arm_joints``; openings are the distance between the pads (m).

    ``finger_force_n`` is the closing force; the limit of the finger drives is four times that. ``visual`` adds visual meshes,
    which needs a scene with a renderer. ``second``: it is the second of two arms, which collides with the first. Raises
    ValueError for a two-arm robot.
    """

    def __init__(
        self,
        scene: sapien.Scene,
        robot: Robot,
        *,
        finger_force_n: float = 50.0,
        finger_friction: float | None = None,
        solver_iterations: int = SOLVER_ITERATIONS,
        contact_offset_m: float = CONTACT_OFFSET_M,
        visual: bool = False,
        second: bool = False,
    ):
        if robot.arms:
            raise ValueError(f"{robot.name} has two arms; put each of its ``arms`` into the scene")
        self.robot = robot
        self._scene = scene  # kept alive: bodies are destroyed with their scene
        friction = robot.gripper.finger_friction if finger_friction is None else finger_friction
        bodies, part_of = read_rigid_bodies(robot.urdf, robot.hand_links[0])
        pads = physx.PhysxMaterial(friction, friction, 0.0)
        self.links = build_articulation(
            scene, bodies, lambda link: _contact_of(robot, link, pads, second=second), contact_offset_m=contact_offset_m
        )
        tip_body, tip_to_body = part_of[robot.tip_link]
        self._tip, self._tip_in_body = self.links[tip_body], sapien.Pose(tip_to_body)
        self._gripper_in_body = sapien.Pose(tip_to_body @ robot.gripper_to_tip)
        self.articulation = self._tip.articulation
        self.articulation.set_solver_position_iterations(solver_iterations)
        self.articulation.set_solver_velocity_iterations(1)
        self.articulation.set_sleep_threshold(0.0)
        joints = {joint.name: (index, joint) for index, joint in enumerate(self.articulation.active_joints)}
        self._arm_at = np.array([joints[name][0] for name in robot.arm_joints])
        self._fingers_at = np.array([joints[name][0] for name in robot.finger_joints])
        arm = [joints[name][1] for name in robot.arm_joints]
        fingers = [joints[name][1] for name in robot.finger_joints]
        self._finger_joints = fingers
        # bound methods, because they are called at every step
        self._arm_setters = [(joint.set_drive_target, joint.set_drive_velocity_target) for joint in arm]
        self._finger_setters = [joint.set_drive_target for joint in fingers]
        drive_joints(
            arm,
            stiffness=ARM_STIFFNESS_NM_RAD,
            damping=ARM_DAMPING_NM_S_RAD,
            limit=ARM_TORQUE_LIMIT_NM,
            armature=ARM_ARMATURE_KG_M2,
        )
        _drive_hand(robot, fingers, finger_force_n)
        if visual:
            add_robot_visuals(robot.urdf, self.links, part_of)
        self.put(robot.home_rad, robot.open_hand)
        if isinstance(robot.gripper, SuctionGripper):
            self.set_hand_targets(np.array([robot.gripper.reach_m]))  # the plunger's spring extends the lip

    def set_state(self, positions_rad: np.ndarray, opening_m: float) -> None:
        """Set arm positions ``(n,)`` rad and the jaws' opening (m), at rest, with the targets there."""
        self.put(positions_rad, np.full(2, opening_m / 2))

    def put(self, positions_rad: np.ndarray, hand: np.ndarray) -> None:
        """Set positions of arm ``(n,)`` and hand joints ``(J,)``, clipped to their limits, at rest, with the targets there."""
        state = np.empty(len(self._arm_at) + len(self._fingers_at), np.float32)
        state[self._arm_at] = positions_rad
        state[self._fingers_at] = hand
        low, high = self.articulation.get_qlimits().T
        self.articulation.set_qpos(np.clip(state, low, high))
        self.articulation.set_qvel(np.zeros_like(state))
        self.set_targets(positions_rad, np.zeros(len(self._arm_at)))
        self.set_hand_targets(hand)

    def set_targets(self, positions_rad: np.ndarray, velocities_rad_s: np.ndarray) -> None:
        """Set the arm's targets: positions ``(n,)`` rad and feed-forward velocities ``(n,)`` rad/s."""
        for (set_position, set_velocity), position, velocity in zip(
            self._arm_setters, positions_rad.tolist(), velocities_rad_s.tolist(), strict=True
        ):
            set_position(position)
            set_velocity(velocity)

    def set_opening_target(self, opening_m: float) -> None:
        """Set the jaws' common target; a target below the object's width presses on it."""
        for set_position in self._finger_setters:
            set_position(opening_m / 2)

    def set_hand_targets(self, targets: np.ndarray) -> None:
        """Set the targets of the hand's joints ``(J,)``, rad or m, in the order of ``robot.finger_joints``."""
        for set_position, target in zip(self._finger_setters, targets.tolist(), strict=True):
            set_position(target)

    @property
    def limits_rad(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper limits ``(n,)`` of the arm's joints."""
        low, high = np.asarray(self.articulation.get_qlimits(), float)[self._arm_at].T
        return low, high

    def joint_positions(self) -> np.ndarray:
        """Return the arm's joint positions ``(n,)`` rad."""
        return np.asarray(self.articulation.get_qpos()[self._arm_at], float)

    def block_plunger(self, blocked: bool) -> None:
        """Hold a cup's plunger in place, or release its spring."""
        assert isinstance(self.robot.gripper, SuctionGripper), "cups have plungers"
        here, out = self.hand_positions(), np.array([self.robot.gripper.reach_m])
        self.set_hand_targets(here if blocked else out)
        _drive_plunger(self._finger_joints, BLOCKED_STIFFNESS_N_M if blocked else PLUNGER_STIFFNESS_N_M)

    def hand_positions(self) -> np.ndarray:
        """Return the positions ``(J,)`` of the hand's joints, rad or m."""
        return np.asarray(self.articulation.get_qpos()[self._fingers_at], float)

    def finger_positions_m(self) -> np.ndarray:
        """Return each jaw's distance ``(2,)`` m from the closed position."""
        return self.hand_positions()

    def opening_m(self) -> float:
        """Return the distance between the pads of jaws."""
        return float(self.finger_positions_m().sum())

    def tip_pose(self) -> np.ndarray:
        """Return the pose ``(4, 4)`` of the tip link in the world."""
        return np.asarray((self._tip.entity_pose * self._tip_in_body).to_transformation_matrix(), float)

    def gripper_pose(self) -> np.ndarray:
        """Return the pose ``(4, 4)`` of the grasp frame in the world."""
        return np.asarray((self._tip.entity_pose * self._gripper_in_body).to_transformation_matrix(), float)


def _contact_of(robot: Robot, link: Link, pads: physx.PhysxMaterial, *, second: bool) -> LinkContact:
    """Return a link's contact properties: pads are soft, and fingers of a multi-finger hand collide with each other."""
    groups: tuple[int, ...] = SECOND_ARM_COLLISION_GROUPS if second else HAND_COLLISION_GROUPS
    if isinstance(robot.gripper, MultiFingerGripper):
        owners = {
            each.name: owner for each, owner in zip(robot.gripper.links, robot.gripper.finger_of_link, strict=True)
        }
        groups = finger_collision_groups(int(owners.get(link.name, -1)))  # links of the arm have the palm's groups
    if link.name in robot.finger_links:
        return LinkContact(pads, soft_pad=True, collision_groups=groups)
    return LinkContact(physx.get_default_material(), collision_groups=groups)


def _drive_plunger(joints: list[physx.PhysxArticulationJoint], stiffness_n_m: float) -> None:
    damping = PLUNGER_DAMPING_N_S_M * (stiffness_n_m / PLUNGER_STIFFNESS_N_M) ** 0.5  # keeps the damping ratio
    drive_joints(joints, stiffness=stiffness_n_m, damping=damping, limit=PLUNGER_FORCE_N, armature=PLUNGER_ARMATURE_KG)


def _drive_hand(robot: Robot, joints: list[physx.PhysxArticulationJoint], force_n: float) -> None:
    gripper = robot.gripper
    if isinstance(gripper, SuctionGripper):
        _drive_plunger(joints, PLUNGER_STIFFNESS_N_M)
        return
    if isinstance(gripper, MultiFingerGripper):
        drive, strength = gripper.drive, force_n / gripper.force_n
        values = drive.stiffness_nm_rad, drive.damping_nm_s_rad, strength * drive.torque_limit_nm, drive.armature_kg_m2
    else:
        values = FINGER_STIFFNESS_N_M, FINGER_DAMPING_N_S_M, MAX_DRIVE_FORCE * force_n, FINGER_ARMATURE_KG
    stiffness, damping, limit, armature = values
    drive_joints(joints, stiffness=stiffness, damping=damping, limit=limit, armature=armature)
