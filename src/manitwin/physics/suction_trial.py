"""Grasp trial of a suction cup, evaluated in closed form without a physics engine.

A sealed object moves rigidly with the cup, so the load on the lip along the path follows from Newton's and Euler's
equations: the object's weight and inertial force act at its centre of mass. The compliance of the bellows is neglected.
After the lip detaches, the object moves freely.
"""

from __future__ import annotations

import numpy as np

from manitwin.geometry.poses import inverse, transform
from manitwin.geometry.ray_caster import RayCaster
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.suction import lip_load, seal
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.physics.trial_phases import HandContacts, run_phases
from manitwin.physics.trial_recording import TrialRecorder, TrialRecording
from manitwin.robots.grippers.gripper import Gripper, require_kind
from manitwin.robots.grippers.hand_clearance import HandCollision
from manitwin.robots.grippers.suction import SuctionGripper


class SuctionTrial:
    """Grasp trial of a suction cup by statics, one grasp at a time."""

    name = "statics"

    def __init__(self) -> None:
        self._last: tuple[tuple[np.ndarray, ...], HandCollision] | None = None

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)``; the vacuum force is ``settings.force_n``.

        The cup seals on the body's ``surface``, or on its hulls if it has no surface.
        """
        return [
            run_phases(scene, object_to_hand[:3, :3], settings)
            for scene, object_to_hand in self._scenes(body, gripper, gripper_to_object, settings)
        ]

    def record(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> TrialRecording:
        """Try one grasp ``gripper_to_object (4, 4)`` as ``run`` does, and return its states."""
        [(scene, object_to_hand)] = self._scenes(body, gripper, gripper_to_object[None], settings)
        recorder = TrialRecorder()
        result = run_phases(scene, object_to_hand[:3, :3], settings, recorder.watch(scene))
        return recorder.recording(result, object_to_hand, scene.hand_joints())

    def _scenes(
        self, body: RigidBody, gripper: Gripper, gripper_to_object: np.ndarray, settings: TrialSettings
    ) -> list[tuple[_Scene, np.ndarray]]:
        """Return the scene of each grasp with the object's initial pose ``(4, 4)`` in the hand's frame."""
        surface = RayCaster.of_hulls(body.hulls) if body.surface is None else body.surface
        cup = require_kind(gripper, SuctionGripper)
        found = seal(cup, gripper_to_object, surface)
        pressed_on = gripper_to_object.copy()
        pressed_on[:, :3, 3] += found.advance_m[:, None] * pressed_on[:, :3, 2]
        overlaps = self._collision(body.hulls).overlaps(cup, pressed_on, opening_m=cup.opening_m, clearance_m=0.0)
        scenes = []
        for number, pose in enumerate(gripper_to_object):
            object_to_hand = inverse(pose)
            scene = _Scene(
                body,
                cup,
                object_to_hand,
                settings,
                sealed=bool(found.sealed[number]),
                overlaps=bool(overlaps[number]),
                lip_center_m=object_to_hand[:3, :3] @ found.center_m[number] + object_to_hand[:3, 3],
                inward=object_to_hand[:3, :3] @ found.inward[number],
            )
            scenes.append((scene, object_to_hand))
        return scenes

    def _collision(self, hulls: tuple[np.ndarray, ...]) -> HandCollision:
        """Return the collision model of the hulls, cached for the last tuple because successive trials often share an object."""
        if self._last is None or self._last[0] is not hulls:
            self._last = hulls, HandCollision(hulls)
        return self._last[1]


class _Scene:
    """Scene of one cup and one object (``TrialScene``), in the hand's frame."""

    def __init__(
        self,
        body: RigidBody,
        gripper: SuctionGripper,
        object_to_hand: np.ndarray,
        settings: TrialSettings,
        *,
        sealed: bool,
        overlaps: bool,
        lip_center_m: np.ndarray,
        inward: np.ndarray,
    ):
        self.settings, self.mass_kg, self.lip_radius_m = settings, body.mass_kg, gripper.lip_radius_m
        self.friction = (settings.finger_friction + body.friction_static) / 2
        self.sealed, self.overlaps, self.inward = sealed, overlaps, inward
        self.rotation = object_to_hand[:3, :3]
        self.in_object_m = body.center_of_mass_m
        self.center_m = self.rotation @ body.center_of_mass_m + object_to_hand[:3, 3]
        self.arm_m = self.center_m - lip_center_m
        self.on, self.velocity_m_s = False, np.zeros(3)

    def advance(self, loads_m_s2: np.ndarray) -> None:
        """Take one step for each row of accelerations ``(N, 3)``: the lip carries them, or the object moves freely."""
        if self.on:
            share = lip_load(
                self.mass_kg * loads_m_s2,
                np.broadcast_to(self.arm_m, loads_m_s2.shape),
                np.broadcast_to(self.inward, loads_m_s2.shape),
                vacuum_force_n=self.settings.force_n,
                friction=self.friction,
                lip_radius_m=self.lip_radius_m,
            )
            beyond = np.flatnonzero(share > 1)
            if not len(beyond):
                return
            self.on, loads_m_s2 = False, loads_m_s2[beyond[0] :]
        step_s = self.settings.timestep_s
        velocity_m_s = self.velocity_m_s + step_s * np.cumsum(loads_m_s2, axis=0)
        self.center_m = self.center_m + step_s * velocity_m_s.sum(0)
        self.velocity_m_s = velocity_m_s[-1]

    def squeeze(self) -> None:
        """Switch the vacuum on; it holds if the lip seals."""
        self.on = self.sealed

    def presses(self) -> bool:
        """Tell whether the vacuum holds the object."""
        return self.on

    def contacts(self) -> HandContacts:
        """Return the lip's force without load, and an infinite overlap if the gripper's body collides with the object."""
        return HandContacts((self.settings.force_n if self.on else 0.0,), np.inf if self.overlaps else 0.0)

    def object_to_hand(self) -> np.ndarray:
        """Return the object's pose ``(4, 4)`` in the hand's frame; its rotation is constant."""
        return transform(self.rotation, self.center_m - self.rotation @ self.in_object_m)

    def hand_joints(self) -> np.ndarray:
        """Return whether the vacuum holds, as 0 or 1, ``(1,)``."""
        return np.array([float(self.on)])

    def object_rotation(self) -> np.ndarray:
        """Return the object's rotation ``(3, 3)`` in the hand's frame."""
        return self.rotation

    def center_of_mass_m(self) -> np.ndarray:
        """Return the object's centre of mass ``(3,)`` m in the hand's frame."""
        return self.center_m
