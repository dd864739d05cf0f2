"""Make the object of a text: sample measures within the category's intervals, scale to the stated size, and assign looks."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np
from manifold3d import Manifold
from scipy.spatial import ConvexHull
from scipy.spatial.distance import pdist

from manitwin.errors import UsageError
from manitwin.geometry.solids.parts import PartedMesh
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.walls import METALS
from manitwin.models.generators.templates.capacity import require_capacity_m3, solve_scale
from manitwin.models.generators.templates.description_parser import ObjectDescription
from manitwin.models.generators.templates.look_phrases import LookRequest
from manitwin.models.generators.templates.looks import Look, look_of
from manitwin.models.generators.templates.proportions import CapacityTarget, solve_proportions
from manitwin.models.generators.templates.template import KnownPoint, Model, Template
from manitwin.models.generators.templates.template_object import TemplateObject

LEAST_WALL_M = 0.0008
SHEET_M = 0.0009
"""Wall thickness of hollow sheet metal handles and stands: 0.8 to 1 mm of stainless steel."""
SIZE_MARGIN = 2.0
"""A stated size beyond the category's interval by more than this factor is rejected as a mistake."""


def make_object(
    template: Template, wanted: ObjectDescription, rng: np.random.Generator, said: Mapping[str, float] | None = None
) -> TemplateObject:
    """Make one object of a template; raises UsageError for an impossible size or an unknown part.

    ``said`` are known measures, which replace sampled ones.
    """
    looks_by_slot = _looks(template, wanted, rng)
    measures = template.sample_measures(rng) | dict(said or {}) | dict(wanted.measures)
    if wanted.nominal_m is not None:
        called_m = template.nominal_times * float(np.prod([measures[name] for name in template.nominal]))
        measures[template.nominal[0]] *= wanted.nominal_m / called_m
    if "wall_m" in measures:
        measures["wall_m"] = max(
            LEAST_WALL_M, measures["wall_m"] * _relative_wall(template, next(iter(looks_by_slot.values())))
        )
    if wanted.solves_measures:
        holds = _capacity_target(template, wanted, looks_by_slot)
        measures = solve_proportions(template, measures, wanted.lengths_m, wanted.part_lengths_m, holds)
    model = template.build(**measures)
    apart = _distinct_regions(model, _looks_of(template, model, model.slots, looks_by_slot, wanted.wishes))
    mesh = model.assembly.mesh(apart)
    _check_parts(template, wanted, mesh)

    def made_at(scale: float) -> TemplateObject:
        walled, its_model, its_mesh = measures, model, mesh
        if measures.get("wall_m", 1.0) * scale < LEAST_WALL_M:
            walled = measures | {"wall_m": LEAST_WALL_M / scale}
            its_model = template.build(**walled)
            its_mesh = its_model.assembly.mesh(apart)
            scale = _scale(template, wanted, its_model, its_mesh) if wanted.scaling_amount is None else scale
        return assemble_object(template, its_model, its_mesh, walled, looks_by_slot, wanted.wishes, scale)

    if wanted.scaling_amount is None:
        return made_at(_scale(template, wanted, model, mesh))
    scale = solve_scale(wanted.scaling_amount, made_at)
    _check_size(template, float(np.ptp(mesh.vertices, axis=0).max()) * scale)
    return made_at(scale)


def _capacity_target(template: Template, wanted: ObjectDescription, looks: Mapping[str, Look]) -> CapacityTarget | None:
    """Return the volume stated in addition to lengths, with a function for the capacity at given measures; None if
    there is none.
    """
    amount = wanted.amount
    if amount is None or amount.volume_m3 is None:
        return None

    def held(model: Model, mesh: PartedMesh, measures: Mapping[str, float]) -> float:
        return require_capacity_m3(assemble_object(template, model, mesh, measures, looks, wanted.wishes, 1.0), amount)

    return CapacityTarget(amount.volume_m3, amount.said, held)


def _relative_wall(template: Template, look: Look) -> float:
    """Return the wall thickness of a look relative to the template's."""
    return 1.0 if template.of_plate and look.surface in METALS else look.wall


def assemble_object(
    template: Template,
    model: Model,
    mesh: PartedMesh,
    measures: Mapping[str, float],
    looks_by_slot: Mapping[str, Look],
    wishes: Mapping[str, LookRequest],
    scale: float,
) -> TemplateObject:
    """Return a built model and its mesh, scaled, with the looks of its slots and the wishes for single parts."""
    looks = _looks_of(template, model, mesh.names, looks_by_slot, wishes)
    solids, masses, densities = list[tuple[Manifold, float]](), dict[str, float](), dict[str, float]()
    for part, built in model.assembly.solids():
        solid = built.scale((scale, scale, scale))
        density = template.contents_kg_m3.get(part, looks[part].density_kg_m3)
        if part in template.of_sheet and looks[part].surface in METALS and "cast" not in looks[part].material:
            density *= min(1.0, SHEET_M * float(solid.surface_area()) / float(solid.volume()))
        solids.append((solid, density))
        masses[part] = masses.get(part, 0.0) + density * float(solid.volume())
        densities[part] = max(densities.get(part, 0.0), density)
    return TemplateObject(
        template.category,
        PartedMesh(mesh.vertices * scale, mesh.faces, mesh.part, mesh.names),
        looks,
        tuple(_scaled(point, scale) for point in model.points),
        {name: value * (scale if template.measures[name].unit == "m" else 1.0) for name, value in measures.items()},
        solids,
        masses,
        densities,
    )


def _looks_of(
    template: Template,
    model: Model,
    parts: Iterable[str],
    looks_by_slot: Mapping[str, Look],
    wishes: Mapping[str, LookRequest],
) -> dict[str, Look]:
    """Return the look of each part: that of its slot, modified by wishes for the part."""
    looks = {part: looks_by_slot[model.slots[part] or next(iter(template.slots))] for part in parts}
    for part, wish in wishes.items():
        if part in looks and part not in template.slots:
            looks[part] = wish.apply_to(looks[part])
    return looks


def _distinct_regions(model: Model, looks: Mapping[str, Look]) -> list[tuple[str, str]]:
    """Return the regions, as (name, part), whose look differs from their part, so that their borders are visible."""
    return [(name, of) for name, of in model.assembly.regions() if looks[name] != looks[of]]


def _looks(template: Template, wanted: ObjectDescription, rng: np.random.Generator) -> dict[str, Look]:
    """Return the look of each slot, as stated or sampled; a slot of '' looks like the first slot."""
    looks: dict[str, Look] = {}
    first = next(iter(template.slots))
    for slot, choices in template.slots.items():
        wish = wanted.wishes.get(slot, LookRequest())
        if slot == first:
            wish = wish.completed_by(wanted.wishes.get("", LookRequest()))
        usual = wish.candidate_looks([look_of(words) if words else looks[first] for words in choices])
        if slot != first and wish == LookRequest() and _is_material_of_whole(wanted, looks[first], usual):
            usual = [looks[first]]
        looks[slot] = wish.apply_to(usual[int(rng.integers(len(usual)))])
    return looks


def _is_material_of_whole(wanted: ObjectDescription, first: Look, usual: Sequence[Look]) -> bool:
    """Return whether a material stated for the whole object extends to a further part: a wooden spatula is entirely of wood."""
    said = wanted.wishes.get("", LookRequest()).material
    return (
        said is not None and said.surface in ("wood", "plastic") and first.surface in {look.surface for look in usual}
    )


def _check_parts(template: Template, wanted: ObjectDescription, mesh: PartedMesh) -> None:
    known = sorted({*template.slots, *mesh.names})
    for part in wanted.wishes:
        if part and part not in known and f"{part}s" not in known:
            raise UsageError(f"a {template.category} has no {part!r} here. Its parts: {', '.join(known)}")


def _scale(template: Template, wanted: ObjectDescription, model: Model, mesh: PartedMesh) -> float:
    """Return the scale for the stated or relative size; 1 if the text states neither, or several lengths.

    The size decides which side a width refers to: for a keyboard of 40 cm, the longer one.
    """
    extents = np.ptp(mesh.vertices, axis=0)
    meant = _part_vertices(model, mesh, template.length_of) if template.length_of else mesh.vertices
    now = {
        "": [np.ptp(meant, axis=0).max()],
        "diagonal": [_diagonal_m(_part_vertices(model, mesh, template.diagonal_of))] if template.diagonal_of else [],
        "height": [extents[2]],
        "width": [extents[:2].min(), extents[:2].max()],
        "length": [extents.max()],
        "depth": [extents[:2].min()],
    }
    prior = find_prior(template.category)
    assert prior is not None, template.category
    interval = prior.longest_axis_m
    if wanted.lengths_m or wanted.part_lengths_m or wanted.nominal_m is not None or wanted.measures:
        scale = 1.0
        if wanted.lengths_m and not wanted.solves_measures:
            direction, length = next(iter(wanted.lengths_m.items()))
            scales = [length / float(side) for side in now[direction]]
            usual = [scale for scale in scales if interval.low <= float(extents.max()) * scale <= interval.high]
            scale = [*usual, *scales][0]
        _check_size(template, float(extents.max()) * scale)
        return scale
    if wanted.relative is None:
        return 1.0
    return float(interval.low + wanted.relative * (interval.high - interval.low)) / float(extents.max())


def _part_vertices(model: Model, mesh: PartedMesh, part: str) -> np.ndarray:
    """Return the vertices ``(N, 3)`` of a part, or of the parts in a slot."""
    names = [at for at, name in enumerate(mesh.names) if part in (name, model.slots[name])]
    return np.asarray(mesh.vertices[np.unique(mesh.faces[np.isin(mesh.part, names)])])


def _diagonal_m(vertices: np.ndarray) -> float:
    """Return the largest distance between any two of the vertices ``(N, 3)``."""
    hull = vertices[ConvexHull(vertices).vertices]
    return float(pdist(hull).max())


def _check_size(template: Template, longest_m: float) -> None:
    prior = find_prior(template.category)
    assert prior is not None, template.category
    interval = prior.longest_axis_m
    if not interval.low / SIZE_MARGIN <= longest_m <= interval.high * SIZE_MARGIN:
        raise UsageError(
            f"a {template.category} of {longest_m:.3g} m: such are {interval.low:g} to {interval.high:g} m; check the unit"
        )


def _scaled(point: KnownPoint, scale: float) -> KnownPoint:
    x, y, z = point.position_m
    return KnownPoint(point.label, point.kind, point.part, (x * scale, y * scale, z * scale), point.direction)
