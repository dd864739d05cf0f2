"""Robustness of held grasps: perturbations by which reality may differ, and a sequential test that stops when it is clear.

Wald 1945, "Sequential tests of statistical hypotheses": after each trial the log likelihood ratio of "holds in
``robust_share`` of the cases" against "holds in ``fragile_share``" is looked at; beyond ln((1 - error) / error) to either
side the question is settled.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation
from scipy.special import ndtri

from manitwin.geometry.poses import transform
from manitwin.geometry.rigid_body import RigidBody
from manitwin.physics.trial import TrialSettings

ROUNDING = 1e-9  # of the sums of logarithms: a ratio that reaches the bound exactly is beyond it


@dataclass(frozen=True)
class SequentialTest:
    """The two shares that are told apart, the chance of confusing them, and the most trials."""

    robust_share: float
    fragile_share: float
    error: float
    max_trials: int

    def log_ratio(self, held: int, trials: int) -> float:
        """Return the logarithm of how much likelier ``held`` of ``trials`` is for a robust grasp than for a fragile one."""
        gain = math.log(self.robust_share / self.fragile_share)
        loss = math.log((1 - self.robust_share) / (1 - self.fragile_share))
        return held * gain + (trials - held) * loss

    def is_clear(self, held: int, trials: int) -> bool:
        """Tell whether no further trial is needed."""
        bound = math.log((1 - self.error) / self.error)
        return trials >= self.max_trials or abs(self.log_ratio(held, trials)) >= bound - ROUNDING

    def is_robust(self, held: int, trials: int) -> bool:
        """Tell whether what was seen is likelier for a robust grasp; also where ``max_trials`` ended it undecided."""
        return self.log_ratio(held, trials) > 0


@dataclass(frozen=True)
class Robustness:
    """The result of repeated trials of one grasp: how many held, of how many."""

    held: int
    trials: int

    @property
    def share(self) -> float:
        """The share of trials that held."""
        return self.held / self.trials

    @property
    def rank_value(self) -> float:
        """The mean of the share's posterior under a uniform prior (Laplace): one that held 8 of 8 is before 4 of 4."""
        return (self.held + 1) / (self.trials + 2)


def try_until_clear(holds: Callable[[int], bool], test: SequentialTest) -> Robustness:
    """Call ``holds(0)``, ``holds(1)``, ... until the test is settled or ``max_trials`` are done."""
    held = 0
    for number in range(test.max_trials):
        held += holds(number)
        if test.is_clear(held, number + 1):
            break
    return Robustness(held, number + 1)


@dataclass(frozen=True)
class Spread:
    """The largest error of each quantity.

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
class FillCurve:
    """How centre of mass and inertia of a vessel go with its mass, from empty to full.

    ``masses_kg (K,)`` rising, ``centers_m (K, 3)`` and ``inertias_kg_m2 (K, 3, 3)`` about them, object frame;
    ``uncertainties_m (K,)``: how far each centre may be off.
    """

    masses_kg: np.ndarray
    centers_m: np.ndarray
    inertias_kg_m2: np.ndarray
    uncertainties_m: np.ndarray

    def uncertainty_share(self, mass_kg: float) -> float:
        """Return how far the centre of mass of the vessel that weighs so much may be off, by that of the least certain state."""
        most_m = float(self.uncertainties_m.max())
        return float(np.interp(mass_kg, self.masses_kg, self.uncertainties_m)) / most_m if most_m > 0 else 0.0

    def filled(self, body: RigidBody, mass_kg: float) -> RigidBody:
        """Return the body as the vessel is that weighs so much: states between two known ones are in line with both.

        What weighs less than the empty one, or more than the full one, is spread as that is.
        """
        place = float(np.interp(mass_kg, self.masses_kg, np.arange(len(self.masses_kg))))
        below = min(int(place), len(self.masses_kg) - 2)
        share = place - below
        mixed = [
            (1 - share) * values[below] + share * values[below + 1]
            for values in (self.masses_kg, self.centers_m, self.inertias_kg_m2)
        ]
        return replace(body, mass_kg=mass_kg, center_of_mass_m=mixed[1], inertia_kg_m2=mixed[2] * (mass_kg / mixed[0]))


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

    def body(self, body: RigidBody, filling: FillCurve | None = None) -> RigidBody:
        """Return the body with another mass, centre of mass and friction; the inertia goes with the mass.

        Of a vessel the drawn mass says how full it is, and ``filling`` where its centre of mass then is, and how certainly; the
        shift is that of its least certain state.
        """
        shift_m = self.center_of_mass_shift_m
        if filling is not None:
            body = filling.filled(body, self.mass_kg)
            shift_m = shift_m * filling.uncertainty_share(self.mass_kg)
        return replace(
            body,
            mass_kg=self.mass_kg,
            center_of_mass_m=body.center_of_mass_m + shift_m,
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
    from scipy.stats import qmc  # a second or so of imports that only trials need

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
    direction = ndtri(np.clip(unit[:3], 1e-9, 1 - 1e-9))
    return np.asarray(direction / np.linalg.norm(direction) * np.cbrt(unit[3]))


def jittered(
    gripper_to_object: np.ndarray, depth_m: np.ndarray, rng: np.random.Generator, *, sigma_deg: float, sigma_m: float
) -> np.ndarray:
    """Return grasps ``(N, 4, 4)``, each turned about its fingertips' centre and moved, all six by a normal deviate.

    ``sigma_deg`` is per axis of the gripper's frame, ``sigma_m`` per axis of the object's. About the fingertips: turned
    about the wrist, the same angles would carry most fingers off the object.
    """
    turns = Rotation.from_euler(
        "xyz", rng.normal(0.0, sigma_deg, (len(gripper_to_object), 3)), degrees=True
    ).as_matrix()
    moves = rng.normal(0.0, sigma_m, (len(gripper_to_object), 3))
    result = np.empty_like(gripper_to_object)
    for number, (pose, depth) in enumerate(zip(gripper_to_object, depth_m, strict=True)):
        tip = pose[:3, 3] + depth * pose[:3, 2]
        rotation = pose[:3, :3] @ turns[number]
        result[number] = transform(rotation, tip - depth * rotation[:, 2] + moves[number])
    return result
