"""Fit a template to a matted photo: its measures and the camera's view from outline, inner edges and shading."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from manitwin.geometry.solids.shapes import SolidError
from manitwin.models.annotators.prior_names import found_by, lookup, named
from manitwin.models.annotators.prior_records import Prior
from manitwin.models.annotators.priors import load_priors
from manitwin.models.generators.templates.catalog import load_templates
from manitwin.models.generators.templates.described import is_described
from manitwin.models.generators.templates.fitting.evidence import Evidence, evidence_of
from manitwin.models.generators.templates.fitting.least_squares import Placed
from manitwin.models.generators.templates.fitting.residual import Residual
from manitwin.models.generators.templates.fitting.search import Candidate, search
from manitwin.models.generators.templates.fitting.shape import Family
from manitwin.models.generators.templates.fitting.view import View
from manitwin.models.generators.templates.looks import Look, look_of
from manitwin.models.generators.templates.made import Made
from manitwin.models.generators.templates.making import dressed
from manitwin.models.generators.templates.named_category import is_adjective
from manitwin.models.generators.templates.other_shapes import KIN_OF_ANOTHER_SHAPE
from manitwin.models.generators.templates.template import Template
from manitwin.models.generators.templates.vocabulary import FILLER_WORDS

_MOST_KINDS, _SIZE_MARGIN = 8, 1.5
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
    """Return the template of what a thing is called, by its own names and by those of the priors; None where there is none.

    Of a longer name its last words count where they are such a name of two words and more: a pink storage tray is a storage tray.
    Closed packages look like what the priors have them beside: a carton of cream like one of milk.
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
    prior = named(words) or lookup(words)
    if prior is None:
        return None
    beside = prior.kin_of if prior.vessel and prior.category not in KIN_OF_ANOTHER_SHAPE else None
    return by_name.get(prior.category) or templates.get(beside or "")


def kinds_of(category: str, name: str | None = None) -> list[str]:
    """Return the categories that people may mean by a category's name: a can may be a drink can, a water bottle a bottle.

    They share its last word, or the priors have them beside it, a mallet beside the hammer, and are about as large: nobody calls
    a watering can a can. A plain name stands also for what has a name with that last word, a mug that is called a coffee cup, and
    for that with something, a cup and saucer; but for what keeps things in it or not as its own things do: no glass is a
    magnifying glass. A longer ``name`` of the category by which a thing is called says which of what stands beside another it
    is: a hat may be a cap, and a sun hat is none. All boxes have the outline of a box, so that it does not tell one that is
    called by what it keeps from another: a box of pencils, or a light bulb box, is no tissue box.
    """
    templates, last = load_templates(), category.split()[-1]
    said = lookup(category)
    if said is not None and said.shape == "box-shaped" and _says_contents(name):
        return []
    if category != last:
        kinds = [last] if last in templates else []
    else:
        kinds = [other for other in templates if other != category and last in _heads(templates[other])]
        kinds = [other for other in kinds if not templates[other].told_in_full]
        kinds = [other for other in kinds if said is not None and load_priors()[other].container == said.container]
    told_apart = _says_which(name, category)
    beside = [other for other in templates if load_priors()[other].kin_of == category and not told_apart]
    kinds += [other for other in beside if other not in kinds and not templates[other].told_in_full]
    return [other for other in kinds if said is not None and _about_as_large(lookup(other), said)][:_MOST_KINDS]


def _says_which(name: str | None, category: str) -> bool:
    """Tell whether a name is found by one that has the category's and a word before it: a claw hammer."""
    found = found_by(name)
    return found is not None and found[1].endswith(f" {category}")


def _says_contents(name: str | None) -> bool:
    """Tell whether a name has a noun before the one by which it is found, or 'of' behind it: a spark plug box."""
    found, words = found_by(name), (name or "").lower().replace("_", " ").replace("-", " ").split()
    if found is None:
        return False
    others = [word for word in words if word not in (*found[1].split(), *FILLER_WORDS)]
    return "of" in words or any(not is_described(word) and not is_adjective(word) for word in others)


def _heads(template: Template) -> set[str]:
    """Return the words that say in each of a template's names what it is, before what it comes with."""
    return {name.split(" and ")[0].split(" with ")[0].split()[-1] for name in (template.category, *template.names)}


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
    photo clearly better; they are searched from fewer views, so the one that comes nearest and is not believed is searched once
    more, by itself. ``focal_mm`` is the lens as 35 mm equivalent where it is known. None where no measures near the expected
    ones give a solid. Raises KeyError for a category without a template.
    """
    templates = load_templates()
    evidence = evidence_of(rgba, focal_mm)
    families = [Family(templates[category], initial_measures), *(Family(templates[other]) for other in or_of)]
    nearest = first_built(search(families, evidence, settled=True), evidence)
    if nearest is None or nearest.category == category or nearest.confidence >= LEAST_CONFIDENCE:
        return nearest
    alone = first_built(search([Family(templates[nearest.category])], evidence, settled=True), evidence)
    return alone if alone is not None and alone.residual.cost < nearest.residual.cost else nearest


def first_built(candidates: Iterable[Candidate], evidence: Evidence) -> Fitted | None:
    """Return the first candidate whose measures give a solid, as found in a photo; None where none do."""
    for best in candidates:
        try:
            made = made_of(best.family.template, best.family.measures(best.spreads))
        except SolidError:
            continue
        return fitted(made, Placed(best.view, best.upright), best.residual, evidence)
    return None


def fitted(made: Made, placed: Placed, left: Residual, evidence: Evidence) -> Fitted:
    """Return what a fit found of one photo."""
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


def made_of(template: Template, measures: dict[str, float]) -> Made:
    """Return a template with these measures and its first looks, its longest side the usual one of its category."""
    looks: dict[str, Look] = {}
    for slot, choices in template.slots.items():
        looks[slot] = look_of(choices[0]) if choices[0] else looks[next(iter(template.slots))]
    model = template.build(**measures)
    mesh = model.assembly.mesh()
    prior = lookup(template.category)
    assert prior is not None, template.category
    scale = prior.longest_axis_m.typical / float(np.ptp(mesh.vertices, axis=0).max())
    return dressed(template, model, mesh, measures, looks, {}, scale)
