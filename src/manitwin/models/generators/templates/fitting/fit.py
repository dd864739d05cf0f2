"""Fit a template to a matted photo: its measures and the camera's view from outline, inner edges and shading."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.annotators.priors import Prior, lookup, named
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.evidence import Evidence, evidence_of
from manitwin.models.generators.templates.fitting.least_squares import Placed, Problem
from manitwin.models.generators.templates.fitting.residual import Residual, residual
from manitwin.models.generators.templates.fitting.search import is_round, search
from manitwin.models.generators.templates.fitting.shape import Family
from manitwin.models.generators.templates.fitting.view import View
from manitwin.models.generators.templates.looks import Look, look_of
from manitwin.models.generators.templates.made import Made, dressed
from manitwin.models.generators.templates.template import Template

_MOST_KINDS, _SIZE_MARGIN = 6, 1.5
LEAST_CONFIDENCE = 0.5
LEAST_AGAINST_INFLATION = 0.12
"""A doubtful template is nearer to the truth than an inflated outline: of rendered photos of things bent by 16 % of their size, 6
of 6 (volumetric IoU 0.37 to 0.83 against 0 to 0.34). 98 of 100 right names are above, 23 of 100 wrong ones."""
LEAST_IOU, MOST_OUTLINE = 0.70, 0.0085
"""92 of 100 rendered photos under the right name are within both, 14 of 100 under a wrong one; half of them bent by 8 %."""


@dataclass(frozen=True)
class Fitted:
    """A template with the measures that explain a photo best, and the view that it is seen from.

    ``made`` is the solid with its parts in the object frame; a photo tells no size, so its longest side is the usual one of its
    category, and its looks are the first ones of the template. ``confidence`` is in 0..1, 0.5 where a fit is as likely wrong as
    right; ``center_px`` and ``box_px`` say where the photo frame of ``view`` lies in the photo.
    """

    category: str
    made: Made
    view: View
    residual: Residual
    upright: bool
    confidence: float
    center_px: tuple[float, float]
    box_px: float


def template_for(name: str | None) -> Template | None:
    """Return the template of what a thing is called, by its own names and by those of the priors; None where there is none."""
    templates = load_templates()
    words = " ".join((name or "").lower().replace("_", " ").replace("-", " ").split())
    if not words:
        return None
    by_name = {other: template for template in templates.values() for other in (template.category, *template.names)}
    if words in by_name:
        return by_name[words]
    prior = named(words) or lookup(words)
    return None if prior is None else templates.get(prior.category)


def kinds_of(category: str) -> list[str]:
    """Return the categories that people may mean by a category's name: a can may be a drink can, a water bottle a bottle.

    They share its last word and are about as large: nobody calls a watering can a can.
    """
    templates, last = load_templates(), category.split()[-1]
    said = lookup(category)
    kinds = [other for other in templates if other != category and other.split()[-1] == last]
    if category != last:
        kinds = [other for other in kinds if other == last]
    return [other for other in kinds if said is not None and _about_as_large(lookup(other), said)][:_MOST_KINDS]


def _about_as_large(one: Prior | None, other: Prior) -> bool:
    low, high = other.longest_axis_m.low / _SIZE_MARGIN, other.longest_axis_m.high * _SIZE_MARGIN
    return one is not None and low <= one.longest_axis_m.typical <= high


def fit(
    category: str,
    rgba: np.ndarray,
    initial_measures: Mapping[str, float] | None = None,
    *,
    or_of: Sequence[str] = (),
    focal_mm: float | None = None,
) -> Fitted | None:
    """Fit the template of a category to ``rgba (H, W, 4) uint8``, whose alpha is the object's mask.

    ``initial_measures`` are expected in place of the usual ones. ``or_of`` are other categories, taken where they explain the
    photo clearly better. ``focal_mm`` is the lens as 35 mm equivalent where it is known. None where no measures near the expected
    ones give a solid. Raises KeyError for a category without a template.
    """
    templates = load_templates()
    evidence = evidence_of(rgba, focal_mm)
    families = [Family(templates[category], initial_measures), *(Family(templates[other]) for other in or_of)]
    for best in search(families, evidence):
        try:
            made = _made(best.family.template, best.family.measures(best.spreads))
        except SolidError:
            continue
        return _fitted(made, Placed(best.view, best.upright), best.residual, evidence)
    return None


def fit_several(
    category: str, photos: Sequence[np.ndarray], initial_measures: Mapping[str, float] | None = None
) -> list[Fitted] | None:
    """Fit one thing of a category to several photos ``(H, W, 4) uint8`` of it, whose alphas are its masks.

    The measures are common, the views each photo's own. Returns a fit for each photo, all with the same ``made``; the thing is
    sure where the least sure of them is. None where no measures give a solid.
    """
    template, evidences = load_templates()[category], [evidence_of(rgba) for rgba in photos]
    alone = [found[0] for evidence in evidences if (found := search([Family(template, initial_measures)], evidence))]
    if len(alone) < len(photos):
        return None
    # which way round the thing is seen is settled by the photo that is explained best: a box has two widths to swap
    best = min(alone, key=lambda candidate: candidate.residual.cost)
    family = Family(template, best.family.measures(best.spreads))
    together = [search([family], evidence)[0] for evidence in evidences]
    start = np.zeros(len(family.free))
    solid = family.solid(start)
    assert solid is not None  # the best fit is one
    problem = Problem(family, evidences, is_round(solid))
    placed = [Placed(candidate.view, candidate.upright) for candidate in together]
    spreads, placed = problem.solve(start, placed, measures=True, rounds=8)
    final = family.solid(spreads)
    try:
        made = _made(family.template, family.measures(spreads))
    except SolidError:
        return None
    return [
        _fitted(made, each, residual(final or solid, each.view, evidence), evidence)
        for each, evidence in zip(placed, evidences, strict=True)
    ]


def _fitted(made: Made, placed: Placed, left: Residual, evidence: Evidence) -> Fitted:
    return Fitted(
        category=made.category,
        made=made,
        view=placed.view,
        residual=left,
        upright=placed.upright,
        confidence=confidence_of(left),
        center_px=evidence.center_px,
        box_px=evidence.box_px,
    )


def confidence_of(residual: Residual) -> float:
    """Return how likely a fit is that of the right kind of thing: the worse of overlap and of the outlines' distance."""
    score = min((residual.iou - LEAST_IOU) / 0.03, (MOST_OUTLINE - residual.outline) / 0.0015)
    return float(1 / (1 + np.exp(-score)))


def _made(template: Template, measures: dict[str, float]) -> Made:
    looks: dict[str, Look] = {}
    for slot, choices in template.slots.items():
        looks[slot] = look_of(choices[0]) if choices[0] else looks[next(iter(template.slots))]
    model = template.build(**measures)
    mesh = model.assembly.mesh()
    prior = lookup(template.category)
    assert prior is not None, template.category
    scale = prior.longest_axis_m.typical / float(np.ptp(mesh.vertices, axis=0).max())
    return dressed(template, model, mesh, measures, looks, {}, scale)
