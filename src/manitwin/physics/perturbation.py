"""What differs between the twin and a real thing in a real hand: pose, friction, mass, centre of mass, force."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.stats import norm, qmc

from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import TrialSettings


@dataclass(frozen=True)
class Spread:
    """How far each quantity may be off.

    ``pose_m`` and ``pose_deg`` are the largest shift and turn of the hand about its fingertips, ``friction`` and
    ``force`` factors, ``mass_kg`` the interval of the twin's Estimate, ``center_of_mass_m`` the largest shift.
    """

    pose_m: float
    pose_deg: float
    friction: tuple[float, float]
    force: tuple[float, float]
    mass_kg: tuple[float, float]
    center_of_mass_m: float


@dataclass(frozen=True)
class Perturbation:
    """One draw: shift (m) and rotation vector (rad) of the hand in its own frame, factors, mass, shift of the centre of mass."""

    shift_m: np.ndarray
    turn_rad: np.ndarray
    friction: float
    force: float
    mass_kg: float
    center_of_mass_shift_m: np.ndarray

    def grasp(self, gripper_to_object: np.ndarray, depth_m: float) -> np.ndarray:
        """Return the grasp ``(4, 4)``, moved and turned about its fingertips' centre."""
        rotation = gripper_to_object[:3, :3] @ Rotation.from_rotvec(self.turn_rad).as_matrix()
        tip = gripper_to_object[:3, 3] + depth_m * gripper_to_object[:3, 2]
        shift = gripper_to_object[:3, :3] @ self.shift_m
        return transform(rotation, tip + shift - depth_m * rotation[:, 2])

    def body(self, body: RigidBody) -> RigidBody:
        """Return the body with another mass, centre of mass and friction; the inertia goes with the mass."""
        return replace(
            body,
            mass_kg=self.mass_kg,
            center_of_mass_m=body.center_of_mass_m + self.center_of_mass_shift_m,
            inertia_kg_m2=body.inertia_kg_m2 * (self.mass_kg / body.mass_kg),
            friction_static=body.friction_static * self.friction,
            friction_dynamic=body.friction_dynamic * self.friction,
        )

    def settings(self, settings: TrialSettings) -> TrialSettings:
        """Return the settings with another force and finger friction."""
        return replace(
            settings, force_n=settings.force_n * self.force, finger_friction=settings.finger_friction * self.friction
        )


def draw_perturbations(spread: Spread, count: int, seed: int) -> list[Perturbation]:
    """Draw ``count`` perturbations, spread evenly (scrambled Sobol sequence), the same for every grasp of an object.

    Shifts and turns are uniform in their balls, factors uniform, masses uniform in their logarithm.
    """
    # a scrambled Sobol sequence is balanced at powers of two only; the first of a longer one are the same points
    unit = qmc.Sobol(d=15, scramble=True, seed=seed).random_base2(int(np.ceil(np.log2(max(count, 2)))))[:count]
    low, high = np.log(spread.mass_kg)
    return [
        Perturbation(
            shift_m=spread.pose_m * _in_ball(row[0:4]),
            turn_rad=np.radians(spread.pose_deg) * _in_ball(row[4:8]),
            friction=_between(spread.friction, row[8]),
            force=_between(spread.force, row[9]),
            mass_kg=float(np.exp(low + (high - low) * row[10])),
            center_of_mass_shift_m=spread.center_of_mass_m * _in_ball(row[11:15]),
        )
        for row in unit
    ]


def _between(interval: tuple[float, float], share: float) -> float:
    return float(interval[0] + (interval[1] - interval[0]) * share)


def _in_ball(unit: np.ndarray) -> np.ndarray:
    """Turn four numbers in [0, 1] into a point ``(3,)`` uniform in the unit ball: a direction and a radius."""
    direction = norm.ppf(np.clip(unit[:3], 1e-9, 1 - 1e-9))
    return np.asarray(direction / np.linalg.norm(direction) * np.cbrt(unit[3]))
