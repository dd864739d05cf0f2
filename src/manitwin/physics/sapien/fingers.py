"""Multi-finger hand in SAPIEN: an articulation with a stationary palm, and its grasp trial.

Each finger closes along its own straight line in joint space and stops when one of its joints presses. Its targets then stay
fixed, so that the drives' stiffness resists forces on the object. (Fingers driven by constant torques have no lateral
stiffness, see ``shared_target.SharedTarget``.)
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import inverse
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.sapien.articulation import LinkContact, build_articulation, drive_joints
from manitwin.physics.sapien.hand_scene import HandScene
from manitwin.physics.sapien.shapes import COOKED, HullShapes
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.physics.trial_phases import run_phases
from manitwin.physics.trial_recording import TrialRecorder, TrialRecording
from manitwin.robots.grippers.gripper import Gripper, require_kind
from manitwin.robots.grippers.multi_finger import MultiFingerGripper

# Shapes with a common bit in the third word do not collide. The palm shares one bit with the thumb and one with the other
# fingers; thumb and fingers have none in common, so that they collide with each other.
PALM_BITS, THUMB_BITS, FINGER_BITS = 0b11, 0b01, 0b10
THUMB = 0


class ArticulatedTrial:
    """Grasp trial of a multi-finger hand in SAPIEN on the CPU, one grasp at a time."""

    name = "sapien"

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)``; ``joints_rad (N, 2, J)`` are joints before closing and closing goal.

        The ratio of ``settings.force_n`` to the gripper's own force scales the torques with which its joints press.
        """
        hand = require_kind(gripper, MultiFingerGripper)
        with COOKED.lent([body.hulls]) as (shapes,):
            return [
                _try_one(body, shapes, hand, pose, joints, settings)
                for pose, joints in zip(gripper_to_object, _required(joints_rad, hand), strict=True)
            ]

    def record(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> TrialRecording:
        """Try one grasp ``gripper_to_object (4, 4)`` with ``joints_rad (2, J)`` as ``run`` does, and return its states."""
        hand, recorder = require_kind(gripper, MultiFingerGripper), TrialRecorder()
        joints = _required(joints_rad, hand)
        with COOKED.lent([body.hulls]) as (shapes,):
            result = _try_one(body, shapes, hand, gripper_to_object, joints, settings, recorder)
        return recorder.recording(result, inverse(gripper_to_object), joints[0])


def _required(joints_rad: np.ndarray | None, hand: MultiFingerGripper) -> np.ndarray:
    if joints_rad is None:
        raise ValueError(f"a grasp of {hand.name} needs its joints before closing and those to close to")
    return joints_rad


def _try_one(
    body: RigidBody,
    shapes: HullShapes,
    hand: MultiFingerGripper,
    gripper_to_object: np.ndarray,
    joints_rad: np.ndarray,
    settings: TrialSettings,
    recorder: TrialRecorder | None = None,
) -> TrialResult:
    object_to_hand = inverse(gripper_to_object)
    scene = HandScene(
        body, shapes, object_to_hand, settings, lambda scene: FingeredHand(scene, hand, joints_rad, settings)
    )
    watch = None if recorder is None else recorder.watch(scene)
    return run_phases(scene, object_to_hand[:3, :3], settings, watch)


class FingerClosing:
    """Progress of each finger along its straight line in joint space; a finger stops when one of its joints presses."""

    def __init__(
        self,
        gripper: MultiFingerGripper,
        start_rad: np.ndarray,
        goal_rad: np.ndarray,
        order: Sequence[int],
        *,
        strength: float,
        frame_s: float,
    ):
        """Take the start and goal ``(J,)`` rad; ``order`` gives the joints' numbers in the gripper's file.

        ``strength`` is the share of the gripper's own torque with which joints press.
        """
        self._press_nm, self._stiffness = strength * gripper.drive.press_nm, gripper.drive.stiffness_nm_rad
        self.target_rad, self._start, self._way = start_rad, start_rad, goal_rad - start_rad
        owners = zip(gripper.links, gripper.finger_of_link, strict=True)
        of_joint = {link.joint: owner for link, owner in owners}
        self._finger_of_joint = np.array([of_joint[gripper.joints[number]] for number in order])
        fingers, step_rad = len(gripper.fingers), gripper.drive.speed_rad_s * frame_s
        way_rad = np.array([np.abs(self._way)[self._finger_of_joint == finger].max() for finger in range(fingers)])
        self._step, self._come = step_rad / np.maximum(way_rad, step_rad), np.zeros(fingers)
        self.all_press = False

    def advance_targets(self, positions_rad: np.ndarray) -> np.ndarray:
        """Advance the targets of all fingers that do not press yet by one frame, and return all targets ``(J,)``."""
        torque_nm = np.abs(self._stiffness * (self.target_rad - positions_rad))
        presses = [
            torque_nm[self._finger_of_joint == finger].max() >= self._press_nm for finger in range(len(self._come))
        ]
        for finger, stays in enumerate(presses):
            if not stays:
                self._come[finger] = min(1.0, self._come[finger] + self._step[finger])
        self.all_press = all(stays or come == 1.0 for stays, come in zip(presses, self._come, strict=True))
        self.target_rad = self._start + self._come[self._finger_of_joint] * self._way
        return self.target_rad


class FingeredHand:
    """Multi-finger hand for the trial (``SapienHand``): its articulation and the closing progress of its fingers."""

    is_ahead = False

    def __init__(
        self, scene: sapien.Scene, gripper: MultiFingerGripper, joints_rad: np.ndarray, settings: TrialSettings
    ):
        """Put the open hand into the scene."""
        drive = gripper.drive
        strength = settings.force_n / gripper.force_n
        material = physx.PhysxMaterial(settings.finger_friction, settings.finger_friction, 0.0)
        finger_of = {link.name: finger for link, finger in zip(gripper.links, gripper.finger_of_link, strict=True)}
        self._links = build_articulation(
            scene,
            gripper.links,
            lambda link: LinkContact(
                material, soft_pad=True, collision_groups=finger_collision_groups(finger_of[link.name])
            ),
            contact_offset_m=settings.contact_offset_m,
            root_to_scene=gripper.root_to_gripper,
        )
        self.articulation = next(iter(self._links.values())).articulation
        self.articulation.set_solver_position_iterations(settings.solver_iterations)
        self.articulation.set_solver_velocity_iterations(1)
        self._joints = self.articulation.active_joints
        drive_joints(
            self._joints,
            stiffness=drive.stiffness_nm_rad,
            damping=drive.damping_nm_s_rad,
            limit=strength * drive.torque_limit_nm,
            armature=drive.armature_kg_m2,
        )
        order = [gripper.joints.index(joint.name) for joint in self._joints]
        self._place_of = np.argsort(order)
        start, goal = joints_rad[:, order]
        self._closing = FingerClosing(gripper, start, goal, order, strength=strength, frame_s=settings.frame_s)
        self.articulation.set_qpos(start.astype(np.float32))
        self._drive_to(start)
        self._owner = {link.entity.per_scene_id: finger_of[name] for name, link in self._links.items()}

    def joints(self) -> np.ndarray:
        """Return the joint positions (rad), in the order of the gripper's file."""
        return np.asarray(self.articulation.get_qpos(), float)[self._place_of]

    def squeeze(self) -> None:
        """Advance the targets of all fingers that do not press yet."""
        self._drive_to(self._closing.advance_targets(np.asarray(self.articulation.get_qpos())))

    def presses(self) -> bool:
        """Tell whether every finger presses or has reached its goal."""
        return self._closing.all_press

    def pressing_n(self, pushes: list[tuple[int, np.ndarray]]) -> tuple[float, ...]:
        """Return the contact forces (N) on the object of thumb and palm together, and of the other fingers together."""
        forces = [0.0, 0.0]
        for other, push_n in pushes:
            if other in self._owner:
                forces[0 if self._owner[other] <= THUMB else 1] += float(np.linalg.norm(push_n))
        return tuple(forces)

    def _drive_to(self, joints_rad: np.ndarray) -> None:
        for joint, target in zip(self._joints, joints_rad, strict=True):
            joint.set_drive_target(float(target))


def finger_collision_groups(finger: int) -> tuple[int, ...]:
    """Return the SAPIEN collision groups of a finger's links, by its number: 0 the thumb, -1 the palm."""
    return (1, 1, PALM_BITS if finger < 0 else THUMB_BITS if finger == THUMB else FINGER_BITS, 0)
