"""The search for measures and view: a grid of views with the usual measures, then least squares from the best of them.

The outline's signed distance is matched by the method of Levenberg (1944) and Marquardt (1963) with finite differences and
the measures' intervals, the upright camera and the usual lens as weak priors; inner edges and shading then choose.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from manitwin.models.generators.templates.fitting.drawing import silhouette, to_pixels
from manitwin.models.generators.templates.fitting.evidence import BOX_SHARE, FOCAL_SPREAD, SIDE_PX, Evidence
from manitwin.models.generators.templates.fitting.residual import (
    Residual,
    iou,
    outline_difference,
    residual,
)
from manitwin.models.generators.templates.fitting.shape import MOST_SPREADS, CoarseSolid, Family
from manitwin.models.generators.templates.fitting.view import LEAST_PERSPECTIVE, MOST_PERSPECTIVE, View, boxed

ELEVATIONS_DEG = (4.0, 20.0, 36.0, 54.0, 78.0)
YAWS = 12
_ROUND_IOU = 0.985
_TILTED_COST = 0.04  # of IoU: most things are photographed as they rest
_STARTS, _STARTS_OF_OTHERS = 7, 3
_REFINED, _RIVALS = 2, 2
_OTHER_KIND_COST = 0.02
_USUAL_ELEVATION_DEG, _STEEP_COST = 30.0, 0.0005  # a degree more: what stands is seldom seen from above
_UPRIGHT_ROLL_RAD, _FREE_ROLL_RAD = np.radians(6.0), np.radians(60.0)
_PRIOR = 0.15  # weight of one standard deviation of a prior, in the outline's residual
_TRIES = 4
_ENOUGH = 0.98
_KEPT_ROUNDS = 3
_SPREAD_STEP = 0.35
_POSE_STEPS = (0.06, 0.06, 0.03, 0.3, 0.015, 0.01, 0.01)


@dataclass(frozen=True)
class Candidate:
    """Measures of a family by their spreads, a view, and what they leave unexplained; ``upright``: the camera was not rolled."""

    family: Family
    spreads: np.ndarray
    view: View
    upright: bool
    residual: Residual


def search(families: Sequence[Family], evidence: Evidence) -> list[Candidate]:
    """Return fits to a photo, the best first; empty where no usual measures give a solid.

    The first family is what the photo is said to show, the others what may be meant: they have to explain it better.
    """
    found: list[_Start] = []
    usual: dict[int, _Start] = {}
    for number, family in enumerate(families):
        spreads = np.zeros(len(family.free))
        solid = family.solid(spreads)
        if solid is None:
            continue
        turns = is_round(solid)
        problem = _Problem(family, evidence, turns)
        for start, upright in grid(solid, evidence, turns)[: _STARTS if number == 0 else _STARTS_OF_OTHERS]:
            _, view = problem.solve(spreads, start, upright, measures=False, rounds=2)
            cost = residual(solid, view, evidence).cost + _prejudice(family, number, view, upright)
            found.append(_Start(cost, number, problem, view, upright))
            if upright and np.degrees(start.elevation_rad) < _USUAL_ELEVATION_DEG:
                usual.setdefault(number, _Start(cost, number, problem, start, upright))
    found.sort(key=lambda each: (each.cost, each.number))
    candidates = []
    for chosen in _refined(found, usual):
        family, upright = families[chosen.number], chosen.upright
        at, view = chosen.problem.solve(np.zeros(len(family.free)), chosen.view, upright, measures=True, rounds=6)
        final = family.solid(at)
        if final is not None:
            left = residual(final, view, evidence)
            cost = left.cost + _prejudice(family, chosen.number, view, upright)
            candidates.append((cost, Candidate(family, at, view, upright, left)))
    return [candidate for _, candidate in sorted(candidates, key=lambda each: each[0])]


@dataclass(frozen=True)
class _Start:
    """A view from which a family, by its number, is fitted with its measures."""

    cost: float
    number: int
    problem: _Problem
    view: View
    upright: bool


def _refined(found: list[_Start], usual: dict[int, _Start]) -> list[_Start]:
    """Return the starts that get their measures: the best of what is said, the best of each near rival, and the usual view.

    A thing of unusual proportions looks like a usual one from higher up, so the best view is not enough.
    """
    said = [start for start in found if start.number == 0][:_REFINED]
    best = {start.number: start for start in reversed(found) if start.number}
    rivals = sorted(best.values(), key=lambda start: (start.cost, start.number))[:_RIVALS]
    return [*said, *rivals, *(usual[number] for number in (0, *(rival.number for rival in rivals)) if number in usual)]


def _prejudice(family: Family, number: int, view: View, upright: bool) -> float:
    """Return what a fit has to explain better for being a rarer view, or another kind than is said."""
    steep = max(0.0, float(np.degrees(view.elevation_rad)) - _USUAL_ELEVATION_DEG)
    rare = _STEEP_COST * steep if family.stands and upright else 0.0
    return rare + (0.0 if upright else _TILTED_COST) + (_OTHER_KIND_COST if number else 0.0)


def is_round(solid: CoarseSolid) -> bool:
    """Tell whether a turn about the upright axis changes nothing that an outline shows."""
    views = [View(yaw, 0.5, 0.0, 0.1) for yaw in np.radians((0.0, 37.0, 90.0))]
    masks = []
    for view in views:
        flat, _ = view.project(solid.vertices)
        masks.append(silhouette(to_pixels(0.5 * flat, 96, 0.8), solid.faces, solid.edges, 96) > 0)
    shared = [(masks[0] & other).sum() / (masks[0] | other).sum() for other in masks[1:]]
    return min(shared) > _ROUND_IOU


def grid(solid: CoarseSolid, evidence: Evidence, turns: bool) -> list[tuple[View, bool]]:
    """Return views of a solid by how well its outline agrees with the photo's, the best first, whether upright beside each."""
    lean = principal_angle(evidence.mask)
    scored: list[tuple[float, View, bool]] = []
    perspective = float(np.clip(evidence.perspective / 1.6, LEAST_PERSPECTIVE, MOST_PERSPECTIVE))
    for elevation in np.radians(ELEVATIONS_DEG):
        for yaw in [0.0] if turns else np.arange(YAWS) * 2 * np.pi / YAWS:
            upright = View(float(yaw), float(elevation), 0.0, perspective)
            flat, _ = upright.project(solid.vertices)
            scale, x, y = boxed(flat)
            mask = silhouette(to_pixels(flat * scale + (x, y), SIDE_PX, BOX_SHARE), solid.faces, solid.edges, SIDE_PX)
            scored.append((iou(mask, evidence), replace(upright, scale=scale, x=x, y=y), True))
            turn = lean - principal_angle(mask > 0)
            for roll in (turn, turn + np.pi):
                rolled = replace(upright, roll_rad=float((roll + np.pi) % (2 * np.pi) - np.pi))
                scale_r, x_r, y_r = boxed(rolled.project(solid.vertices)[0])
                placed = replace(rolled, scale=scale_r, x=x_r, y=y_r)
                turned = _turned(mask, replace(upright, scale=scale, x=x, y=y), placed)
                scored.append((iou(turned, evidence) - _TILTED_COST, placed, False))
    scored.sort(key=lambda each: -each[0])
    kept: list[tuple[View, bool]] = []
    for _, view, rests in scored:
        if all(_apart(view, other) for other, _ in kept):
            kept.append((view, rests))
        if len(kept) == _STARTS:
            break
    return kept


def principal_angle(mask: np.ndarray) -> float:
    """Return the angle of a mask's longer axis, clockwise from x on the screen, in radians."""
    moments = cv2.moments(mask.astype(np.uint8), binaryImage=True)
    return 0.5 * float(np.arctan2(2 * moments["mu11"], moments["mu20"] - moments["mu02"]))


def _turned(mask: np.ndarray, before: View, after: View) -> np.ndarray:
    """Return the picture of one view rolled, scaled and moved to another that differs in nothing else."""
    turn = after.roll_rad - before.roll_rad
    ratio = after.scale / before.scale
    matrix = ratio * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    size, middle = BOX_SHARE * SIDE_PX, (SIDE_PX - 1) / 2
    shift = np.array([after.x, after.y]) * size + middle - matrix @ (np.array([before.x, before.y]) * size + middle)
    return np.asarray(cv2.warpAffine(mask, np.column_stack([matrix, shift]), mask.shape, flags=cv2.INTER_NEAREST))


def _apart(one: View, other: View) -> bool:
    return float(np.trace(one.object_to_camera @ other.object_to_camera.T)) < 1 + 2 * np.cos(np.radians(12.0))


class _Problem:
    """The least squares problem of one template and one photo."""

    def __init__(self, family: Family, evidence: Evidence, turns: bool):
        self._family, self._evidence, self._turns = family, evidence, turns
        self._focal = float(np.log(np.clip(evidence.perspective / 1.6, LEAST_PERSPECTIVE, MOST_PERSPECTIVE)))

    def solve(
        self, spreads: np.ndarray, view: View, upright: bool, *, measures: bool, rounds: int
    ) -> tuple[np.ndarray, View]:
        """Return measures (left as they are unless ``measures``) and view of the least sum of squares near a start.

        Derivatives are central differences over steps of a pixel or two: shorter ones would follow the pixels' corners.
        """
        count = len(spreads) if measures else 0
        at = np.concatenate([spreads[:count], self._encode(view)])
        middle_roll = 0.0 if upright else view.roll_rad
        solid = self._family.solid(spreads)
        if solid is None:
            return spreads, view
        moves = self._family.changes(spreads, _SPREAD_STEP) if measures else []

        def residuals(x: np.ndarray, seen: CoarseSolid | None) -> np.ndarray | None:
            if seen is None:
                return None
            drawn = outline_difference(seen, self._decode(x[count:]), self._evidence)
            full = np.concatenate([x[:count], spreads[count:]])
            return np.concatenate([drawn, self._prior(full, x[count:], upright, middle_roll)])

        def built(x: np.ndarray) -> CoarseSolid | None:
            return self._family.solid(np.concatenate([x[:count], spreads[count:]]))

        value = residuals(at, solid)
        assert value is not None
        damping = 0.02
        jacobian = np.zeros((len(value), len(at)))
        for number in range(rounds):
            for k in range(len(at)):
                # a build costs ten times a picture: the column of a measure that changes the faces is kept a while
                if (k == count and self._turns) or (k < count and moves[k] is None and number % _KEPT_ROUNDS):
                    continue
                step = _SPREAD_STEP if k < count else float(_POSE_STEPS[k - count])
                sides = []
                for side, sign in enumerate((1.0, -1.0)):
                    moved = at.copy()
                    moved[k] += sign * step
                    move = moves[k] if k < count else None
                    if move is not None and len(move[side]) == len(solid.vertices):
                        other = residuals(moved, solid.reshaped(solid.vertices + move[side]))
                    else:
                        other = residuals(moved, built(moved) if k < count else solid)
                    sides.append(other)
                if sides[0] is not None and sides[1] is not None:
                    jacobian[:, k] = (sides[0] - sides[1]) / (2 * step)
            gram, slope, before = jacobian.T @ jacobian, jacobian.T @ value, float(value @ value)
            for _ in range(_TRIES):
                change = -np.linalg.solve(gram + damping * np.diag(np.diag(gram)) + 1e-9 * np.eye(len(at)), slope)
                trial = self._bounded(at + change, count)
                tried = built(trial)
                other = residuals(trial, tried)
                if other is not None and tried is not None and float(other @ other) < before:
                    at, value, solid, damping = trial, other, tried, max(damping / 3, 1e-3)
                    break
                damping *= 8
            else:
                break
            if float(value @ value) > _ENOUGH * before:
                break
        return np.concatenate([at[:count], spreads[count:]]), self._decode(at[count:])

    def _prior(self, spreads: np.ndarray, pose: np.ndarray, upright: bool, middle_roll: float) -> np.ndarray:
        roll = (pose[2] - middle_roll) / (_UPRIGHT_ROLL_RAD if upright else _FREE_ROLL_RAD)
        return _PRIOR * np.concatenate([spreads, [roll, (pose[3] - self._focal) / FOCAL_SPREAD]])

    def _encode(self, view: View) -> np.ndarray:
        log_perspective, log_scale = np.log(view.perspective), np.log(view.scale)
        return np.array([view.yaw_rad, view.elevation_rad, view.roll_rad, log_perspective, log_scale, view.x, view.y])

    def _decode(self, pose: np.ndarray) -> View:
        yaw, elevation, roll, perspective, scale, x, y = pose.tolist()
        return View(yaw, elevation, roll, float(np.exp(perspective)), float(np.exp(scale)), x, y)

    def _bounded(self, at: np.ndarray, count: int) -> np.ndarray:
        out = at.copy()
        out[:count] = np.clip(out[:count], -MOST_SPREADS, MOST_SPREADS)
        out[count + 1] = np.clip(out[count + 1], np.radians(-12.0), np.radians(90.0))
        out[count + 3] = np.clip(out[count + 3], np.log(LEAST_PERSPECTIVE), np.log(MOST_PERSPECTIVE))
        return out
