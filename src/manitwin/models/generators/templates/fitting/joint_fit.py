"""Joint fit of one template to several photos of an object: common measures, and one view per photo."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.drawing import silhouette, to_pixels
from manitwin.models.generators.templates.fitting.evidence import BOX_SHARE, SIDE_PX, Evidence, extract_evidence
from manitwin.models.generators.templates.fitting.fit import (
    TemplateFit,
    assemble_fit,
    build_fitted_object,
    confidence_of,
)
from manitwin.models.generators.templates.fitting.least_squares import PlacedView, Problem
from manitwin.models.generators.templates.fitting.residual import iou, residual
from manitwin.models.generators.templates.fitting.search import ELEVATIONS_DEG, Candidate, is_round, search
from manitwin.models.generators.templates.fitting.shape import CoarseSolid, ShapeFamily
from manitwin.models.generators.templates.fitting.view import LEAST_PERSPECTIVE, MOST_PERSPECTIVE, View, frame_placement

_YAWS = 24
_TIED_STARTS, _RIVALS = 3, 3
_LEAST_OWN_CONFIDENCE = 0.9
_FAR_DEG, _CLEARLY_WORSE = 40.0, 0.03
"""A rotation is a rival if it is farther away than this angle and its cost is not higher by this amount."""


@dataclass(frozen=True)
class JointFit:
    """A fit of each photo, all with the same ``made``. ``told (N,)``: no distant rotation explains the photo about as well."""

    fits: tuple[TemplateFit, ...]
    has_unique_turn: tuple[bool, ...]

    @property
    def confidence(self) -> float:
        """The minimum confidence of the photos."""
        return min(fit.confidence for fit in self.fits)

    @property
    def turns_deg(self) -> tuple[float, ...]:
        """The camera's rotation about the object's vertical per photo, counter-clockwise, in 0..360, relative to the
        first photo.
        """
        first = self.fits[0].view.yaw_rad
        return tuple(round(float(np.degrees(first - fit.view.yaw_rad)) % 360.0, 1) % 360.0 for fit in self.fits)


def fit_several(
    category: str,
    photos: Sequence[np.ndarray],
    initial_measures: Mapping[str, float] | None = None,
    *,
    turns_deg: Sequence[float] | None = None,
    focals_mm: Sequence[float | None] | None = None,
) -> JointFit | None:
    """Fit one object of a category to several photos ``(H, W, 4) uint8`` of it with its masks as alpha.

    The measures are common, the views are per photo. ``turns_deg``, the camera's counter-clockwise rotations about the vertical,
    give the start of the view search. ``focals_mm`` are focal lengths (35 mm equivalent), if known. Returns None if no measures
    give a solid.
    """
    template = load_templates()[category]
    lenses = [None] * len(photos) if focals_mm is None else focals_mm
    evidences = [extract_evidence(rgba, focal_mm) for rgba, focal_mm in zip(photos, lenses, strict=True)]
    usual = ShapeFamily(template, initial_measures)
    searched = range(len(photos)) if turns_deg is None else [0, _most_crossing(turns_deg)]
    alone = [found[0] for number in searched if (found := search([usual], evidences[number]))]
    if len(alone) < len(searched):
        return None
    # The best explained photo resolves the orientation: a box has two widths that can be swapped.
    best = min(alone, key=lambda candidate: candidate.residual.cost)
    family = ShapeFamily(template, best.family.measures(best.spreads))
    start = np.zeros(len(family.free))
    solid = family.solid(start)
    assert solid is not None  # the best fit has a solid
    round_about = is_round(solid)
    problem = Problem(family, evidences, round_about)
    if turns_deg is None:
        placed = [_find_view(family, solid, candidate, evidences[k]) for k, candidate in enumerate(alone)]
    else:
        start, placed = _fit_at_stated_turns(problem, family, solid, evidences, alone, turns_deg)
    spreads, placed = problem.solve(start, placed, measures=True, rounds=8)
    final = family.solid(spreads) or solid
    try:
        made = build_fitted_object(family.template, family.measures(spreads))
    except SolidError:
        return None
    fits = [
        assemble_fit(made, each, residual(final, each.view, evidence), evidence)
        for each, evidence in zip(placed, evidences, strict=True)
    ]
    told = [
        not round_about and _has_unique_turn(ShapeFamily(template, family.measures(spreads)), fit, evidence)
        for fit, evidence in zip(fits, evidences, strict=True)
    ]
    return JointFit(tuple(fits), tuple(told))


def _most_crossing(turns_deg: Sequence[float]) -> int:
    """Return the photo whose direction is closest to a right angle with that of the first."""
    return int(np.argmax(np.abs(np.sin(np.radians(np.subtract(turns_deg, turns_deg[0]))))[1:])) + 1


def _find_view(family: ShapeFamily, solid: CoarseSolid, candidate: Candidate, evidence: Evidence) -> PlacedView:
    """Return the view of a common solid in a photo: that of its own fit, or a new search if that explains less."""
    begin = PlacedView(_centre_in_frame(solid, candidate.view), candidate.upright)
    _, (placed,) = Problem(family, [evidence], False).solve(
        np.zeros(len(family.free)), [begin], measures=False, rounds=3
    )
    left = residual(solid, placed.view, evidence)
    if left.cost < candidate.residual.cost + _CLEARLY_WORSE and confidence_of(left) > _LEAST_OWN_CONFIDENCE:
        return placed
    again = search([family], evidence)[0]
    return PlacedView(again.view, again.upright)


def _fit_at_stated_turns(
    problem: Problem,
    family: ShapeFamily,
    solid: CoarseSolid,
    evidences: Sequence[Evidence],
    alone: Sequence[Candidate],
    turns_deg: Sequence[float],
) -> tuple[np.ndarray, list[PlacedView]]:
    """Return measures and views at the stated rotations that explain all photos best; the cameras are upright."""
    elevations = {*np.radians(ELEVATIONS_DEG), *(each.view.elevation_rad for each in alone if each.upright)}
    usual = [np.clip(each.perspective / 1.6, LEAST_PERSPECTIVE, MOST_PERSPECTIVE) for each in evidences]
    scored: list[tuple[float, list[View]]] = []
    for yaw in np.arange(_YAWS) * 2 * np.pi / _YAWS:
        total, views = 0.0, []
        for turn, perspective, evidence in zip(turns_deg, usual, evidences, strict=True):
            tried = [
                _centre_in_frame(solid, View(yaw - np.radians(turn), elevation, 0.0, float(perspective)))
                for elevation in sorted(elevations)
            ]
            agreed = [_iou(solid, view, evidence) for view in tried]
            total += max(agreed)
            views.append(tried[int(np.argmax(agreed))])
        scored.append((-total, views))
    scored.sort(key=lambda each: each[0])
    found = []
    for _, views in scored[:_TIED_STARTS]:
        # A photo says little about sides that another shows: the measures must follow, or a correct rotation would look wrong.
        begin = [PlacedView(view, True) for view in views]
        spreads, placed = problem.solve(np.zeros(len(family.free)), begin, measures=True, rounds=4)
        other = family.solid(spreads) or solid
        left = [residual(other, each.view, evidence) for each, evidence in zip(placed, evidences, strict=True)]
        found.append((sum(each.cost for each in left), spreads, placed))
    _, spreads, placed = min(found, key=lambda each: each[0])
    return spreads, placed


def _centre_in_frame(solid: CoarseSolid, view: View) -> View:
    plain = replace(view, scale=1.0, x=0.0, y=0.0)
    scale, x, y = frame_placement(plain.project(solid.vertices)[0])
    return replace(view, scale=scale, x=x, y=y)


def _iou(solid: CoarseSolid, view: View, evidence: Evidence) -> float:
    flat, _ = view.project(solid.vertices)
    drawn = silhouette(to_pixels(flat, SIDE_PX, BOX_SHARE), solid.faces, solid.edges, SIDE_PX)
    return iou(drawn, evidence.for_comparison(perforated=solid.perforated))


def _has_unique_turn(family: ShapeFamily, fit: TemplateFit, evidence: Evidence) -> bool:
    """Return whether every distant rotation explains a photo clearly worse than the fitted one."""
    at = np.zeros(len(family.free))
    solid = family.solid(at)
    if solid is None:
        return False
    problem, rivals = Problem(family, [evidence], False), []
    for turn in np.arange(_FAR_DEG, 360.0 - _FAR_DEG + 1, 20.0):
        view = _centre_in_frame(solid, replace(fit.view, yaw_rad=fit.view.yaw_rad + float(np.radians(turn))))
        rivals.append((-_iou(solid, view, evidence), turn, view))
    for _, _, view in sorted(rivals, key=lambda each: each[:2])[:_RIVALS]:
        _, (placed,) = problem.solve(at, [PlacedView(view, fit.upright)], measures=False, rounds=3)
        away = (np.degrees(placed.view.yaw_rad - fit.view.yaw_rad) + 180) % 360 - 180
        cost = residual(solid, placed.view, evidence).cost
        if abs(away) > _FAR_DEG / 2 and cost < fit.residual.cost + _CLEARLY_WORSE:
            return False
    return True
