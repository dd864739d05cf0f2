"""Global search for measures and view: a grid of views with the typical measures, then least squares from the best ones.

Silhouettes alone drive the least squares (``least_squares``); inner edges, shading and hidden parts then select the result.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from manitwin.models.generators.templates.fitting.drawing import silhouette, to_pixels
from manitwin.models.generators.templates.fitting.evidence import BOX_SHARE, SIDE_PX, Evidence
from manitwin.models.generators.templates.fitting.least_squares import CONVERGED_RATIO, PlacedView, Problem
from manitwin.models.generators.templates.fitting.residual import Residual, iou, residual
from manitwin.models.generators.templates.fitting.shape import CoarseSolid, ShapeFamily
from manitwin.models.generators.templates.fitting.view import LEAST_PERSPECTIVE, MOST_PERSPECTIVE, View, frame_placement

ELEVATIONS_DEG = (4.0, 20.0, 36.0, 54.0, 78.0)
YAWS = 12
_ROUND_IOU = 0.985
_ROLLED_COST = 0.04  # in IoU: most objects are photographed at rest
_STARTS, _STARTS_OF_OTHERS = 7, 3
_REFINED, _RIVALS = 2, 2
_ROUNDS = 6
_SETTLED_ROUNDS, _SETTLED_ENOUGH = 12, 0.9995
"""With an earlier stop, the measures from two image sizes of one photo differ by 3 %."""
_OTHER_CATEGORY_COST = 0.02
_OTHER_MEASURES_COST = 0.005  # same category, other measures: resolves silhouette ambiguities
_USUAL_ELEVATION_DEG, _STEEP_COST = 30.0, 0.0005  # per degree: standing objects are seldom seen from above


@dataclass(frozen=True)
class Candidate:
    """A fit: measures of a family (in spreads), view, and residual; ``upright`` means that the camera was not rolled."""

    family: ShapeFamily
    spreads: np.ndarray
    view: View
    upright: bool
    residual: Residual


def search(families: Sequence[ShapeFamily], evidence: Evidence, *, settled: bool = False) -> list[Candidate]:
    """Return fits to a photo, best first; empty if no usual measures give a solid.

    The first family is the named one. Other families must explain the photo better by a margin, which is smaller if only the
    expected measures differ. ``settled`` iterates until the measures hardly change, which is unnecessary before a joint fit with
    other photos.
    """
    found: list[_Start] = []
    usual: dict[int, _Start] = {}
    for number, family in enumerate(families):
        spreads = np.zeros(len(family.free))
        solid = family.solid(spreads)
        if solid is None:
            continue
        turns = is_round(solid)
        problem = Problem(family, [evidence], turns)
        same_kind = family.template is families[0].template
        for start, upright in rank_views(solid, evidence, turns)[: _STARTS if same_kind else _STARTS_OF_OTHERS]:
            _, (placed,) = problem.solve(spreads, [PlacedView(start, upright)], measures=False, rounds=2)
            view = placed.view
            cost = residual(solid, view, evidence).cost + _prior_penalty(family, families[0], view, upright)
            found.append(_Start(cost, number, problem, view, upright))
            if upright and np.degrees(start.elevation_rad) < _USUAL_ELEVATION_DEG:
                usual.setdefault(number, _Start(cost, number, problem, start, upright))
    found.sort(key=lambda each: (each.cost, each.number))
    candidates = []
    for chosen in _select_starts(found, usual):
        family, upright = families[chosen.number], chosen.upright
        begin = [PlacedView(chosen.view, upright)]
        at, (placed,) = chosen.problem.solve(
            np.zeros(len(family.free)),
            begin,
            measures=True,
            rounds=_SETTLED_ROUNDS if settled else _ROUNDS,
            enough=_SETTLED_ENOUGH if settled else CONVERGED_RATIO,
        )
        view, final = placed.view, family.solid(at)
        if final is not None:
            left = residual(final, view, evidence)
            cost = left.cost + _prior_penalty(family, families[0], view, upright)
            candidates.append((cost, Candidate(family, at, view, upright, left)))
    return [candidate for _, candidate in sorted(candidates, key=lambda each: each[0])]


@dataclass(frozen=True)
class _Start:
    """A starting view of a family, identified by its number."""

    cost: float
    number: int
    problem: Problem
    view: View
    upright: bool


def _select_starts(found: list[_Start], usual: dict[int, _Start]) -> list[_Start]:
    """Return the starts to refine with measures: the best of the named family, the best of each close rival, and the usual view.

    An object of unusual proportions looks like a usual one seen from higher up, so the best view alone does not suffice.
    """
    of_said = [start for start in found if start.number == 0]
    said = of_said[:_REFINED]
    if not any(start.upright for start in said):  # a box on its edge may be an upright box of other proportions
        said += [start for start in of_said if start.upright][:1]
    best = {start.number: start for start in reversed(found) if start.number}
    rivals = sorted(best.values(), key=lambda start: (start.cost, start.number))[:_RIVALS]
    return [*said, *rivals, *(usual[number] for number in (0, *(rival.number for rival in rivals)) if number in usual)]


def steep_cost(view: View) -> float:
    """Return the penalty of a standing object seen from higher up than usual."""
    return _STEEP_COST * max(0.0, float(np.degrees(view.elevation_rad)) - _USUAL_ELEVATION_DEG)


def _prior_penalty(family: ShapeFamily, said: ShapeFamily, view: View, upright: bool) -> float:
    """Return the penalty for an unusual view, another category, or other expected measures."""
    rare = steep_cost(view) if family.stands and upright else 0.0
    other = 0.0 if family is said else _OTHER_CATEGORY_COST
    if family is not said and family.template is said.template:
        other = _OTHER_MEASURES_COST
    return rare + (0.0 if upright else _ROLLED_COST) + other


def is_round(solid: CoarseSolid) -> bool:
    """Return whether a rotation about the vertical changes no silhouette."""
    views = [View(yaw, 0.5, 0.0, 0.1) for yaw in np.radians((0.0, 37.0, 90.0))]
    masks = []
    for view in views:
        flat, _ = view.project(solid.vertices)
        masks.append(silhouette(to_pixels(0.5 * flat, 96, 0.8), solid.faces, solid.edges, 96) > 0)
    shared = [(masks[0] & other).sum() / (masks[0] | other).sum() for other in masks[1:]]
    return min(shared) > _ROUND_IOU


def rank_views(solid: CoarseSolid, evidence: Evidence, turns: bool) -> list[tuple[View, bool]]:
    """Return views ranked by silhouette overlap with the photo, best first, each with whether the camera is upright."""
    evidence = evidence.for_comparison(perforated=solid.perforated)
    lean = principal_angle(evidence.mask)
    scored: list[tuple[float, View, bool]] = []
    perspective = float(np.clip(evidence.perspective / 1.6, LEAST_PERSPECTIVE, MOST_PERSPECTIVE))
    for elevation in np.radians(ELEVATIONS_DEG):
        for yaw in [0.0] if turns else np.arange(YAWS) * 2 * np.pi / YAWS:
            upright = View(float(yaw), float(elevation), 0.0, perspective)
            flat, _ = upright.project(solid.vertices)
            scale, x, y = frame_placement(flat)
            mask = silhouette(to_pixels(flat * scale + (x, y), SIDE_PX, BOX_SHARE), solid.faces, solid.edges, SIDE_PX)
            scored.append((iou(mask, evidence), replace(upright, scale=scale, x=x, y=y), True))
            turn = lean - principal_angle(mask > 0)
            for roll in (turn, turn + np.pi):
                rolled = replace(upright, roll_rad=float((roll + np.pi) % (2 * np.pi) - np.pi))
                scale_r, x_r, y_r = frame_placement(rolled.project(solid.vertices)[0])
                placed = replace(rolled, scale=scale_r, x=x_r, y=y_r)
                turned = _warp_mask(mask, replace(upright, scale=scale, x=x, y=y), placed)
                scored.append((iou(turned, evidence) - _ROLLED_COST, placed, False))
    scored.sort(key=lambda each: -each[0])
    kept: list[tuple[View, bool]] = []
    for _, view, rests in scored:
        if all(_is_distinct_view(view, other) for other, _ in kept):
            kept.append((view, rests))
        if len(kept) == _STARTS:
            break
    return kept


def principal_angle(mask: np.ndarray) -> float:
    """Return the angle of a mask's major axis, clockwise from x on the screen, in radians."""
    moments = cv2.moments(mask.astype(np.uint8), binaryImage=True)
    return 0.5 * float(np.arctan2(2 * moments["mu11"], moments["mu20"] - moments["mu02"]))


def _warp_mask(mask: np.ndarray, before: View, after: View) -> np.ndarray:
    """Return the mask of one view warped to another that differs only in roll, scale and position."""
    turn = after.roll_rad - before.roll_rad
    ratio = after.scale / before.scale
    matrix = ratio * np.array([[np.cos(turn), -np.sin(turn)], [np.sin(turn), np.cos(turn)]])
    size, middle = BOX_SHARE * SIDE_PX, (SIDE_PX - 1) / 2
    shift = np.array([after.x, after.y]) * size + middle - matrix @ (np.array([before.x, before.y]) * size + middle)
    return np.asarray(cv2.warpAffine(mask, np.column_stack([matrix, shift]), mask.shape, flags=cv2.INTER_NEAREST))


def _is_distinct_view(one: View, other: View) -> bool:
    return float(np.trace(one.object_to_camera @ other.object_to_camera.T)) < 1 + 2 * np.cos(np.radians(12.0))
