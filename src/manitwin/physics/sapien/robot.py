"""A robot in a SAPIEN scene: an articulation whose arm follows joint targets, and whose two fingers share one target."""

from __future__ import annotations

import numpy as np
import sapien
from sapien import physx

from manitwin.physics.sapien.articulation import LinkContact, build_articulation, drive_joints
from manitwin.physics.sapien.body import CONTACT_OFFSET_M
from manitwin.physics.sapien.hand import MAX_DRIVE_FORCE
from manitwin.physics.sapien.visuals import add_robot_visuals
from manitwin.robots.links import bodies_of_urdf
from manitwin.robots.robot import Robot

# Tracks its trajectories within 0.003 rad, with velocity feed-forward; 50 solver iterations and 50 N held 298 of 304 objects
# on their way where 20 iterations let heavy ones turn between the fingers.
# At 3000 and 300 the hand overshoots by 1.6 mm, where 1 mm is planned for: fingers touched the table in 26 of 1,200 episodes.
ARM_STIFFNESS_NM_RAD, ARM_DAMPING_NM_S_RAD, ARM_TORQUE_LIMIT_NM = 1e4, 1e3, 200.0
FINGER_STIFFNESS_N_M, FINGER_DAMPING_N_S_M = 1e4, 100.0
# What the motors add, as MuJoCo Menagerie has it for the Panda (arm and fingers) and the UR5e; a URDF does not say. Without it
# contacts with fingers of 15 g are soft: 50 N press them 0.7 mm into a brick at 1/120 s and 32 iterations, with it 0.1 mm.
ARM_ARMATURE_KG_M2, FINGER_ARMATURE_KG = 0.1, 0.1
SOLVER_ITERATIONS = 50


class SapienRobot:
    """A robot, its base fixed at the world's origin, at home and with open fingers.

    ``links`` are its bodies by the names of their first links: what is fixed to a link is part of its body.

    Arm positions ``(n,)`` rad are in the order of ``robot.arm_joints``; openings are the distance between the pads (m).
    ``finger_force_n`` is the closing force; the fingers' drives give up at four times that. ``visual`` adds the meshes to
    look at, which needs a scene with a renderer.
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
    ):
        self.robot = robot
        self._scene = scene  # kept: bodies go with their scene
        friction = robot.gripper.finger_friction if finger_friction is None else finger_friction
        bodies, part_of = bodies_of_urdf(robot.urdf, robot.hand_links[0])
        arm_contact = LinkContact(physx.get_default_material())
        pad_contact = LinkContact(physx.PhysxMaterial(friction, friction, 0.0), soft_pad=True)
        self.links = build_articulation(
            scene,
            bodies,
            lambda link: pad_contact if link.name in robot.finger_links else arm_contact,
            contact_offset_m=contact_offset_m,
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
        # bound once: they are called at every step
        self._arm_setters = [(joint.set_drive_target, joint.set_drive_velocity_target) for joint in arm]
        self._finger_setters = [joint.set_drive_target for joint in fingers]
        drive_joints(
            arm,
            stiffness=ARM_STIFFNESS_NM_RAD,
            damping=ARM_DAMPING_NM_S_RAD,
            limit=ARM_TORQUE_LIMIT_NM,
            armature=ARM_ARMATURE_KG_M2,
        )
        drive_joints(
            fingers,
            stiffness=FINGER_STIFFNESS_N_M,
            damping=FINGER_DAMPING_N_S_M,
            limit=MAX_DRIVE_FORCE * finger_force_n,
            armature=FINGER_ARMATURE_KG,
        )
        if visual:
            add_robot_visuals(robot.urdf, self.links, part_of)
        self.set_state(robot.home_rad, robot.gripper.opening_m)

    def set_state(self, positions_rad: np.ndarray, opening_m: float) -> None:
        """Put arm and fingers where they are to be, at rest, with their targets there."""
        state = np.empty(len(self._arm_at) + 2, np.float32)
        state[self._arm_at] = positions_rad
        state[self._fingers_at] = opening_m / 2
        low, high = self.articulation.get_qlimits().T
        self.articulation.set_qpos(np.clip(state, low, high))
        self.articulation.set_qvel(np.zeros_like(state))
        self.set_targets(positions_rad, np.zeros(len(self._arm_at)))
        self.set_opening_target(opening_m)

    def set_targets(self, positions_rad: np.ndarray, velocities_rad_s: np.ndarray) -> None:
        """Set the arm's targets: positions ``(n,)`` and the velocities ``(n,)`` that the drives' dampers follow."""
        for (set_position, set_velocity), position, velocity in zip(
            self._arm_setters, positions_rad.tolist(), velocities_rad_s.tolist(), strict=True
        ):
            set_position(position)
            set_velocity(velocity)

    def set_opening_target(self, opening_m: float) -> None:
        """Set the fingers' one target; one that is less than what is between them presses on it."""
        for set_position in self._finger_setters:
            set_position(opening_m / 2)

    def joint_positions(self) -> np.ndarray:
        """Return the arm's joint positions ``(n,)`` rad."""
        return np.asarray(self.articulation.get_qpos()[self._arm_at], float)

    def finger_positions_m(self) -> np.ndarray:
        """Return each finger's distance ``(2,)`` from where both meet."""
        return np.asarray(self.articulation.get_qpos()[self._fingers_at], float)

    def opening_m(self) -> float:
        """Return the distance between the pads."""
        return float(self.finger_positions_m().sum())

    def tip_pose(self) -> np.ndarray:
        """Return the pose ``(4, 4)`` of the tip's link in the world."""
        return np.asarray((self._tip.entity_pose * self._tip_in_body).to_transformation_matrix(), float)

    def gripper_pose(self) -> np.ndarray:
        """Return the pose ``(4, 4)`` of the grasp frame in the world."""
        return np.asarray((self._tip.entity_pose * self._gripper_in_body).to_transformation_matrix(), float)
