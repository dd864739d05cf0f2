"""A hand with many joints in SAPIEN: an articulation whose palm stays in place, and the trial of its grasps.

Each finger closes along its own straight line of joints and stops where a joint presses; from then on its targets stay:
the drives' stiffness then resists what pulls at the object. (Fingers that are driven with constant torques have no
lateral stiffness, see ``shared_target``.)
"""

from __future__ import annotations

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import inverse
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.kept_for_hulls import KeptForHulls
from manitwin.physics.sapien.body import hull_shapes
from manitwin.physics.sapien.hand import MIN_PATCH_RADIUS_M, PATCH_RADIUS_M
from manitwin.physics.sapien.links import link_shape, set_joint_and_mass
from manitwin.physics.sapien.scene import HandScene
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.physics.trial_phases import run_phases
from manitwin.robots.grippers.gripper import Gripper, of_kind
from manitwin.robots.grippers.multi_finger import MultiFingerGripper

# Shapes with a common bit in the third word do not collide: the palm shares one with the thumb and one with the other
# fingers; thumb and fingers have none in common, so that they stop one another.
PALM_BITS, THUMB_BITS, FINGER_BITS = 0b11, 0b01, 0b10
THUMB = 0


class ArticulatedTrial:
    """Try grasps of a hand with many joints one by one in SAPIEN on the CPU."""

    name = "sapien"

    def __init__(self) -> None:
        self._shapes = KeptForHulls(hull_shapes)

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)`` with ``joints_rad (N, 2, J)`` before closing and to close to.

        ``settings.force_n`` over the gripper's own scales what its joints press with.
        """
        hand = of_kind(gripper, MultiFingerGripper)
        if joints_rad is None:
            raise ValueError(f"a grasp of {hand.name} needs its joints before closing and those to close to")
        shapes = self._shapes(body.hulls)
        return [
            _try_one(body, shapes, hand, pose, joints, settings)
            for pose, joints in zip(gripper_to_object, joints_rad, strict=True)
        ]


def _try_one(
    body: RigidBody,
    shapes: list[physx.PhysxCollisionShapeConvexMesh],
    hand: MultiFingerGripper,
    gripper_to_object: np.ndarray,
    joints_rad: np.ndarray,
    settings: TrialSettings,
) -> TrialResult:
    object_to_hand = inverse(gripper_to_object)
    scene = HandScene(
        body, shapes, object_to_hand, settings, lambda scene: FingeredHand(scene, hand, joints_rad, settings)
    )
    return run_phases(scene, object_to_hand[:3, :3], settings)


class FingeredHand:
    """A hand that can be closed: its articulation, each finger's way from open to closed, and how far it has come."""

    def __init__(
        self, scene: sapien.Scene, gripper: MultiFingerGripper, joints_rad: np.ndarray, settings: TrialSettings
    ):
        """Put the open hand into the scene."""
        drive = gripper.drive
        strength = settings.force_n / gripper.force_n
        self._press_nm, self._stiffness = strength * drive.press_nm, drive.stiffness_nm_rad
        self._finger_of_link = gripper.finger_of_link
        self._links = _articulation(scene, gripper, settings)
        self.articulation = self._links[0].articulation
        self.articulation.set_solver_position_iterations(settings.solver_iterations)
        self.articulation.set_solver_velocity_iterations(1)
        self._joints = self.articulation.active_joints
        for joint in self._joints:
            joint.set_drive_properties(self._stiffness, drive.damping_nm_s_rad, strength * drive.torque_limit_nm)
            joint.set_armature(np.full(1, drive.armature_kg_m2, np.float32))
        order = [gripper.joints.index(joint.name) for joint in self._joints]
        self._open, self._closed = joints_rad[:, order]
        of_joint = {link.joint: owner for link, owner in zip(gripper.links, self._finger_of_link, strict=True)}
        self._finger_of_joint = np.array([of_joint[joint.name] for joint in self._joints])
        self._step, self._come = self._steps(len(gripper.fingers), drive.speed_rad_s * settings.frame_s)
        self.articulation.set_qpos(self._open.astype(np.float32))
        self._drive_to(self._open)
        self._owner = {
            link.entity.per_scene_id: finger for link, finger in zip(self._links, self._finger_of_link, strict=True)
        }

    def _steps(self, fingers: int, step_rad: float) -> tuple[np.ndarray, np.ndarray]:
        """Return the share of its way that each finger goes in a frame, and that it has come: none."""
        way = np.array([np.abs(self._closed - self._open)[self._finger_of_joint == f].max() for f in range(fingers)])
        return step_rad / np.maximum(way, step_rad), np.zeros(fingers)

    def squeeze(self) -> None:
        """Move on the targets of all fingers that do not press yet."""
        torque_nm = np.abs(self._stiffness * (self._target - self.articulation.get_qpos()))
        for finger in range(len(self._come)):
            if torque_nm[self._finger_of_joint == finger].max() < self._press_nm:
                self._come[finger] = min(1.0, self._come[finger] + self._step[finger])
        self._drive_to(self._open + self._come[self._finger_of_joint] * (self._closed - self._open))

    def pressing_n(self, pushes: list[tuple[int, np.ndarray]]) -> tuple[float, ...]:
        """Return how hard thumb and palm together, and the other fingers together, push the object (N)."""
        forces = [0.0, 0.0]
        for other, push_n in pushes:
            if other in self._owner:
                forces[0 if self._owner[other] <= THUMB else 1] += float(np.linalg.norm(push_n))
        return tuple(forces)

    def _drive_to(self, joints_rad: np.ndarray) -> None:
        self._target = joints_rad
        for joint, target in zip(self._joints, joints_rad, strict=True):
            joint.set_drive_target(float(target))


def _articulation(
    scene: sapien.Scene, gripper: MultiFingerGripper, settings: TrialSettings
) -> list[physx.PhysxArticulationLinkComponent]:
    """Build the hand, its root fixed at its place in the grasp frame; returns its links in the gripper's order."""
    material = physx.PhysxMaterial(settings.finger_friction, settings.finger_friction, 0.0)
    built: list[physx.PhysxArticulationLinkComponent] = []
    entities = []
    for link, finger in zip(gripper.links, gripper.finger_of_link, strict=True):
        component = physx.PhysxArticulationLinkComponent(built[link.parent] if link.parent >= 0 else None)
        bits = PALM_BITS if finger < 0 else THUMB_BITS if finger == THUMB else FINGER_BITS
        for shape in link.shapes:
            part = link_shape(shape, material)
            part.local_pose = sapien.Pose(shape.shape_to_link)
            part.contact_offset = settings.contact_offset_m
            part.patch_radius, part.min_patch_radius = PATCH_RADIUS_M, MIN_PATCH_RADIUS_M
            part.set_collision_groups([1, 1, bits, 0])
            component.attach(part)
        set_joint_and_mass(component, link)
        component.disable_gravity = True
        built.append(component)
        entities.append(sapien.Entity())
        entities[-1].add_component(component)
    entities[0].pose = sapien.Pose(gripper.root_to_gripper)
    for entity in entities:
        scene.add_entity(entity)
    return built
