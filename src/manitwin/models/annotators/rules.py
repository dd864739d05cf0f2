"""The built-in annotator: rules over a table of priors and the mesh. It needs no weights, no key and no network."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.config import Resource
from manitwin.geometry.boxes import upright_extents
from manitwin.models.annotators.descriptions import describe
from manitwin.models.annotators.leaves import volume_with_leaves_m3
from manitwin.models.annotators.likely_names import usual_values
from manitwin.models.annotators.point_rules import select_points
from manitwin.models.annotators.prior_names import find_prior
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
from manitwin.models.annotators.stated_matter import look_from_words, prior_in_material, prior_in_named_material
from manitwin.models.annotators.walls import density_as_stated, density_by_wall, is_outer_skin, median_thickness
from manitwin.models.generators.templates.looks import MATERIALS
from manitwin.twin.record import Language
from manitwin.twin.record_values import Estimate

_SIZE_EXPONENT = 2.0
"""Within a category mass grows with about the square of the size, because larger objects have relatively thinner walls."""
_FILLED = 0.5  # of the volume of the convex hull; bottles with necks and waists fill 0.7 and more of it
_SAME_SIZE_SPREAD = 0.6  # share of the category's log spread of mass that remains among objects of the same size


class RulesAnnotator:
    """Answer the paper's four questions from the priors of the object's name and from its geometry.

    Visual quality is not judged. Without a name the intervals are wide, and the texts say so.
    """

    name = "rules"
    needs: Resource = "cpu"
    picture_px = 512  # the rules do not use pictures

    def model_for(self, question: AnnotatorQuestion) -> str | None:
        """Return None: there is no model."""
        return None

    def expected_usd(self, question: AnnotatorQuestion) -> float:
        """Return 0: rules cost nothing."""
        return 0.0

    def judge_quality(self, subject: Subject) -> QualityVerdict:
        """Judge nothing: rules do not use pictures."""
        return QualityVerdict(None, None, "rules do not look at pictures")

    def estimate_physical(self, subject: Subject) -> PhysicalEstimates:
        """Estimate size, mass and friction from the prior, the bulk density and the volume."""
        return estimate_physical(subject, prior_of_subject(subject))

    def describe(self, subject: Subject, material: str, extents_m: np.ndarray) -> Language:
        """Describe the object: colour and size as measured, the rest from the prior and the shape."""
        return describe(subject, prior_of_subject(subject), material, extents_m)

    def select_points(self, request: PointsRequest) -> SelectedPoints:
        """Choose functional and grasp points: the prior's parts, located by geometric features."""
        return select_points(request, find_prior(request.subject.name))


def prior_of_subject(subject: Subject) -> Prior | None:
    """Return the prior of the object's name, in the material stated by the name or used by the template that built it."""
    given = subject.given
    look = look_from_words(given.material) if given is not None and given.has_part_masses else None
    prior = find_prior(subject.name)
    return prior_in_named_material(subject.name) if prior is None or look is None else prior_in_material(prior, look)


def estimate_physical(subject: Subject, prior: Prior | None) -> PhysicalEstimates:
    """Return the estimates from the prior and the mesh; ``prior`` is None for an unnamed object."""
    density: Estimate | None
    bulk: Interval | None = None
    if prior is None:
        usual, prior = usual_values(subject.likely), unknown_prior()
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
        else _combined_mass(
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
    """Tell whether the mesh of a vessel is its outer surface; a mesh with walls is that of an empty vessel."""
    return float(solid.volume) > _FILLED * float(solid.convex_hull.volume)


def density_of_wall(prior: Prior, subject: Subject) -> Interval | None:
    """Return the bulk density that the wall thickness of a mesh in metres indicates, for the stated or the usual materials."""
    if prior.stated is None:
        return density_by_wall(prior, subject.solid, subject.seed)
    return density_as_stated(prior, MATERIALS[prior.stated].density_kg_m3, subject.solid, subject.seed)


def _combined_mass(
    prior: Prior, bulk: Interval | None, longest_m: float, volume_m3: float, size_spread: float, full: bool
) -> Estimate:
    """Combine the usual mass at this size with ``bulk`` density times volume, weighted by their precision.

    Both are treated as log-normal. ``size_spread`` is the log standard deviation of a guessed size, which the volume
    multiplies by three (0: the size is known). The result stays in the category's interval. Its own interval is that of the
    volume estimate, and extends at least as far from the result as the combined uncertainty. With a guessed size the density
    also stays within its usual interval, which an object of unusual proportions would violate. ``full``: the result is the
    mass of a full vessel; the lower halves of the intervals, which come from partly filled vessels, are ignored for the
    weights.
    """
    by_size = _scale_interval(prior.mass_kg, (longest_m / prior.longest_axis_m.typical) ** _SIZE_EXPONENT)
    if bulk is None:
        return _clamp_estimate(by_size.typical, by_size, prior.mass_kg, prior.source)
    by_volume = _scale_interval(bulk, volume_m3)
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
    return _clamp_estimate(possible, open_to, prior.mass_kg, source if possible == value else "density*volume")


def _mass_spread(spread_at_size: float, spread_at_volume: float, size_spread: float) -> float:
    """Return the log standard deviation of the combined mass.

    A wrong size shifts both estimates in the same direction, one with its square and the other with its cube.
    """
    weights = np.array([spread_at_size**-2, spread_at_volume**-2])
    exponent = float(weights @ [_SIZE_EXPONENT, 3.0] / weights.sum())
    return float(np.sqrt(1 / weights.sum() + (exponent * size_spread) ** 2))


def _unknown_mass(density_kg_m3: Estimate | None, volume_m3: float) -> Estimate:
    """Return the usual bulk density times the volume, the only estimate for an unnamed object."""
    assert density_kg_m3 is not None
    value, low, high = (each * volume_m3 for each in (density_kg_m3.value, density_kg_m3.low, density_kg_m3.high))
    return Estimate(value=value, low=low, high=high, source=density_kg_m3.source)


def _scale_interval(interval: Interval, factor: float) -> Interval:
    return Interval(low=interval.low * factor, typical=interval.typical * factor, high=interval.high * factor)


def _clamp_estimate(value: float, open_to: Interval, category: Interval, source: str) -> Estimate:
    """Clamp ``value`` to the category's interval, and its interval to the overlap of ``open_to`` and the category's.

    If the value is moved, size and volume are unusual for the category; the interval then includes both the typical mass and
    the original value.
    """
    kept = min(max(value, category.low), category.high)
    low, high = max(category.low, open_to.low), min(category.high, open_to.high)
    if kept != value:
        low, high = min(low, value, category.typical), max(high, value, category.typical)
    return Estimate(value=kept, low=min(low, kept), high=max(high, kept), source=source)


def _wall_thickness(subject: Subject, prior: Prior, scale: float) -> float | None:
    """Return the wall thickness of an object that is hollow behind a closed skin; None if the mesh is solid material or full."""
    if prior.mass_distribution != "shell" or prior.wall_thickness_m is None:
        return None
    thickness_m = scale * median_thickness(subject.solid, subject.seed)
    return prior.wall_thickness_m if is_outer_skin(thickness_m, prior.wall_thickness_m) else None
