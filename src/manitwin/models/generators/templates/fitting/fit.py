"""Fit a template to a matted photo: measures and camera view from silhouette, inner edges and shading."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.annotators.prior_names import find_prior, found_by, named
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.fitting.evidence import Evidence, extract_evidence
from manitwin.models.generators.templates.fitting.least_squares import PlacedView
from manitwin.models.generators.templates.fitting.residual import Residual
from manitwin.models.generators.templates.fitting.search import Candidate, search
from manitwin.models.generators.templates.fitting.shape import ShapeFamily
from manitwin.models.generators.templates.fitting.view import View
from manitwin.models.generators.templates.look_phrases import is_descriptive
from manitwin.models.generators.templates.looks import Look, look_of
from manitwin.models.generators.templates.named_category import is_adjective
from manitwin.models.generators.templates.object_sampling import assemble_object
from manitwin.models.generators.templates.other_shapes import KIN_OF_ANOTHER_SHAPE
from manitwin.models.generators.templates.template import Template
from manitwin.models.generators.templates.template_object import TemplateObject
from manitwin.models.generators.templates.vocabulary import FILLER_WORDS

_MOST_KINDS, _SIZE_MARGIN = 8, 1.5
LEAST_CONFIDENCE = 0.5
LEAST_AGAINST_INFLATION = 0.12
"""A doubtful template is closer to the truth than an inflated silhouette: for rendered photos of objects deformed by 16 % of
their size, in 6 of 6 cases (volumetric IoU 0.37 to 0.83 against 0 to 0.34). Confidence exceeds this value for 98 of 100 correct
names and 23 of 100 wrong ones.
"""
LEAST_IOU, MOST_OUTLINE = 0.70, 0.0085
"""92 of 100 rendered photos with the correct name are within both limits, 14 of 100 with a wrong one; half of them are deformed
by 8 %.
"""


@dataclass(frozen=True)
class TemplateFit:
    """A template with the measures and view that explain a photo best.

    ``made`` is the solid with its parts in the object frame. A photo does not determine the size: the longest side is the typical
    one of the category. The looks are the template's first ones. ``confidence`` is in 0..1, 0.5 if the fit is as likely wrong as
    right. ``center_px`` and ``box_px`` place the photo frame of ``view`` in the photo.
    """

    category: str
    made: TemplateObject
    view: View
    residual: Residual
    upright: bool
    confidence: float
    center_px: tuple[float, float]
    box_px: float


def template_for(name: str | None) -> Template | None:
    """Return the template for a name, by the template's names and those of the priors; None if there is none.

    The last two or more words of a longer name suffice: a pink storage tray is a storage tray. Closed packages use the template
    of their kin in the priors: a carton of cream looks like one of milk.
    """
    templates = load_templates()
    words = " ".join((name or "").lower().replace("_", " ").replace("-", " ").split())
    if not words:
        return None
    by_name = {other: template for template in templates.values() for other in (template.category, *template.names)}
    each = words.split()
    for first in range(max(len(each) - 1, 1)):
        if (last_words := " ".join(each[first:])) in by_name:
            return by_name[last_words]
    prior = named(words) or find_prior(words)
    if prior is None:
        return None
    beside = prior.kin_of if prior.vessel and prior.category not in KIN_OF_ANOTHER_SHAPE else None
    return by_name.get(prior.category) or templates.get(beside or "")


def alternative_categories(category: str, name: str | None = None) -> list[str]:
    """Return the other categories that a category's name may mean: a can may be a drink can, a water bottle a bottle.

    Candidates share its last word, or are its kin in the priors (mallet and hammer), and have a similar size: a watering can is
    no can. A plain name also stands for categories with names that end in it (a mug called coffee cup) or combine it (cup and
    saucer), but only if both or neither are containers: a glass is no magnifying glass. A more specific ``name`` excludes kin: a
    hat may be a cap, a sun hat is not. Since all boxes have the silhouette of a box, a box named by its contents, such as a light
    bulb box, has no alternatives.
    """
    templates, last = load_templates(), category.split()[-1]
    said = find_prior(category)
    if said is not None and said.shape == "box-shaped" and _has_stated_contents(name):
        return []
    if category != last:
        kinds = [last] if last in templates else []
    else:
        kinds = [other for other in templates if other != category and last in _head_nouns(templates[other])]
        kinds = [other for other in kinds if not templates[other].told_in_full]
        kinds = [other for other in kinds if said is not None and load_priors()[other].container == said.container]
    told_apart = _is_more_specific(name, category)
    beside = [other for other in templates if load_priors()[other].kin_of == category and not told_apart]
    kinds += [other for other in beside if other not in kinds and not templates[other].told_in_full]
    return [other for other in kinds if said is not None and _has_similar_size(find_prior(other), said)][:_MOST_KINDS]


def _is_more_specific(name: str | None, category: str) -> bool:
    """Return whether a name is more specific than the category: a claw hammer."""
    found = found_by(name)
    return found is not None and found[1].endswith(f" {category}")


def _has_stated_contents(name: str | None) -> bool:
    """Return whether a name states contents, by a noun before the known name or by 'of': a spark plug box."""
    found, words = found_by(name), (name or "").lower().replace("_", " ").replace("-", " ").split()
    if found is None:
        return False
    others = [word for word in words if word not in (*found[1].split(), *FILLER_WORDS)]
    return "of" in words or any(not is_descriptive(word) and not is_adjective(word) for word in others)


def _head_nouns(template: Template) -> set[str]:
    """Return the head nouns of a template's names, ignoring accessories after 'and' or 'with'."""
    return {name.split(" and ")[0].split(" with ")[0].split()[-1] for name in (template.category, *template.names)}


def _has_similar_size(one: Prior | None, other: Prior) -> bool:
    low, high = other.longest_axis_m.low / _SIZE_MARGIN, other.longest_axis_m.high * _SIZE_MARGIN
    return one is not None and low <= one.longest_axis_m.typical <= high


def fit(
    category: str,
    rgba: np.ndarray,
    initial_measures: Mapping[str, float] | None = None,
    *,
    or_of: Sequence[str] = (),
    focal_mm: float | None = None,
) -> TemplateFit | None:
    """Fit the template of a category to ``rgba (H, W, 4) uint8`` with the object's mask as alpha.

    ``initial_measures`` replace the typical values as prior mean. ``or_of`` are alternative categories, chosen if they explain
    the photo clearly better. They are searched from fewer views, so a best but doubtful alternative is searched again by itself.
    ``focal_mm`` is the focal length (35 mm equivalent), if known. Returns None if no measures near the expected ones give a
    solid. Raises KeyError for a category without a template.
    """
    templates = load_templates()
    evidence = extract_evidence(rgba, focal_mm)
    families = [ShapeFamily(templates[category], initial_measures), *(ShapeFamily(templates[other]) for other in or_of)]
    nearest = first_solid_fit(search(families, evidence, settled=True), evidence)
    if nearest is None or nearest.category == category or nearest.confidence >= LEAST_CONFIDENCE:
        return nearest
    alone = first_solid_fit(search([ShapeFamily(templates[nearest.category])], evidence, settled=True), evidence)
    return alone if alone is not None and alone.residual.cost < nearest.residual.cost else nearest


def first_solid_fit(candidates: Iterable[Candidate], evidence: Evidence) -> TemplateFit | None:
    """Return the first candidate whose measures give a solid, as a fit of the photo; None if there is none."""
    for best in candidates:
        try:
            made = build_fitted_object(best.family.template, best.family.measures(best.spreads))
        except SolidError:
            continue
        return assemble_fit(made, PlacedView(best.view, best.upright), best.residual, evidence)
    return None


def assemble_fit(made: TemplateObject, placed: PlacedView, left: Residual, evidence: Evidence) -> TemplateFit:
    """Return the fit of one photo."""
    return TemplateFit(
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
    """Return the probability that a fit is of the right category, from the worse of overlap and contour distance."""
    score = min((residual.iou - LEAST_IOU) / 0.03, (MOST_OUTLINE - residual.outline) / 0.0015)
    return float(1 / (1 + np.exp(-score)))


def build_fitted_object(template: Template, measures: dict[str, float]) -> TemplateObject:
    """Return a template with these measures and its first looks, scaled to the typical longest side of its category."""
    looks: dict[str, Look] = {}
    for slot, choices in template.slots.items():
        looks[slot] = look_of(choices[0]) if choices[0] else looks[next(iter(template.slots))]
    model = template.build(**measures)
    mesh = model.assembly.mesh()
    prior = find_prior(template.category)
    assert prior is not None, template.category
    scale = prior.longest_axis_m.typical / float(np.ptp(mesh.vertices, axis=0).max())
    return assemble_object(template, model, mesh, measures, looks, {}, scale)
