"""The grasp trial in SAPIEN 3 (PhysX 5 on the CPU): one object and one still hand in a scene of their own.

Settings as measured: one shared finger target, 20 solver iterations at 1/240 s, gravity from the lift on.

PhysX would give weight and inertial force to the object at once when a step begins, while the closing force reaches the
contacts in equal parts over the solver's substeps: the first of them would lack the normal force to resist, and a heavy
object would creep (measured: 6 mm at 4 kg where friction carries 5.6 kg, 0.8 mm as below). So the load enters as a
drive, which the solver applies in every substep as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np
import sapien
from sapien import physx

from manitwin.geometry.poses import inverse
from manitwin.simulate.gripper import Gripper
from manitwin.simulate.hand_reach import reachable_hulls
from manitwin.simulate.rigid_body import RigidBody
from manitwin.simulate.sapien_body import dynamic_component
from manitwin.simulate.sapien_hand import MIN_PATCH_RADIUS_M, PATCH_RADIUS_M, FixedHand
from manitwin.simulate.shared_target import SharedTarget
from manitwin.simulate.trial import TrialResult, TrialSettings
from manitwin.simulate.trial_phases import HandContacts, run_phases

NO_SPIN = np.zeros(3, np.float32)
LOAD_RATE_PER_S = 0.01  # drag of the load's drive per mass: 1e-4 of the weight at 0.1 m/s in the hand
# At 1 m/s the solver cannot push a thing of 10 g off fingers that close with 50 N: 7 of 20 grasps of a sponge sank in or
# were lost, of which none is at 5 or 100 m/s; of four that were tried at 1/960 s and 40 iterations, all four hold.
MAX_DEPENETRATION_M_S = 5.0
MAX_DRIVE_FORCE = 4.0  # the drive's limit, as a multiple of the closing force: it never cuts the closing force itself
REACH_MARGIN_M = 0.015  # hulls farther than this from the closing hand are left out, until the object moves so far


class SapienTrial:
    """Try grasps one by one in SAPIEN on the CPU."""

    name = "sapien"

    def run(
        self, body: RigidBody, gripper: Gripper, gripper_to_object: np.ndarray, settings: TrialSettings
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)`` and return their results in the same order."""
        return [_try_one(body, gripper, pose, settings) for pose in gripper_to_object]


def _try_one(body: RigidBody, gripper: Gripper, gripper_to_object: np.ndarray, settings: TrialSettings) -> TrialResult:
    """Try a grasp on the hulls that the hand can reach; where the object strayed so far that others count, on all."""
    reached = reachable_hulls(body.hulls, gripper, gripper_to_object, REACH_MARGIN_M)
    near = tuple(hull for hull, is_near in zip(body.hulls, reached, strict=True) if is_near)
    object_to_hand = inverse(gripper_to_object)
    if near:
        scene = _Scene(replace(body, hulls=near), gripper, object_to_hand, settings)
        result = run_phases(scene, object_to_hand[:3, :3], settings)
        if len(near) == len(body.hulls) or scene.strayed_m(body.hulls) < REACH_MARGIN_M - settings.contact_offset_m:
            return result
    return run_phases(_Scene(body, gripper, object_to_hand, settings), object_to_hand[:3, :3], settings)


class _Scene:
    """One grasp in one scene; its frame is the hand's."""

    def __init__(self, body: RigidBody, gripper: Gripper, object_to_hand: np.ndarray, settings: TrialSettings):
        self.settings, self.start_rotation = settings, object_to_hand[:3, :3]
        with _scene_config(gravity=[0, 0, 0], bounce_threshold=2.0, enable_enhanced_determinism=False):
            self.system = physx.PhysxCpuSystem()
        self.scene = scene = sapien.Scene([self.system])  # kept: bodies go with their scene
        self.system.timestep = settings.timestep_s
        self.object = _object(body, settings)
        self.entity = sapien.Entity()
        self.entity.add_component(self.object)
        self.entity.pose = sapien.Pose(object_to_hand)
        self.load = _load(self.object)
        self.entity.add_component(self.load)
        scene.add_entity(self.entity)
        self.hand = FixedHand(
            scene,
            gripper,
            friction=settings.finger_friction,
            stiffness_n_m=settings.finger_stiffness_n_m,
            damping_n_s_m=settings.finger_damping_n_s_m,
            force_limit_n=MAX_DRIVE_FORCE * settings.force_n,
            contact_offset_m=settings.contact_offset_m,
            solver_iterations=settings.solver_iterations,
        )
        self.target = SharedTarget(gripper.opening_m, settings)
        self.center_of_mass = sapien.Pose(body.center_of_mass_m)
        self.start_center_m = self.start_rotation @ body.center_of_mass_m + object_to_hand[:3, 3]
        self.moved_m = self.turned_rad = 0.0

    def advance(self, loads_m_s2: np.ndarray) -> None:
        """Take one step for each row of accelerations ``(N, 3)``."""
        set_target, step = self.load.set_drive_velocity_target, self.system.step
        for target in (loads_m_s2 / LOAD_RATE_PER_S).astype(np.float32):
            set_target(target, NO_SPIN)
            step()

    def squeeze(self) -> None:
        """Move the fingers' shared target on."""
        self.hand.close_to(self.target.move_on(float(self.hand.finger_positions_m().mean())))

    def contacts(self) -> HandContacts:
        """Return how hard the +X and the -X finger press inwards, and the deepest overlap with the hand."""
        forces, deepest = np.zeros(2), 0.0
        fingers = [finger.entity.per_scene_id for finger in self.hand.fingers]
        target = self.entity.per_scene_id
        for contact in self.system.get_contacts():
            first, second = (body.entity.per_scene_id for body in contact.bodies)
            if target not in (first, second):
                continue
            other = second if first == target else first
            for point in contact.points:
                deepest = max(deepest, -point.separation)
                if other in fingers:
                    side = fingers.index(other)
                    push_x = point.impulse[0] * (1 if first == target else -1)
                    forces[side] += push_x * (-1, 1)[side] / self.settings.timestep_s
        return HandContacts((float(forces[0]), float(forces[1])), deepest)

    def object_rotation(self) -> np.ndarray:
        """Return the object's rotation in the hand's frame."""
        rotation = self.object.entity_pose.to_transformation_matrix()[:3, :3]
        turned = float(np.arccos(np.clip((np.trace(rotation @ self.start_rotation.T) - 1) / 2, -1, 1)))
        self.turned_rad = max(self.turned_rad, turned)
        return rotation

    def center_of_mass_m(self) -> np.ndarray:
        """Return the object's centre of mass in the hand's frame."""
        center = (self.object.entity_pose * self.center_of_mass).p.astype(float)
        self.moved_m = max(self.moved_m, float(np.linalg.norm(center - self.start_center_m)))
        return center

    def strayed_m(self, hulls: tuple[np.ndarray, ...]) -> float:
        """Return how far any point of the hulls can have moved from where it was, as far as was looked."""
        radius_m = max(float(np.linalg.norm(hull - self.center_of_mass.p, axis=1).max()) for hull in hulls)
        return self.moved_m + self.turned_rad * radius_m


@contextmanager
def _scene_config(**values: object) -> Iterator[None]:
    """Set SAPIEN's process-wide scene configuration, from which a new system is made, and set it back."""
    before = physx.get_scene_config()
    kept = {name: getattr(before, name) for name in values}
    config = physx.get_scene_config()
    for name, value in values.items():
        setattr(config, name, value)
    physx.set_scene_config(config)
    try:
        yield
    finally:
        for name, value in kept.items():
            setattr(config, name, value)
        physx.set_scene_config(config)


def _object(body: RigidBody, settings: TrialSettings) -> physx.PhysxRigidDynamicComponent:
    component = dynamic_component(body, contact_offset_m=settings.contact_offset_m)
    for shape in component.collision_shapes:
        shape.patch_radius, shape.min_patch_radius = PATCH_RADIUS_M, MIN_PATCH_RADIUS_M
    component.set_sleep_threshold(0.0)  # at rest in the hand is not at rest
    component.solver_position_iterations = settings.solver_iterations
    component.solver_velocity_iterations = 1
    component.max_depenetration_velocity = MAX_DEPENETRATION_M_S
    component.set_linear_damping(0.0)
    component.set_angular_damping(0.05)
    return component


def _load(target: physx.PhysxRigidDynamicComponent) -> physx.PhysxDriveComponent:
    """Build the drive that loads the object at its centre of mass: a weak damper towards a far-off velocity.

    It gives ``mass * LOAD_RATE_PER_S * (velocity target - velocity)``, which is constant but for a negligible drag.
    """
    load = physx.PhysxDriveComponent(target)
    load.pose_in_child = target.cmass_local_pose
    for set_property in (load.set_drive_property_x, load.set_drive_property_y, load.set_drive_property_z):
        set_property(0.0, target.mass * LOAD_RATE_PER_S)
    return load
