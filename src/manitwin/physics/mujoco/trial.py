"""Grasp trial in MuJoCo: a second opinion with another contact model, on the same hulls, masses and friction.

The engine settings are fixed, because they can move the share of held grasps from 12 to 96 %: implicit integration at 1
ms, elliptic cones, torsional friction (condim 4), contact time constant 5 ms, and an impedance ratio of 1000 against
the creep of soft contacts (MuJoCo manual, "Preventing slip"). With this ratio, an object held below the friction limit
moves no more than the compliance of the finger drives allows. A ratio of 10 with five no-slip iterations doubled that
motion by creep, and kept some light objects vibrating.

MuJoCo's contact stiffness scales with mass: pads that penetrate a hammer by half a millimetre penetrate a bar of two
grams by seven, pass through it and drop it. The impedance is therefore chosen for equal penetration
(``even_impedance``).

At 2 ms, pads that touch the faces of several hulls at once receive forces anywhere from 0 to 1,500 N; at 1 ms the
forces are correct.

The engine is imported by the first trial, so that a process that only refers to this simulator, such as the driver of a
run, does not wait for the import.
"""

from __future__ import annotations

import math
import weakref
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from manitwin.geometry.poses import inverse
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.physics.trial_phases import TrialWatch, run_brief_phases, run_phases
from manitwin.physics.trial_recording import TrialRecorder, TrialRecording
from manitwin.robots.grippers.gripper import Gripper, require_kind
from manitwin.robots.grippers.parallel import ParallelGripper

if TYPE_CHECKING:
    import mujoco

TIMESTEP_S, STEPS_PER_FRAME = 0.001, 16


class MujocoTrial:
    """Grasp trial of a parallel gripper in MuJoCo on the CPU, one grasp at a time."""

    name = "mujoco"

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)``; MuJoCo's own time step replaces that of ``settings`` (``frozen``)."""
        if not len(gripper_to_object):
            return []
        settings, hand = with_mujoco_timestep(settings), require_kind(gripper, ParallelGripper)
        model = _MODELS.of(body, hand, settings)
        return [_try_one(model, hand, inverse(pose), settings) for pose in gripper_to_object]

    def record(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> TrialRecording:
        """Try one grasp ``gripper_to_object (4, 4)`` as ``run`` does, and return its states."""
        settings, hand, recorder = (
            with_mujoco_timestep(settings),
            require_kind(gripper, ParallelGripper),
            TrialRecorder(),
        )
        object_to_hand = inverse(gripper_to_object)
        result = _try_one(_MODELS.of(body, hand, settings), hand, object_to_hand, settings, recorder)
        return recorder.recording(result, object_to_hand, np.full(2, hand.opening_m / 2))


class _HandModels:
    """Cache of the last compiled model of each body, while the body exists; compiling takes a fifth of the time of a trial."""

    def __init__(self) -> None:
        self._by_body: dict[int, tuple[ParallelGripper, TrialSettings, mujoco.MjModel]] = {}

    def of(self, body: RigidBody, gripper: ParallelGripper, settings: TrialSettings) -> mujoco.MjModel:
        """Return the model of a gripper and a body; compile it if gripper or settings differ from the body's last model."""
        from manitwin.physics.mujoco.hand_scene import hand_model

        number = id(body)
        known = self._by_body.get(number)
        if known is None:
            weakref.finalize(body, self._by_body.pop, number, None).atexit = False
        elif known[:2] == (gripper, settings):
            return known[2]
        model = hand_model(body, gripper, settings)
        self._by_body[number] = gripper, settings, model
        return model


_MODELS = _HandModels()
"""The cache of this process."""


def _try_one(
    model: mujoco.MjModel,
    gripper: ParallelGripper,
    object_to_hand: np.ndarray,
    settings: TrialSettings,
    recorder: TrialRecorder | None = None,
) -> TrialResult:
    """Run the brief trial of a grasp, and the whole trial if the brief one is inconclusive."""
    from manitwin.physics.mujoco.hand_scene import HandScene

    def scene() -> tuple[HandScene, TrialWatch | None]:
        new = HandScene(model, gripper, object_to_hand, settings)
        return new, None if recorder is None else recorder.watch(new)

    new, watch = scene()
    result = run_brief_phases(new, object_to_hand[:3, :3], settings, watch)
    if result is None:
        new, watch = scene()
        result = run_phases(new, object_to_hand[:3, :3], settings, watch)
    return result


def with_mujoco_timestep(settings: TrialSettings) -> TrialSettings:
    """Return the settings with MuJoCo's time step and the same total time."""
    most_s = settings.max_steps * settings.timestep_s
    return replace(
        settings,
        timestep_s=TIMESTEP_S,
        steps_per_frame=STEPS_PER_FRAME,
        max_steps=math.ceil(most_s / TIMESTEP_S),
    )
