"""Robustness of held grasps: random perturbations of pose, friction, force and mass, and a sequential test of success.

The test is Wald's sequential probability ratio test (Wald, "Sequential tests of statistical hypotheses", 1945). After each
trial it evaluates the log likelihood ratio of the success rates ``robust_share`` and ``fragile_share``, and stops when the
absolute value reaches ln((1 - error) / error).
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

ROUNDING = 1e-9  # of the sums of logarithms: a ratio that equals the bound up to rounding counts as beyond it


@dataclass(frozen=True)
class SequentialTest:
    """Parameters of the test: the two success rates to distinguish, the error probability, and the maximum number of trials."""

    robust_share: float
    fragile_share: float
    error: float
    max_trials: int

    def log_ratio(self, held: int, trials: int) -> float:
        """Return the log likelihood ratio of robust over fragile, given ``held`` successes in ``trials``."""
        gain = math.log(self.robust_share / self.fragile_share)
        loss = math.log((1 - self.robust_share) / (1 - self.fragile_share))
        return held * gain + (trials - held) * loss

    def is_decided(self, held: int, trials: int) -> bool:
        """Tell whether the test is decided or ``max_trials`` is reached."""
        bound = math.log((1 - self.error) / self.error)
        return trials >= self.max_trials or abs(self.log_ratio(held, trials)) >= bound - ROUNDING

    def is_robust(self, held: int, trials: int) -> bool:
        """Tell whether the outcomes are likelier for a robust grasp; also valid if ``max_trials`` ended an undecided test."""
        return self.log_ratio(held, trials) > 0


@dataclass(frozen=True)
class Robustness:
    """Outcome of repeated trials of one grasp: the number of successes and of trials."""

    held: int
    trials: int

    @property
    def share(self) -> float:
        """The success rate."""
        return self.held / self.trials

    @property
    def rank_value(self) -> float:
        """Posterior mean of the success rate under a uniform prior (Laplace), which ranks 8 of 8 above 4 of 4."""
        return (self.held + 1) / (self.trials + 2)


def run_sequential_test(holds: Callable[[int], bool], test: SequentialTest) -> Robustness:
    """Call ``holds(0)``, ``holds(1)``, ... until the test is decided or ``max_trials`` is reached."""
    held = 0
    for number in range(test.max_trials):
        held += holds(number)
        if test.is_decided(held, number + 1):
            break
    return Robustness(held, number + 1)


@dataclass(frozen=True)
class PerturbationRanges:
    """Ranges from which perturbations are drawn.

    ``pose_m`` and ``pose_deg`` are the largest translation and rotation of the hand about its fingertips; ``friction``
    and ``force`` are intervals of factors; ``mass_kg`` is the interval of the twin's Estimate; ``center_of_mass_m`` is
    the largest shift of the centre of mass.
    """

    pose_m: float
    pose_deg: float
    friction: tuple[float, float]
    force: tuple[float, float]
    mass_kg: tuple[float, float]
    center_of_mass_m: float


@dataclass(frozen=True)
class FillCurve:
    """Centre of mass and inertia of a vessel as functions of its mass, from empty to full.

    ``masses_kg (K,)`` is increasing. ``centers_m (K, 3)`` are centres of mass and ``inertias_kg_m2 (K, 3, 3)`` the
    inertia tensors about them, in the object frame. ``uncertainties_m (K,)`` bounds the error of each centre.
    """

    masses_kg: np.ndarray
    centers_m: np.ndarray
    inertias_kg_m2: np.ndarray
    uncertainties_m: np.ndarray

    def uncertainty_share(self, mass_kg: float) -> float:
        """Return the uncertainty of the centre of mass at ``mass_kg``, relative to the largest uncertainty of the curve."""
        most_m = float(self.uncertainties_m.max())
        return float(np.interp(mass_kg, self.masses_kg, self.uncertainties_m)) / most_m if most_m > 0 else 0.0

    def filled(self, body: RigidBody, mass_kg: float) -> RigidBody:
        """Return the body with the vessel's mass properties at ``mass_kg``, interpolated linearly between the known states.

        Below the empty and above the full mass, the properties of the nearest known state are scaled.
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
    """One sample: translation (m) and rotation vector (rad) of the hand in its own frame, factors, mass, centre of mass shift."""

    shift_m: np.ndarray
    turn_rad: np.ndarray
    friction: float
    force: float
    mass_kg: float
    center_of_mass_shift_m: np.ndarray

    def grasp(self, gripper_to_object: np.ndarray, depth_m: float) -> np.ndarray:
        """Return the grasp ``(4, 4)`` translated, and rotated about the fingertips' centre, ``depth_m`` along the approach."""
        rotation = gripper_to_object[:3, :3] @ Rotation.from_rotvec(self.turn_rad).as_matrix()
        tip = gripper_to_object[:3, 3] + depth_m * gripper_to_object[:3, 2]
        shift = gripper_to_object[:3, :3] @ self.shift_m
        return transform(rotation, tip + shift - depth_m * rotation[:, 2])

    def body(self, body: RigidBody, filling: FillCurve | None = None) -> RigidBody:
        """Return the body with perturbed mass, centre of mass and friction; the inertia scales with the mass.

        For a vessel, ``filling`` gives the centre of mass and its uncertainty at the sampled mass, and scales the
        sampled shift, which was drawn for the least certain state.
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
        """Return the settings with perturbed closing force and finger friction."""
        return replace(
            settings, force_n=settings.force_n * self.force, finger_friction=settings.finger_friction * self.friction
        )


def draw_perturbations(spread: PerturbationRanges, count: int, seed: int) -> list[Perturbation]:
    """Draw ``count`` perturbations from a scrambled Sobol sequence; the same for every grasp of an object.

    Translations and rotations are uniform in their balls, factors are uniform, masses are log-uniform.
    """
    from scipy.stats import qmc  # imported here because it takes about a second and only trials need it

    # A scrambled Sobol sequence is balanced only at powers of two, so the next power is drawn and its first points are
    # used.
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
    """Map four numbers in [0, 1] to a point ``(3,)`` uniform in the unit ball: a direction and a radius."""
    direction = ndtri(np.clip(unit[:3], 1e-9, 1 - 1e-9))
    return np.asarray(direction / np.linalg.norm(direction) * np.cbrt(unit[3]))


def jittered(
    gripper_to_object: np.ndarray, depth_m: np.ndarray, rng: np.random.Generator, *, sigma_deg: float, sigma_m: float
) -> np.ndarray:
    """Return grasps ``(N, 4, 4)`` with normally distributed rotation about the fingertips' centre and translation.

    ``sigma_deg`` applies to each Euler angle in the gripper frame, ``sigma_m`` to each axis of the object frame. The
    rotation is about the fingertips because the same angles about the wrist would move most fingers off the object.
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
