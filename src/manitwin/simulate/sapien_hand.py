"""A floating parallel hand in SAPIEN: three stiff slides, a palm, and two fingers that share one target.

The scene's frame is the gripper's frame at the start, so the hand is the same articulation in every trial.
"""

from __future__ import annotations

import numpy as np
import sapien
from sapien import physx

from manitwin.simulate.gripper import Gripper

HAND_MASS_KG, FINGER_MASS_KG, SLIDE_MASS_KG = 0.73, 0.1, 0.3  # of the Franka hand; the slides' is numerical
HAND_INERTIA_KG_M2, FINGER_INERTIA_KG_M2 = 2e-3, 1e-4
# Stiff enough to follow the path to within a millimetre. Stiffer is worse: with a hand that cannot give at all (the
# path as an inertial force on the object), a box near the limit of friction creeps by millimetres where it should
# stick.
SLIDE_STIFFNESS_N_M, SLIDE_DAMPING_N_S_M, SLIDE_FORCE_N, SLIDE_REACH_M = 2e4, 1e3, 5e3, 2.0
PATCH_RADIUS_M, MIN_PATCH_RADIUS_M = 0.01, 0.005  # of PhysX's torsional friction: that of a soft pad

# Rotations wxyz that turn the X axis, along which SAPIEN's prismatic joints move, into +X, +Y, +Z and -X.
_HALF = float(np.sqrt(0.5))
_ALONG_X, _ALONG_Y, _ALONG_Z = (1.0, 0.0, 0.0, 0.0), (_HALF, 0.0, 0.0, _HALF), (_HALF, 0.0, -_HALF, 0.0)
_ALONG_MINUS_X = (0.0, 0.0, 0.0, 1.0)


class FloatingHand:
    """A parallel hand that can be moved along three axes and closed.

    Finger coordinates are the distances (m) of the two pads from the plane x = 0.
    """

    def __init__(
        self,
        scene: sapien.Scene,
        gripper: Gripper,
        *,
        friction: float,
        stiffness_n_m: float,
        damping_n_s_m: float,
        force_limit_n: float,
        contact_offset_m: float,
        solver_iterations: int,
    ):
        """Put the open hand into the scene."""
        self._material = physx.PhysxMaterial(friction, friction, 0.0)
        self._contact_offset_m = contact_offset_m
        self._entities: list[sapien.Entity] = []
        self._half_opening_m = gripper.opening_m / 2
        boxes, first = gripper.boxes(0.0), len(gripper.palm_boxes)
        count = len(gripper.finger_boxes)
        base = parent = self._link(None, SLIDE_MASS_KG, HAND_INERTIA_KG_M2, [])
        self._slides = []
        for axis in (_ALONG_X, _ALONG_Y, _ALONG_Z):
            last = axis is _ALONG_Z
            mass_kg = HAND_MASS_KG if last else SLIDE_MASS_KG
            parent = self._link(parent, mass_kg, HAND_INERTIA_KG_M2, boxes[:first] if last else [])
            _make_slide(parent.joint, axis, -SLIDE_REACH_M, SLIDE_REACH_M)
            parent.joint.set_drive_properties(SLIDE_STIFFNESS_N_M, SLIDE_DAMPING_N_S_M, SLIDE_FORCE_N)
            self._slides.append(parent.joint)
        self.hand = parent
        self.fingers = []
        for side, axis in enumerate((_ALONG_X, _ALONG_MINUS_X)):
            start = first + side * count
            finger = self._link(self.hand, FINGER_MASS_KG, FINGER_INERTIA_KG_M2, boxes[start : start + count])
            _make_slide(finger.joint, axis, 0.0, self._half_opening_m)
            finger.joint.set_drive_properties(stiffness_n_m, damping_n_s_m, force_limit_n)
            self.fingers.append(finger)
        base.joint.type = "fixed"
        for entity in self._entities:
            scene.add_entity(entity)
        self._articulation = self.hand.articulation
        self._articulation.set_solver_position_iterations(solver_iterations)
        self._articulation.set_solver_velocity_iterations(1)
        self._articulation.set_qpos(np.array([0, 0, 0, self._half_opening_m, self._half_opening_m], np.float32))
        self.close_to(self._half_opening_m)

    def _link(
        self,
        parent: physx.PhysxArticulationLinkComponent | None,
        mass_kg: float,
        inertia_kg_m2: float,
        boxes: list[tuple[np.ndarray, np.ndarray]],
    ) -> physx.PhysxArticulationLinkComponent:
        link = physx.PhysxArticulationLinkComponent(parent)
        link.set_mass(mass_kg)
        link.set_inertia([inertia_kg_m2] * 3)
        link.set_cmass_local_pose(sapien.Pose())
        link.disable_gravity = True
        for box_to_gripper, half_extents_m in boxes:
            shape = physx.PhysxCollisionShapeBox(half_extents_m.astype(np.float32), self._material)
            shape.local_pose = sapien.Pose(box_to_gripper)
            shape.contact_offset = self._contact_offset_m
            shape.patch_radius, shape.min_patch_radius = PATCH_RADIUS_M, MIN_PATCH_RADIUS_M
            link.attach(shape)
        entity = sapien.Entity()
        entity.add_component(link)
        self._entities.append(entity)
        return link

    def finger_positions_m(self) -> np.ndarray:
        """Return the coordinates ``(2,)`` of the +X and the -X finger."""
        return self._articulation.get_qpos()[-2:]

    def close_to(self, target_m: float) -> None:
        """Give both fingers one target; a target inside the object presses on it."""
        for finger in self.fingers:
            finger.joint.set_drive_target(target_m)

    def move_to(self, x_m: float, y_m: float, z_m: float) -> None:
        """Set where the hand shall be, in the scene's frame."""
        for joint, value in zip(self._slides, (x_m, y_m, z_m), strict=True):
            joint.set_drive_target(value)


def _make_slide(joint: physx.PhysxArticulationJoint, axis: tuple[float, ...], low_m: float, high_m: float) -> None:
    joint.type = "prismatic"
    joint.pose_in_parent = joint.pose_in_child = sapien.Pose([0, 0, 0], axis)
    joint.limit = np.array([[low_m, high_m]], np.float32)
