"""Boxes and grasps whose verdicts follow from closed forms; the hand is the Panda's."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics import trial_phases
from manitwin.physics.trial import GraspTrial, TrialResult, TrialSettings
from manitwin.robots.grippers.gripper import load_gripper

PANDA = load_gripper("panda")
SETTINGS = TrialSettings(force_n=50.0, finger_friction=1.0)
FROM_ABOVE = np.diag([1.0, -1.0, -1.0])
SLIDE_PEAK_M_S2 = 10 / np.sqrt(3) * 0.1 / 0.4**2  # of a quintic path of 0.1 m in 0.4 s


def above(tip_m: list[float], rotation: np.ndarray = FROM_ABOVE) -> np.ndarray:
    """The grasp whose fingertips' centre is at ``tip_m``; it closes along the first column of ``rotation``."""
    return transform(rotation, np.array(tip_m) - rotation[:, 2] * PANDA.tip_depth_m)


def box(
    extents_m: list[float], mass_kg: float, friction: float = 0.5, center_m: tuple[float, ...] = (0, 0, 0)
) -> RigidBody:
    """A box about the origin with the inertia of a solid one and a centre of mass of its own."""
    x, y, z = np.square(extents_m)
    inertia = mass_kg / 12 * np.diag([y + z, x + z, x + y])
    hull = np.array(trimesh.creation.box(extents_m).vertices)
    return RigidBody((hull,), mass_kg, np.array(center_m, float), inertia, friction, friction)


def annulus(outer_m: float, inner_m: float, height_m: float, sections: int, mass_kg: float) -> RigidBody:
    """A flat ring about Z, a hull for each of its sections."""
    angles = np.linspace(0, 2 * np.pi, sections + 1)
    corners = [[(r * np.cos(a), r * np.sin(a)) for r in (inner_m, outer_m)] for a in angles]
    hulls = tuple(
        np.array(
            [(*corner, z) for side in corners[at : at + 2] for corner in side for z in (-height_m / 2, height_m / 2)]
        )
        for at in range(sections)
    )
    across = mass_kg / 12 * (3 * (outer_m**2 + inner_m**2) + height_m**2)
    inertia = np.diag([across, across, mass_kg / 2 * (outer_m**2 + inner_m**2)])
    return RigidBody(hulls, mass_kg, np.zeros(3), inertia, 0.5, 0.5)


def block(low_m: list[float], high_m: list[float]) -> np.ndarray:
    """The corners of a box between two corners."""
    return np.array(trimesh.creation.box(bounds=[low_m, high_m]).vertices)


def try_one(engine: GraspTrial, body: RigidBody, pose: np.ndarray, settings: TrialSettings = SETTINGS) -> TrialResult:
    """The result of a single grasp with the Panda."""
    return engine.run(body, PANDA, pose[None], settings)[0]


def as_a_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no trial be brief."""
    monkeypatch.setattr(trial_phases, "REST_M", 0.0)
    monkeypatch.setattr(trial_phases, "TURNED_RAD", 0.0)
