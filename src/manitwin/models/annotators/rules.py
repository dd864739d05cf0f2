"""The built-in annotator: rules over a table of priors and the mesh itself. Needs no weights, no key and no network."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.config import Resource
from manitwin.geometry.boxes import upright_extents
from manitwin.models.annotators.leaves import volume_with_leaves_m3
from manitwin.models.annotators.likely_names import usual_of
from manitwin.models.annotators.point_rules import select_points
from manitwin.models.annotators.prior_names import lookup
from manitwin.models.annotators.prior_records import DEVIATIONS_ACROSS, Interval, Prior
from manitwin.models.annotators.priors import unknown_prior
from manitwin.models.annotators.protocol import (
    AnnotatorQuestion,
    PhysicalEstimates,
    PointsRequest,
    QualityVerdict,
    SelectedPoints,
    Subject,
)
from manitwin.models.annotators.stated_matter import look_of_words, prior_as_named, prior_of
from manitwin.models.annotators.walls import density_as_stated, density_by_wall, is_outer_skin, median_thickness
from manitwin.models.annotators.words import describe
from manitwin.models.generators.templates.looks import MATERIALS
from manitwin.twin.record import Language
from manitwin.twin.record_values import Estimate

_SIZE_EXPONENT = 2.0
"""Mass grows about with the square of the size in a category: larger things have relatively thinner walls."""
_FILLED = 0.5  # of the volume of its hull: necks and waists of bottles leave 0.7 and more of it
_SAME_SIZE_SPREAD = 0.6  # of the category's spread of mass that is left among things of one size


class RulesAnnotator:
    """Answer the paper's four questions from what is usually true of a thing of this name, and from its geometry.

    What a picture alone shows is not judged. Without a name, the answers are wide and say so.
    """

    name = "rules"
    needs: Resource = "cpu"
    picture_px = 512  # nobody but people looks at them

    def model_for(self, question: AnnotatorQuestion) -> str | None:
        """Return None: there is no model."""
        return None

    def expected_usd(self, question: AnnotatorQuestion) -> float:
        """Return 0: rules cost nothing."""
        return 0.0

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        """Judge nothing: rules cannot see."""
        return QualityVerdict(None, None, "rules do not look at pictures")

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Estimate size, mass and friction from the prior, the bulk density and the volume."""
        return estimate_physical(subject, prior_of_subject(subject))

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        """Describe the object in words: colour and size as measured, the rest from the prior and the shape."""
        return describe(subject, prior_of_subject(subject), material, extents_m)

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Choose functional and grasp points: the prior's parts, found as geometry."""
        return select_points(request, lookup(request.subject.name))


def prior_of_subject(subject: Subject) -> Prior | None:
    """Return the prior of what a thing is called, of the material that its name says, or that a template has made it of."""
    given = subject.given
    look = look_of_words(given.material) if given is not None and given.made_of_parts else None
    prior = lookup(subject.name)
    return prior_as_named(subject.name) if prior is None or look is None else prior_of(prior, look)


def estimate_physical(subject: Subject, prior: Prior | None) -> PhysicalEstimates:
    """Return what the prior and the mesh say; ``prior`` is None where nobody has said what the thing is."""
    density: Estimate | None
    bulk: Interval | None = None
    if prior is None:
        usual, prior = usual_of(subject.likely), unknown_prior()
        size, density = usual.longest_axis_m, usual.bulk_density_kg_m3
    else:
        size = prior.longest_axis_m.estimate(prior.source)
        by_wall = density_of_wall(prior, subject) if subject.metric else None
        bulk = by_wall or prior.bulk_density_kg_m3
        density = None if bulk is None else bulk.estimate(prior.source)
    extents = upright_extents(subject.solid.vertices)
    scale = 1.0 if subject.metric else size.value / float(extents.max())
    longest_m, volume_m3 = scale * float(extents.max()), scale**3 * volume_with_leaves_m3(subject.solid, prior)
    return PhysicalEstimates(
        longest_axis_m=None if subject.metric else size,
        mass_kg=_unknown_mass(density, volume_m3)
        if prior.category == "unknown"
        else _mass(
            prior,
            bulk,
            longest_m,
            volume_m3,
            0.0 if subject.metric else prior.longest_axis_m.log_spread,
            prior.vessel and subject.metric and _is_filled(subject.solid),
        ),
        bulk_density_kg_m3=density,
        friction_static=prior.friction_static.estimate(prior.source),
        friction_dynamic=prior.friction_dynamic.estimate(prior.source),
        restitution=prior.restitution.estimate(prior.source),
        material=prior.material,
        wall_thickness_m=_wall_thickness(subject, prior, scale),
        part_materials={str(role): material for role, material in prior.part_materials.items()} or None,
    )


def _is_filled(solid: trimesh.Trimesh) -> bool:
    """Tell whether a vessel's volume is that of its outside: one that is modelled with its walls is an empty one."""
    return float(solid.volume) > _FILLED * float(solid.convex_hull.volume)


def density_of_wall(prior: Prior, subject: Subject) -> Interval | None:
    """Return the bulk density that the wall of a mesh in metres says, of the stated material or of those that are usual."""
    if prior.stated is None:
        return density_by_wall(prior, subject.solid, subject.seed)
    return density_as_stated(prior, MATERIALS[prior.stated].density_kg_m3, subject.solid, subject.seed)


def _mass(
    prior: Prior, bulk: Interval | None, longest_m: float, volume_m3: float, size_spread: float, full: bool
) -> Estimate:
    """Combine what such a thing of this size weighs with ``bulk`` density times volume, the narrower one counting more.

    Both are taken as log-normal. A volume is as unsure as the size that it was scaled by, ``size_spread`` in natural logs, three
    times over (0: the size is known). The answer stays in the category's interval; its own interval is what the volume leaves
    open, and reaches at least as far beyond the answer as both together are unsure: an answer at its end is not sure of itself.
    By a guessed size it is also no denser and no lighter than such things are, which a thing of unusual proportions would be.
    ``full``: it is what a full vessel weighs; the lower halves of the intervals, which are of vessels that are not full, say
    nothing of which of the two is narrower.
    """
    by_size = _scaled(prior.mass_kg, (longest_m / prior.longest_axis_m.typical) ** _SIZE_EXPONENT)
    if bulk is None:
        return _clamped(by_size.typical, by_size, prior.mass_kg, prior.source)
    by_volume = _scaled(bulk, volume_m3)
    spread_at_size, spread_at_volume = (i.upper_log_spread if full else i.log_spread for i in (by_size, by_volume))
    weight_size = (_SAME_SIZE_SPREAD * spread_at_size) ** -2
    weight_volume = 1 / (spread_at_volume**2 + (3 * size_spread) ** 2)
    logs = weight_size * np.log(by_size.typical) + weight_volume * np.log(by_volume.typical)
    value = float(np.exp(logs / (weight_size + weight_volume)))
    source = "density*volume" if weight_volume > weight_size else prior.source
    beyond = float(
        np.exp(DEVIATIONS_ACROSS / 2 * _mass_spread(_SAME_SIZE_SPREAD * spread_at_size, spread_at_volume, size_spread))
    )
    open_to = Interval(low=min(by_volume.low, value / beyond), typical=value, high=max(by_volume.high, value * beyond))
    possible = min(max(value, by_volume.low), by_volume.high) if size_spread else value
    return _clamped(possible, open_to, prior.mass_kg, source if possible == value else "density*volume")


def _mass_spread(spread_at_size: float, spread_at_volume: float, size_spread: float) -> float:
    """Return how unsure the combined mass is, in natural logs.

    A wrong size moves both opinions the same way: the one with its square, the other with its cube.
    """
    weights = np.array([spread_at_size**-2, spread_at_volume**-2])
    exponent = float(weights @ [_SIZE_EXPONENT, 3.0] / weights.sum())
    return float(np.sqrt(1 / weights.sum() + (exponent * size_spread) ** 2))


def _unknown_mass(density_kg_m3: Estimate | None, volume_m3: float) -> Estimate:
    """Return any usual bulk density times the volume: all that can be said of a thing that nobody has named."""
    assert density_kg_m3 is not None
    value, low, high = (each * volume_m3 for each in (density_kg_m3.value, density_kg_m3.low, density_kg_m3.high))
    return Estimate(value=value, low=low, high=high, source=density_kg_m3.source)


def _scaled(interval: Interval, factor: float) -> Interval:
    return Interval(low=interval.low * factor, typical=interval.typical * factor, high=interval.high * factor)


def _clamped(value: float, open_to: Interval, category: Interval, source: str) -> Estimate:
    """Keep ``value`` in the category's interval, and of that interval what is left open around it.

    Where it has to be moved, size and volume are not those of such a thing: it may weigh what is usual of it, or what they say.
    """
    kept = min(max(value, category.low), category.high)
    low, high = max(category.low, open_to.low), min(category.high, open_to.high)
    if kept != value:
        low, high = min(low, value, category.typical), max(high, value, category.typical)
    return Estimate(value=kept, low=min(low, kept), high=max(high, kept), source=source)


def _wall_thickness(subject: Subject, prior: Prior, scale: float) -> float | None:
    """Return the wall of a thing hollow behind a closed skin, None where the mesh is the matter itself or full."""
    if prior.mass_distribution != "shell" or prior.wall_thickness_m is None:
        return None
    thickness_m = scale * median_thickness(subject.solid, subject.seed)
    return prior.wall_thickness_m if is_outer_skin(thickness_m, prior.wall_thickness_m) else None
