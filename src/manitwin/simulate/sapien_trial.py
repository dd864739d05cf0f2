"""The grasp trial in SAPIEN 3 (PhysX 5 on the CPU): close, lift, stable frames, slides along six directions.

Source: paper, "Verification" (three stable frames, 1 cm, 2,000 steps); what it leaves open is as measured: one shared
finger target, 20 solver iterations at 1/240 s, gravity from the lift on.

The scene's frame is the gripper's, and moves with it without turning: the object is placed relative to it, and what
acts on the object there is its weight and the inertial force of the path, -m a (Galilean relativity). PhysX would give
both to the object at once when a step begins, while the closing force reaches the contacts in equal parts over the
solver's substeps: the first of them would lack the normal force to resist, and a heavy object would creep (measured:
6 mm at 4 kg where friction carries 5.6 kg, 0.8 mm as below). So the load enters as a drive, which the solver applies in
every substep as well.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import sapien
from sapien import physx
from scipy.spatial.transform import Rotation

from manitwin.geometry.poses import inverse, transform
from manitwin.simulate.convex_shape import convex_shape
from manitwin.simulate.gripper import Gripper
from manitwin.simulate.sapien_body import principal_frame
from manitwin.simulate.sapien_hand import MIN_PATCH_RADIUS_M, PATCH_RADIUS_M, FixedHand
from manitwin.simulate.trial import GRAVITY_M_S2, TrialBody, TrialResult, TrialSettings
from manitwin.twin import Outcome

DIRECTIONS = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], float)
CHECK_EVERY_STEPS = 16
NO_SPIN = np.zeros(3, np.float32)
LOAD_RATE_PER_S = 0.01  # drag of the load's drive per mass: 1e-4 of the weight at 0.1 m/s in the hand
# At 1 m/s the solver cannot push a thing of 10 g off fingers that close with 50 N: 7 of 20 grasps of a sponge sank in or
# were lost, of which none is at 5 or 100 m/s; of four that were tried at 1/960 s and 40 iterations, all four hold.
MAX_DEPENETRATION_M_S = 5.0
MAX_DRIVE_FORCE = 4.0  # the drive's limit, as a multiple of the closing force: it never cuts the closing force itself


class SapienTrial:
    """Try grasps one by one in SAPIEN on the CPU."""

    name = "sapien"

    def run(
        self, body: TrialBody, gripper: Gripper, gripper_to_object: np.ndarray, settings: TrialSettings
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)`` and return their results in the same order."""
        return [_Trial(body, gripper, pose, settings).run() for pose in gripper_to_object]


class _Failed(Exception):
    """The grasp failed: ends the trial with its outcome."""

    def __init__(self, outcome: Outcome):
        super().__init__(outcome)
        self.outcome: Outcome = outcome


class _Trial:
    """One grasp in one scene."""

    def __init__(self, body: TrialBody, gripper: Gripper, gripper_to_object: np.ndarray, settings: TrialSettings):
        self.settings = settings
        self.object_to_scene = inverse(gripper_to_object)
        self.center_of_mass_m = body.center_of_mass_m
        with _scene_config(gravity=[0, 0, 0], bounce_threshold=2.0, enable_enhanced_determinism=False):
            self.system = physx.PhysxCpuSystem()
        self.scene = sapien.Scene([self.system])
        self.system.timestep = settings.timestep_s
        self.object = _object(body, settings)
        entity = sapien.Entity()
        entity.add_component(self.object)
        entity.pose = sapien.Pose(self.object_to_scene)
        self.load = _load(self.object)
        entity.add_component(self.load)
        self.scene.add_entity(entity)
        self.hand = FixedHand(
            self.scene,
            gripper,
            friction=settings.finger_friction,
            stiffness_n_m=settings.finger_stiffness_n_m,
            damping_n_s_m=settings.finger_damping_n_s_m,
            force_limit_n=MAX_DRIVE_FORCE * settings.force_n,
            contact_offset_m=settings.contact_offset_m,
            solver_iterations=settings.solver_iterations,
        )
        self.opening_m = gripper.opening_m
        self.steps = 0
        self.displacement_m = self.rotation_rad = self.penetration_m = 0.0
        self.forces_n = (0.0, 0.0)
        self.closed_rotation: np.ndarray | None = None

    def run(self) -> TrialResult:
        """Run the phases until one fails."""
        outcome: Outcome = "held"
        try:
            self._start_free()
            self._close()
            self._lift()
            self._wait_for_stable_frames()
            self._slide()
        except _Failed as failure:
            outcome = failure.outcome
        if self.closed_rotation is not None:
            turned = self._object_to_hand()[:3, :3] @ self.closed_rotation.T
            self.rotation_rad = float(Rotation.from_matrix(turned).magnitude())
        return TrialResult(
            outcome, self.displacement_m, self.rotation_rad, self.penetration_m, self.forces_n, self.steps
        )

    def _start_free(self) -> None:
        self._step()
        if self._contacts()[1] > self.settings.max_overlap_m:
            raise _Failed("collides")

    def _close(self) -> None:
        """Ramp the shared target inwards, never further ahead of the fingers than presses with the closing force."""
        settings = self.settings
        press_m = settings.force_n / settings.finger_stiffness_n_m
        ramp_m = settings.close_speed_m_s * settings.timestep_s * settings.steps_per_frame
        target_m = self.opening_m / 2
        for step in range(round(settings.close_time_s / settings.timestep_s)):
            if step % settings.steps_per_frame == 0:
                target_m = max(target_m - ramp_m, float(self.hand.finger_positions_m().mean()) - press_m)
                self.hand.close_to(target_m)
            self._step()
        self._check_hold("misses")
        self.closed_rotation = self._object_to_hand()[:3, :3]

    def _lift(self) -> None:
        settings = self.settings
        reference = self._center_in_hand()
        self._move([0, 0, settings.lift_m], settings.lift_time_s, reference, settings.max_lift_displacement_m, "drops")

    def _wait_for_stable_frames(self) -> None:
        settings = self.settings
        frame_s = settings.steps_per_frame * settings.timestep_s
        stable, before = 0, self._center_in_hand()
        self.load.set_drive_velocity_target(self._load_targets(np.zeros((1, 3)))[0], NO_SPIN)
        for _ in range(round(settings.stable_time_s / frame_s)):
            for _ in range(settings.steps_per_frame):
                self._step()
            now = self._center_in_hand()
            moved = float(np.linalg.norm(now - before))
            stable, before = (stable + 1 if moved < settings.stable_speed_m_s * frame_s else 0), now
            if stable >= settings.stable_frames:
                self._check_hold("drops")
                return
        raise _Failed("unstable")

    def _slide(self) -> None:
        settings = self.settings
        reference = self._center_in_hand()
        self.displacement_m = 0.0
        for direction in DIRECTIONS:
            for sign in (1, -1):
                path = sign * settings.slide_m * direction
                self._move(path, settings.slide_time_s, reference, settings.max_displacement_m, "slips")
        self._check_hold("slips")

    def _move(
        self, path_m: np.ndarray | list[float], time_s: float, reference: np.ndarray, limit_m: float, outcome: Outcome
    ) -> None:
        """Move the hand along an object-frame path with a quintic profile; fail where the object lags behind it."""
        count = round(time_s / self.settings.timestep_s)
        u = (np.arange(count) + 0.5) / count
        profile = (60 * u - 180 * u**2 + 120 * u**3) / time_s**2
        targets = self._load_targets(profile[:, None] * np.asarray(path_m))
        for step, target in enumerate(targets, 1):
            self.load.set_drive_velocity_target(target, NO_SPIN)
            self._step()
            if step % CHECK_EVERY_STEPS == 0 or step == count:
                moved = float(np.linalg.norm(self._center_in_hand() - reference))
                self.displacement_m = max(self.displacement_m, moved)
                if not moved <= limit_m:
                    raise _Failed(outcome)

    def _load_targets(self, acceleration_m_s2: np.ndarray) -> np.ndarray:
        """Return the drive's targets ``(N, 3)`` that give weight and inertial force of the hand's accelerations."""
        load = [0, 0, -GRAVITY_M_S2] - acceleration_m_s2
        return (load @ self.object_to_scene[:3, :3].T / LOAD_RATE_PER_S).astype(np.float32)

    def _check_hold(self, outcome: Outcome) -> None:
        """Fail unless both fingers press the object towards each other without sinking into it."""
        forces, depth = self._contacts()
        self.penetration_m = max(self.penetration_m, depth)
        if self.closed_rotation is None:
            self.forces_n = (float(forces[0]), float(forces[1]))
        if not min(forces) > self.settings.min_finger_force_n:
            raise _Failed(outcome)
        if depth > self.settings.max_penetration_m:
            raise _Failed("penetrates")

    def _contacts(self) -> tuple[np.ndarray, float]:
        """Return how hard the fingers press inwards on the object (N), and its deepest overlap (m) with the hand."""
        forces, deepest = np.zeros(2), 0.0
        fingers = [finger.entity.per_scene_id for finger in self.hand.fingers]
        target = self.object.entity.per_scene_id
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
        return forces, deepest

    def _object_to_hand(self) -> np.ndarray:
        return self.object.entity_pose.to_transformation_matrix()

    def _center_in_hand(self) -> np.ndarray:
        pose = self._object_to_hand()
        return pose[:3, :3] @ self.center_of_mass_m + pose[:3, 3]

    def _step(self) -> None:
        if self.steps >= self.settings.max_steps:
            raise _Failed("unstable")
        self.system.step()
        self.steps += 1


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


def _object(body: TrialBody, settings: TrialSettings) -> physx.PhysxRigidDynamicComponent:
    """Build the object with its own mass properties: SAPIEN would take them from the hulls."""
    material = physx.PhysxMaterial(body.friction_static, body.friction_dynamic, 0.0)
    component = physx.PhysxRigidDynamicComponent()
    for hull in body.hulls:
        shape = convex_shape(hull, material)
        shape.contact_offset = settings.contact_offset_m
        shape.patch_radius, shape.min_patch_radius = PATCH_RADIUS_M, MIN_PATCH_RADIUS_M
        component.attach(shape)
    moments, axes = principal_frame(body.inertia_kg_m2)
    component.set_mass(body.mass_kg)
    component.set_cmass_local_pose(sapien.Pose(transform(axes, body.center_of_mass_m)))
    component.set_inertia(moments.astype(np.float32))
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
