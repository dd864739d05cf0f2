"""Grasp trial of a parallel gripper in SAPIEN 3: two fingers with a shared target.

The engine is imported by the first trial, so that a process that only refers to this simulator, such as the driver of a run,
does not wait for the import.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from manitwin.geometry.poses import inverse
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import TrialResult, TrialSettings
from manitwin.physics.trial_phases import run_brief_phases, run_phases
from manitwin.physics.trial_recording import TrialRecorder, TrialRecording
from manitwin.robots.grippers.gripper import Gripper, require_kind
from manitwin.robots.grippers.hand_clearance import HandReach
from manitwin.robots.grippers.parallel import ParallelGripper
from manitwin.twin.grasp_summary import Outcome

if TYPE_CHECKING:
    from manitwin.physics.sapien.shapes import HullShapes

REACH_MARGIN_M = 0.015  # hulls farther than this from the closing hand are left out
# A trial counts only if no omitted hull came this near at any check: the contact offset of 2 mm, plus the object's possible
# motion between two checks.
LOOK_MARGIN_M = 0.005
CLEAR_M = 0.0005  # beyond the contact offsets of both: until then no finger touches the object
# Largest speed change of the object by the closing force in a step. Of objects below 65 g, 86 % of the verdicts at 1/240 s
# agree with the reference at 1/960 s and 40 iterations, because pads knock them about or out of the hand; 94 % at 1/480 s, 96
# % at 1/960 s.
MOST_JUMP_M_S = 4.0
LEAST_TIMESTEP_S = 1 / 960
# A grasp that the closed hand loses, or holds with a displacement above this share of the slides' limit, is at the friction
# limit or vibrates between the pads. Of 86 such losses at 1/240 s and 20 iterations, a reference at 1/960 s and 40 iterations
# holds 30.
FALLS: frozenset[Outcome] = frozenset({"drops", "unstable", "slips"})
DOUBTFUL_SHARE = 0.5
REFERENCE_ITERATIONS = 40


class SapienTrial:
    """Grasp trial of a parallel gripper in SAPIEN on the CPU, one grasp at a time."""

    name = "sapien"

    def run(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> list[TrialResult]:
        """Try the grasps ``gripper_to_object (N, 4, 4)`` and return their results in the same order."""
        from manitwin.physics.sapien.shapes import COOKED

        hand, reach = require_kind(gripper, ParallelGripper), HandReach(body.hulls)
        settings = with_timestep_for_mass(settings, body.mass_kg)
        with COOKED.lent([body.hulls]) as (shapes,):
            grasps = (_Grasp(body, shapes, reach, hand, inverse(pose)) for pose in gripper_to_object)
            return [_verdict(grasp, settings) for grasp in grasps]

    def record(
        self,
        body: RigidBody,
        gripper: Gripper,
        gripper_to_object: np.ndarray,
        settings: TrialSettings,
        joints_rad: np.ndarray | None = None,
    ) -> TrialRecording:
        """Try one grasp ``gripper_to_object (4, 4)`` as ``run`` does, and return its states."""
        from manitwin.physics.sapien.shapes import COOKED

        hand, reach, recorder = require_kind(gripper, ParallelGripper), HandReach(body.hulls), TrialRecorder()
        object_to_hand = inverse(gripper_to_object)
        settings = with_timestep_for_mass(settings, body.mass_kg)
        with COOKED.lent([body.hulls]) as (shapes,):
            result = _verdict(_Grasp(body, shapes, reach, hand, object_to_hand), settings, recorder)
        return recorder.recording(result, object_to_hand, np.full(2, hand.opening_m / 2))


def with_timestep_for_mass(settings: TrialSettings, mass_kg: float) -> TrialSettings:
    """Return settings whose time step is halved until F dt / m is at most ``MOST_JUMP_M_S``, down to ``LEAST_TIMESTEP_S``."""
    while settings.force_n * settings.timestep_s > MOST_JUMP_M_S * mass_kg and _may_be_halved(settings):
        settings = _with_half_timestep(settings)
    return settings


def _may_be_halved(settings: TrialSettings) -> bool:
    return settings.timestep_s / 2 > 0.999 * LEAST_TIMESTEP_S


def _with_half_timestep(settings: TrialSettings) -> TrialSettings:
    return replace(
        settings,
        timestep_s=settings.timestep_s / 2,
        steps_per_frame=2 * settings.steps_per_frame,
        max_steps=2 * settings.max_steps,
    )


def _reference(settings: TrialSettings) -> TrialSettings:
    """Return the settings with the smallest time step and at least the reference's iterations."""
    while _may_be_halved(settings):
        settings = _with_half_timestep(settings)
    return replace(settings, solver_iterations=max(settings.solver_iterations, REFERENCE_ITERATIONS))


@dataclass(frozen=True)
class _Grasp:
    """Inputs of one trial: a body with the engine's shapes of its hulls, and a hand with the object at a pose ``(4, 4)``."""

    body: RigidBody
    shapes: HullShapes
    reach: HandReach
    gripper: ParallelGripper
    object_to_hand: np.ndarray


def _verdict(grasp: _Grasp, settings: TrialSettings, recorder: TrialRecorder | None = None) -> TrialResult:
    """Run the brief trial, the whole trial if that is inconclusive, and the reference trial if the verdict is doubtful."""
    result, reference = _try_once(grasp, settings, recorder, briefly=True), _reference(settings)
    if settings.doubts_tried_again and reference != settings and (result is None or _is_doubtful(result, settings)):
        result, settings = None, reference
    if result is None:
        result = _try_once(grasp, settings, recorder, briefly=False)
    assert result is not None  # a whole trial always has a result
    return result


def _is_doubtful(result: TrialResult, settings: TrialSettings) -> bool:
    """Tell whether the hand lost the object within the trial's time, or held it with a large displacement."""
    if result.outcome == "held":
        return result.displacement_m >= DOUBTFUL_SHARE * settings.max_displacement_m
    return result.outcome in FALLS and result.steps < settings.max_steps


def _try_once(
    grasp: _Grasp, settings: TrialSettings, recorder: TrialRecorder | None, *, briefly: bool
) -> TrialResult | None:
    """Try a grasp on the hulls within reach of the hand, or on all if the motion brought others near.

    Returns None if a brief trial is inconclusive.
    """
    from manitwin.physics.sapien.hand import FixedHand, free_frames
    from manitwin.physics.sapien.hand_scene import HandScene

    reach, gripper, object_to_hand = grasp.reach, grasp.gripper, grasp.object_to_hand
    gaps = reach.gaps_m(gripper, object_to_hand[None])[0]
    near = gaps <= REACH_MARGIN_M
    if not near.any():
        return TrialResult("misses", 0.0, 0.0, 0.0, (0.0, 0.0), 0)  # nothing touches the object

    def simulate(some: np.ndarray) -> tuple[TrialResult | None, np.ndarray]:
        """Return the result of the trial with some of the object's shapes, and the object poses at which it was checked."""
        chosen = [shape for shape, is_in in zip(grasp.shapes, some, strict=True) if is_in]
        travel_m = reach.free_travel_m(gripper, object_to_hand, some, 2 * settings.contact_offset_m + CLEAR_M)
        approach = free_frames(gripper, settings, travel_m)
        make_hand = partial(FixedHand, gripper=gripper, settings=settings, approach=approach)
        scene = HandScene(grasp.body, chosen, object_to_hand, settings, make_hand)
        watch = None if recorder is None else recorder.watch(scene)
        run = run_brief_phases if briefly else run_phases
        result = run(scene, object_to_hand[:3, :3], settings, watch)
        return result, np.array(scene.looks)

    result, looks = simulate(near)
    if result is None or near.all() or _stayed_out(reach, gaps, gripper, looks):
        return result
    return simulate(np.ones_like(near))[0]


def _stayed_out(reach: HandReach, gaps: np.ndarray, gripper: ParallelGripper, looks: np.ndarray) -> bool:
    """Tell whether no omitted hull came near the hand at any recorded pose ``(P, 4, 4)``; the cheap bound is tested first."""
    unsure = (gaps > REACH_MARGIN_M) & (gaps - reach.motions_m(looks) <= LOOK_MARGIN_M)
    return not unsure.any() or not (reach.subset(unsure).gaps_m(gripper, looks) <= LOOK_MARGIN_M).any()
