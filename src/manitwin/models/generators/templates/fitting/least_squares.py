"""Least squares fit of measures and views to the silhouettes of photos.

Truncated signed distances to the contours are matched by the method of Levenberg (1944) and Marquardt (1963). The measures'
intervals, the upright camera and the usual lens are weak priors.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.models.generators.templates.fitting.evidence import Evidence
from manitwin.models.generators.templates.fitting.residual import outline_difference
from manitwin.models.generators.templates.fitting.shape import MOST_SPREADS, CoarseSolid, ShapeFamily
from manitwin.models.generators.templates.fitting.view import LEAST_PERSPECTIVE, MOST_PERSPECTIVE, View

_UPRIGHT_ROLL_RAD, _FREE_ROLL_RAD = np.radians(6.0), np.radians(60.0)
_PRIOR = 0.15  # weight of one standard deviation of a prior, in units of the contour residual
_FIRST_DAMPING, _LEAST_DAMPING = 0.02, 1e-3
_TRIES = 4
CONVERGED_RATIO = 0.98
_KEPT_ROUNDS = 3
# Steps of a pixel or two; shorter ones would follow the pixel grid.
_SPREAD_STEP = 0.35
_POSE_STEPS = (0.06, 0.06, 0.03, 0.3, 0.015, 0.01, 0.01)
_POSE = len(_POSE_STEPS)


@dataclass(frozen=True)
class PlacedView:
    """A view of a photo; ``upright`` means that the camera was not rolled, so that its roll is near zero."""

    view: View
    upright: bool


class Problem:
    """Least squares problem of one family of shapes and one or several photos of the same object."""

    def __init__(self, family: ShapeFamily, evidences: Sequence[Evidence], turns: bool):
        """Take the family, the evidence of the photos, and whether a rotation about the vertical changes no silhouette."""
        self._family, self._evidences, self._turns = family, list(evidences), turns
        usual = [np.clip(each.perspective / 1.6, LEAST_PERSPECTIVE, MOST_PERSPECTIVE) for each in evidences]
        self._usual = [float(np.log(perspective)) for perspective in usual]

    def solve(
        self,
        spreads: np.ndarray,
        placed: Sequence[PlacedView],
        *,
        measures: bool,
        rounds: int,
        enough: float = CONVERGED_RATIO,
    ) -> tuple[np.ndarray, list[PlacedView]]:
        """Return measures (unchanged unless ``measures``) and a view per photo, starting from the given ones.

        Stops after ``rounds`` iterations, or after one that leaves more than ``enough`` of the previous sum of squares.
        """
        solid = self._family.solid(spreads)
        if solid is None:
            return spreads, list(placed)
        count = len(spreads) if measures else 0
        state = _Linearization(self, spreads, placed, count)
        at = np.concatenate([spreads[:count], *(_encoded(each.view) for each in placed)])
        value = state.residuals(at, solid)
        jacobian = np.zeros((len(value), len(at)))
        damping = _FIRST_DAMPING
        for number in range(rounds):
            state.derive(jacobian, at, solid, number)
            gram, slope, before = jacobian.T @ jacobian, jacobian.T @ value, float(value @ value)
            for _ in range(_TRIES):
                change = -np.linalg.solve(gram + damping * np.diag(np.diag(gram)) + 1e-9 * np.eye(len(at)), slope)
                trial = _clip_parameters(at + change, count)
                tried = state.solid_at(trial)
                other = None if tried is None else state.residuals(trial, tried)
                if tried is not None and other is not None and float(other @ other) < before:
                    at, value, solid, damping = trial, other, tried, max(damping / 3, _LEAST_DAMPING)
                    break
                damping *= 8
            else:
                break
            if float(value @ value) > enough * before:
                break
        views = [PlacedView(_decoded(pose), each.upright) for pose, each in zip(_poses(at, count), placed, strict=True)]
        return np.concatenate([at[:count], spreads[count:]]), views


class _Linearization:
    """The residuals of a problem near one starting point, and their derivatives."""

    def __init__(self, problem: Problem, spreads: np.ndarray, placed: Sequence[PlacedView], count: int):
        self._problem, self._spreads, self._count = problem, spreads, count
        self._rolls = [
            (0.0, _UPRIGHT_ROLL_RAD) if each.upright else (each.view.roll_rad, _FREE_ROLL_RAD) for each in placed
        ]
        self._moves = problem._family.vertex_displacements(spreads, _SPREAD_STEP) if count else []

    def solid_at(self, at: np.ndarray) -> CoarseSolid | None:
        return self._problem._family.solid(np.concatenate([at[: self._count], self._spreads[self._count :]]))

    def residuals(self, at: np.ndarray, solid: CoarseSolid) -> np.ndarray:
        blocks = [self._block(number, pose, solid) for number, pose in enumerate(_poses(at, self._count))]
        return np.concatenate([*blocks, _PRIOR * at[: self._count]])

    def derive(self, jacobian: np.ndarray, at: np.ndarray, solid: CoarseSolid, number: int) -> None:
        """Fill in the Jacobian by central differences; a pose only affects the residuals of its own photo."""
        for k in range(self._count):
            # Building a solid costs ten times as much as drawing it: columns of measures that change the faces are reused for
            # some rounds.
            if self._moves[k] is not None or number % _KEPT_ROUNDS == 0:
                sides = [self._perturbed_residuals(at, solid, k, side) for side in (0, 1)]
                if sides[0] is not None and sides[1] is not None:
                    jacobian[:, k] = (sides[0] - sides[1]) / (2 * _SPREAD_STEP)
        poses = _poses(at, self._count)
        length = (len(jacobian) - self._count) // len(poses)
        for photo, pose in enumerate(poses):
            rows = slice(photo * length, (photo + 1) * length)
            for k in range(1 if self._problem._turns else 0, _POSE):
                step = np.eye(_POSE)[k] * _POSE_STEPS[k]
                more, less = (self._block(photo, pose + sign * step, solid) for sign in (1.0, -1.0))
                jacobian[rows, self._count + photo * _POSE + k] = (more - less) / (2 * _POSE_STEPS[k])

    def _perturbed_residuals(self, at: np.ndarray, solid: CoarseSolid, k: int, side: int) -> np.ndarray | None:
        moved, move = at.copy(), self._moves[k]
        moved[k] += _SPREAD_STEP * (1 - 2 * side)
        if move is not None and len(move[side]) == len(solid.vertices):
            return self.residuals(moved, solid.with_vertices(solid.vertices + move[side]))
        other = self.solid_at(moved)
        return None if other is None else self.residuals(moved, other)

    def _block(self, number: int, pose: np.ndarray, solid: CoarseSolid) -> np.ndarray:
        middle, spread = self._rolls[number]
        evidence = self._problem._evidences[number]
        prior = [(pose[2] - middle) / spread, (pose[3] - self._problem._usual[number]) / evidence.focal_spread]
        drawn = outline_difference(solid, _decoded(pose), evidence)
        return np.concatenate([drawn, _PRIOR * np.array(prior)])


def _poses(at: np.ndarray, count: int) -> np.ndarray:
    return np.asarray(at[count:].reshape(-1, _POSE))


def _encoded(view: View) -> np.ndarray:
    log_perspective, log_scale = np.log(view.perspective), np.log(view.scale)
    return np.array([view.yaw_rad, view.elevation_rad, view.roll_rad, log_perspective, log_scale, view.x, view.y])


def _decoded(pose: np.ndarray) -> View:
    yaw, elevation, roll, perspective, scale, x, y = pose.tolist()
    return View(yaw, elevation, roll, float(np.exp(perspective)), float(np.exp(scale)), x, y)


def _clip_parameters(at: np.ndarray, count: int) -> np.ndarray:
    out = at.copy()
    out[:count] = np.clip(out[:count], -MOST_SPREADS, MOST_SPREADS)
    poses = _poses(out, count)
    poses[:, 1] = np.clip(poses[:, 1], np.radians(-12.0), np.radians(90.0))
    poses[:, 3] = np.clip(poses[:, 3], np.log(LEAST_PERSPECTIVE), np.log(MOST_PERSPECTIVE))
    return np.concatenate([out[:count], poses.ravel()])
