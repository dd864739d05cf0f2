"""Stationary parallel hand in SAPIEN: a static palm, and two fingers with a shared target.

The scene's frame is the gripper frame. The hand's motion acts on the object instead, as a load in the accelerated frame. The
fingers are rigid bodies with one free axis: a step costs about 0.65 of that with articulation links.
"""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from dataclasses import dataclass
from functools import lru_cache
from itertools import takewhile

import numpy as np
import sapien
from sapien import physx

from manitwin.physics.sapien.body import entity_at
from manitwin.physics.sapien.scene import weightless_system
from manitwin.physics.sapien.shapes import HAND_COLLISION_GROUPS, set_contact
from manitwin.physics.shared_target import SharedTarget
from manitwin.physics.trial import TrialSettings
from manitwin.robots.grippers.box import PlacedBox
from manitwin.robots.grippers.parallel import ParallelGripper

# PhysX stops a locked axis after every substep but includes the finger's mass along it in the contact solution. Friction on
# fingers much lighter than the object needs more substeps than there are; much heavier fingers converge worse. Of 110 grasps
# 13 have verdicts that depend on the finger mass. Compared with a reference of 1/960 s, 40 iterations and an articulation, 12
# of them agree at 0.5 kg and 3 at 1 kg; a box at 95 % of the friction limit slips at 0.1 kg.
FINGER_MASS_KG = 0.5
LOCKED_INERTIA_KG_M2 = 1e9  # effectively infinite: the fingers do not rotate
LOCKED_AXES = [False, True, True, True, True, True]  # translations x, y, z, then rotations
LIMIT_SLACK_M = 1e-4  # keeps the open finger off its limit
MAX_DRIVE_FORCE = 4.0  # force limit of the drive over the closing force: never limits the closing force itself

# Rotations wxyz that map the X axis, along which the finger drives act, to +X and -X.
_ALONG_X, _ALONG_MINUS_X = (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True)
class FreeFrame:
    """State of a hand after a frame without contact: position (m) and speed (m/s) of each finger along X, and the target."""

    along_x: tuple[tuple[float, float], ...]
    target: SharedTarget


class FixedHand:
    """Stationary parallel hand for the trial (``SapienHand``).

    Finger coordinates are the distances (m) of the two pads from the plane x = 0.
    """

    def __init__(
        self, scene: sapien.Scene, gripper: ParallelGripper, settings: TrialSettings, approach: Sequence[FreeFrame] = ()
    ):
        """Put the open hand into the scene. While closing, it first replays the precomputed states ``approach``."""
        self._approach, self.is_ahead = iter(approach), False
        self._material = physx.PhysxMaterial(settings.finger_friction, settings.finger_friction, 0.0)
        self._contact_offset_m = settings.contact_offset_m
        boxes, first = _closed(gripper), len(gripper.palm_boxes)
        count = len(gripper.finger_boxes)
        palm = physx.PhysxRigidStaticComponent()
        self._attach(palm, boxes[:first])
        _place(scene, palm, 0.0)
        half_opening_m = gripper.opening_m / 2
        self.fingers: list[physx.PhysxRigidDynamicComponent] = []
        self._drives = []
        for side, axis in enumerate((_ALONG_X, _ALONG_MINUS_X)):
            finger = physx.PhysxRigidDynamicComponent()
            start = first + side * count
            self._attach(finger, boxes[start : start + count])
            _lock_to_x(finger, gripper.tip_depth_m)
            finger.solver_position_iterations = settings.solver_iterations
            finger.solver_velocity_iterations = 1
            drive = physx.PhysxDriveComponent(finger)
            drive.pose_in_parent = drive.pose_in_child = sapien.Pose([0, 0, gripper.tip_depth_m], axis)
            drive.set_drive_property_x(
                settings.finger_stiffness_n_m, settings.finger_damping_n_s_m, MAX_DRIVE_FORCE * settings.force_n
            )
            drive.set_limit_x(0.0, half_opening_m + LIMIT_SLACK_M)
            _place(scene, finger, (1, -1)[side] * half_opening_m, drive)
            self.fingers.append(finger)
            self._drives.append(drive)
        self._target = SharedTarget(gripper.opening_m, settings)
        self.close_to(half_opening_m)

    def _attach(
        self,
        component: physx.PhysxRigidStaticComponent | physx.PhysxRigidDynamicComponent,
        boxes: list[tuple[np.ndarray, np.ndarray]],
    ) -> None:
        for box_to_gripper, half_extents_m in boxes:
            shape = physx.PhysxCollisionShapeBox(half_extents_m.astype(np.float32), self._material)
            shape.local_pose = sapien.Pose(box_to_gripper)
            set_contact(
                shape,
                contact_offset_m=self._contact_offset_m,
                soft_pad=True,
                collision_groups=HAND_COLLISION_GROUPS,
            )
            component.attach(shape)

    def joints(self) -> np.ndarray:
        """Return the distances (m) of the +X and the -X pad from the plane x = 0."""
        plus, minus = self.fingers
        return np.array([plus.entity_pose.p[0], -minus.entity_pose.p[0]], float)

    def squeeze(self) -> None:
        """Advance the fingers' shared target by one frame."""
        state = next(self._approach, None)
        self.is_ahead = state is not None
        if state is not None:
            self._set(state)
            return
        plus, minus = self.fingers
        mean_m = (plus.entity_pose.p[0] - minus.entity_pose.p[0]) / 2
        self.close_to(self._target.advance_target(float(mean_m)))

    def presses(self) -> bool:
        """Tell whether the target is far enough ahead of the fingers to press with the closing force."""
        return self._target.presses

    def pressing_n(self, pushes: list[tuple[int, np.ndarray]]) -> tuple[float, ...]:
        """Return the inward forces (N) of the +X and the -X finger on the object."""
        forces = [0.0, 0.0]
        fingers = [finger.entity.per_scene_id for finger in self.fingers]
        for other, push_n in pushes:
            if other in fingers:
                side = fingers.index(other)
                forces[side] += float(push_n[0]) * (-1, 1)[side]
        return tuple(forces)

    def state(self) -> FreeFrame:
        """Return positions and speeds of the fingers, and their target."""
        along_x = [(float(finger.entity_pose.p[0]), float(finger.linear_velocity[0])) for finger in self.fingers]
        return FreeFrame(tuple(along_x), copy(self._target))

    def _set(self, state: FreeFrame) -> None:
        for finger, (x_m, speed_m_s) in zip(self.fingers, state.along_x, strict=True):
            finger.entity.pose = sapien.Pose([x_m, 0, 0])
            finger.linear_velocity = [speed_m_s, 0, 0]
        self._target = copy(state.target)
        self.close_to(self._target.value_m)

    def close_to(self, target_m: float) -> None:
        """Set the target of both fingers (m); a target inside the object presses on it."""
        target = sapien.Pose([target_m, 0, 0])
        for drive in self._drives:
            drive.set_drive_target(target)


def free_frames(gripper: ParallelGripper, settings: TrialSettings, travel_m: float) -> Sequence[FreeFrame]:
    """Return the first frames of a closing hand, until its fingers have moved by ``travel_m`` without contact.

    They are the same in every trial and therefore simulated once.
    """

    def is_clear(frame: FreeFrame) -> bool:
        return gripper.opening_m / 2 - min(abs(x_m) for x_m, _ in frame.along_x) <= travel_m

    return list(takewhile(is_clear, _empty_closing(gripper, settings)))


@lru_cache(maxsize=64)
def _empty_closing(gripper: ParallelGripper, settings: TrialSettings) -> tuple[FreeFrame, ...]:
    """Return the frames of an empty closing hand, after a first step in which it stays open."""
    system = weightless_system(settings.timestep_s)
    scene = sapien.Scene([system])
    hand, frames = FixedHand(scene, gripper, settings), []
    system.step()
    for _ in range(round(settings.close_time_s / settings.frame_s)):
        hand.squeeze()
        for _ in range(settings.steps_per_frame):
            system.step()
        frames.append(hand.state())
    return tuple(frames)


@lru_cache(maxsize=8)
def _closed(gripper: ParallelGripper) -> list[PlacedBox]:
    return gripper.boxes(0.0)


def _lock_to_x(finger: physx.PhysxRigidDynamicComponent, tip_depth_m: float) -> None:
    finger.set_mass(FINGER_MASS_KG)
    finger.set_cmass_local_pose(sapien.Pose([0, 0, tip_depth_m]))
    finger.set_inertia([LOCKED_INERTIA_KG_M2] * 3)
    finger.set_locked_motion_axes(LOCKED_AXES)
    finger.set_linear_damping(0.0)
    finger.set_angular_damping(0.0)
    finger.set_sleep_threshold(0.0)


def _place(scene: sapien.Scene, body: sapien.Component, x_m: float, *others: sapien.Component) -> None:
    entity = entity_at(body, sapien.Pose([x_m, 0, 0]))
    for component in others:
        entity.add_component(component)
    scene.add_entity(entity)
