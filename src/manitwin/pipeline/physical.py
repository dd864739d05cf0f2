"""Physical properties: true size, mass, friction and mass distribution (paper, "Physical Property Estimation")."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Literal

import numpy as np
import trimesh

from manitwin.config import PhysicalConfig, Resource
from manitwin.engine.stage import Draft
from manitwin.errors import BadReply, Rejected
from manitwin.formats.glb import write_glb
from manitwin.formats.meshes.textures import bake_transform
from manitwin.geometry.boxes import oriented_bounding_box, upright_extents
from manitwin.geometry.mass_properties import MassProperties, shell_mass_properties, solid_mass_properties
from manitwin.models.annotators.descriptions import article
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import Interval, Prior
from manitwin.models.annotators.protocol import Annotator, PhysicalEstimates, Subject
from manitwin.models.annotators.stated_matter import prior_in_named_material
from manitwin.pipeline.annotated_mass import annotated_mass, moments_apart
from manitwin.pipeline.fill_states import filling_of
from manitwin.pipeline.human_corrections import SIZE, corrected_estimates, is_human
from manitwin.pipeline.item import Item
from manitwin.pipeline.mass_by_parts import mass_by_parts
from manitwin.pipeline.object_state import findings_of, object_name, read_subject
from manitwin.twin.import_record import FITTED
from manitwin.twin.record import OrientedBox, Physical
from manitwin.twin.record_values import Estimate

CONFIRMED = ("measured", "user")
"""Sources that plausibility checks do not overrule (docs/imports.md: an implausible mass from another source is rejected)."""

NOMINAL_WALL_M = 0.002
"""The wall thickness of an ordinary bottle or housing, assumed for comparison if it is unknown."""


_ROUNDING = 1e-9
OF_OTHER_MATTER = 1 / 3
"""Uncertainty of the centre of mass by parts, as a share of its distance from that of the uniform solid, if a handle is of an
unusual material (benchmarks/center_of_mass.py: at most 0.33 for objects with parts of different density).
"""


class PhysicalStage:
    """Estimate size, mass and friction, scale the object, and compute the mass properties of its shape."""

    name: ClassVar[str] = "physical"
    version: ClassVar[str] = "28"
    reads: ClassVar[tuple[str, ...]] = ("canonical.glb", "canonical.npz", "geometry", "views/", "cameras", "naming?")
    writes: ClassVar[tuple[str, ...]] = ("visual.glb", "solid.npz", "physical", "physical_findings", "size", "called")

    def __init__(self, settings: PhysicalConfig, annotator: Annotator):
        self.settings = settings
        self._annotator = annotator
        self.backend = annotator.name
        self.model = annotator.model_for("physical")
        self.needs: Resource = annotator.needs
        self.expected_usd = annotator.expected_usd("physical")

    def run(self, draft: Draft[Item], folder: Path) -> dict[str, Any]:
        """Write ``visual.glb`` and ``solid.npz`` in metres; return ``physical``, objections to it, and ``size``.

        ``size`` is the Estimate of the longest extent in metres that determined the scale; None if the mesh was metric.
        ``called`` is what an annotator identified the object as. A stated centre of mass and inertia are kept. Raises Rejected
        if size, mass or density are implausible for the object's name, or a stated centre of mass or inertia is impossible;
        BadReply if the annotator gives neither mass nor density.
        """
        metric = bool(draft.field("geometry")["metric"])
        subject = read_subject(draft, solid="canonical.npz", visual="canonical.glb", metric=metric)
        estimates = self._annotator.estimate_physical(subject)
        estimates = corrected_estimates(estimates, draft.amendments.get(self.name, {}))
        obb_extents, obb_to_object = oriented_bounding_box(subject.solid.vertices)
        longest = float(upright_extents(subject.solid.vertices).max())
        scale = size_scale(subject, estimates, longest)
        obb_extents, obb_to_object[:3, 3] = obb_extents * scale, obb_to_object[:3, 3] * scale
        solid = trimesh.Trimesh(subject.solid.vertices * scale, subject.solid.faces, process=False)
        mass = mass_estimate(estimates, float(solid.volume))
        to_check = _to_check(draft, rescaled=scale != 1.0)
        self._check_size(object_name(draft), scale * longest, estimates.longest_axis_m, to_check)
        if scale != 1.0:
            self._check_held(scale * longest)
        self._check_mass(None if _known_mass(subject) else object_name(draft), mass, float(solid.volume), to_check)
        parts = [bake_transform(part, np.diag([scale, scale, scale, 1.0])) for part in subject.parts]
        _write_meshes(draft, folder, solid, parts, scale, self.settings.max_texture_size)
        properties, uncertainty = spread_mass(solid, mass.value, estimates.wall_thickness_m)
        by_parts = _known_mass(subject) or self._mass_from_parts(draft, solid, mass.value, estimates)
        if by_parts is not None:
            off_m = float(np.linalg.norm(by_parts.center_of_mass_m - properties.center_of_mass_m))
            uncertainty = 0.0 if _known_mass(subject) is not None else max(uncertainty, OF_OTHER_MATTER * off_m)
            properties = by_parts
        annotated = self._annotated(subject, solid, mass.value, scale, properties)
        findings = findings_of(estimates)
        if annotated is not None and subject.given is not None:
            wall_m = estimates.wall_thickness_m or NOMINAL_WALL_M
            findings = [*(findings or ()), *moments_apart(annotated, solid, mass.value, wall_m, subject.given.source)]
            uncertainty = uncertainty if subject.given.center_of_mass_m is None else 0.0
            properties = annotated
        corners = np.array([part.bounds for part in parts])
        physical = Physical(
            extents_m=(corners[:, 1].max(0) - corners[:, 0].min(0)).tolist(),
            obb=OrientedBox(extents_m=obb_extents.tolist(), obb_to_object=obb_to_object.tolist()),
            scale_applied=scale,
            material=estimates.material,
            mass_kg=mass,
            friction_static=estimates.friction_static,
            friction_dynamic=estimates.friction_dynamic,
            restitution=estimates.restitution,
            density_kg_m3=mass.value / float(solid.volume),
            center_of_mass_m=properties.center_of_mass_m.tolist(),
            center_of_mass_uncertainty_m=uncertainty,
            inertia_kg_m2=properties.inertia_kg_m2.tolist(),
            mass_distribution=_distribution(estimates, by_parts) if annotated is None else "annotated",
            filling=None
            if estimates.wall_thickness_m is not None
            else filling_of(solid, mass, properties, uncertainty, _prior_of(draft, estimates), NOMINAL_WALL_M),
        )
        given = estimates.longest_axis_m
        said = None if given is None or (metric and not is_human(given.source)) else given.model_dump()
        return {
            "physical": physical.model_dump(),
            "physical_findings": findings,
            "size": said,
            "called": estimates.called,
        }

    def _annotated(
        self, subject: Subject, solid: trimesh.Trimesh, mass_kg: float, scale: float, computed: MassProperties
    ) -> MassProperties | None:
        given = subject.given
        if given is None or given.has_part_masses or given.format == FITTED:
            return None
        return annotated_mass(given, solid, mass_kg, scale, computed)

    def _mass_from_parts(
        self, draft: Draft[Item], solid: trimesh.Trimesh, mass_kg: float, estimates: PhysicalEstimates
    ) -> MassProperties | None:
        """Return mass properties from parts of different materials; None if parts or materials are unknown."""
        prior = _prior_of(draft, estimates)
        if prior is None or not estimates.part_materials or estimates.wall_thickness_m is not None:
            return None
        return mass_by_parts(solid, mass_kg, estimates.part_materials, prior, draft.seed)

    def _check_size(self, name: str | None, longest_m: float, said: Estimate | None, to_check: str) -> None:
        prior = find_prior(name)
        if prior is None or (said is not None and _is_confirmed(said)):
            return
        if not _within(longest_m, prior.longest_axis_m, self.settings.size_margin):
            raise Rejected(
                "implausible_size",
                f"{longest_m:.4g} m long, but {_prior_noun_phrase(prior)} has {_span(prior.longest_axis_m)} m; {to_check}",
            )

    def _check_held(self, longest_m: float) -> None:
        """Raise Rejected for what was scaled beyond any hand, as the gate does for what has that size: a broom, a barbell."""
        most_m = self.settings.max_longest_side_m
        if longest_m > most_m * (1 + _ROUNDING):
            raise Rejected(
                "implausible_size",
                f"{longest_m:.3g} m is how long such a thing usually is, and no gripper here holds one longer than {most_m:g} m;"
                " of a shorter one give the longest side in metres",
            )

    def _check_mass(self, name: str | None, mass: Estimate, volume_m3: float, to_check: str) -> None:
        """Raise Rejected for an implausible mass; ``name`` is None for a template, whose mass is the sum of its parts."""
        if _is_confirmed(mass):
            return
        prior, as_named = find_prior(name), prior_in_named_material(name)
        margin = self.settings.mass_margin
        usual = [each.mass_kg for each in (prior, as_named) if each is not None]
        if prior is not None and not any(_within(mass.value, interval, margin) for interval in usual):
            raise Rejected(
                "implausible_mass",
                f"{mass.value:.4g} kg, but {_prior_noun_phrase(prior)} weighs {_span(prior.mass_kg)} kg; check the name"
                f"{_declared(mass)}",
            )
        density = mass.value / volume_m3
        if not self.settings.min_density_kg_m3 <= density <= self.settings.max_density_kg_m3:
            raise Rejected(
                "implausible_mass",
                f"{mass.value:.4g} kg in {volume_m3 * 1e6:.4g} ml is {density:.4g} kg/m3, which is impossible;"
                f" {to_check}",
            )


def _prior_noun_phrase(prior: Prior) -> str:
    """Return the noun phrase of a prior: an apple, a pair of scissors."""
    counted = f"{prior.counter} {prior.category}" if prior.counter else prior.category
    return f"{article(counted)} {counted}"


def _to_check(draft: Draft[Item], *, rescaled: bool) -> str:
    """Say what to check if a size or mass is implausible: the source of the size, and the name.

    If the mesh's unit was guessed, it is the likely cause.
    """
    geometry = draft.field("geometry")
    if draft.payload.longest_side_m is not None or SIZE in geometry:
        return "check the stated longest side (in metres) and the name"
    guessed = not rescaled and geometry.get("units") == "guessed"
    return "check units and name" + (f": {geometry['unit_finding']}" if guessed else "")


def _declared(mass: Estimate) -> str:
    """Say how to have a mass estimated that an imported asset declares."""
    if not mass.source.startswith("imported:"):
        return ""
    return ", or set mass_kg in its import.json to null: it is then estimated"


def _prior_of(draft: Draft[Item], estimates: PhysicalEstimates) -> Prior | None:
    """Return the prior of the object's name, else of what an annotator identified it as."""
    return find_prior(object_name(draft)) or find_prior(estimates.called)


def size_scale(subject: Subject, estimates: PhysicalEstimates, longest: float) -> float:
    """Return the scale factor to true size, given the ``longest`` extent of the upright object; 1 for an uncorrected metric mesh.

    The paper scales by the longest axis of the oriented box, which for a teapot is the diagonal from spout to foot: given a
    length of 0.24 m, the pot would become 0.32 m long.
    """
    said = estimates.longest_axis_m
    if said is None or (subject.metric and not is_human(said.source)):
        return 1.0
    return said.value / longest


def mass_estimate(estimates: PhysicalEstimates, volume_m3: float) -> Estimate:
    """Return the stated mass, or bulk density times volume. Raises BadReply if neither is stated."""
    if estimates.mass_kg is not None:
        return estimates.mass_kg
    density = estimates.bulk_density_kg_m3
    if density is None:
        raise BadReply("the annotator gave neither a mass nor a bulk density; ask again or use rules")
    return Estimate(
        value=density.value * volume_m3,
        low=density.low * volume_m3,
        high=density.high * volume_m3,
        source="density*volume",
    )


def spread_mass(solid: trimesh.Trimesh, mass_kg: float, wall_thickness_m: float | None) -> tuple[MassProperties, float]:
    """Return the mass properties, and the uncertainty (m) of the centre of mass from the alternative mass distribution.

    With a wall thickness the object is a shell; without, the mesh encloses material or is full: a solid.
    """
    as_solid = solid_mass_properties(solid, mass_kg)
    as_shell = shell_mass_properties(solid, mass_kg, wall_thickness_m or NOMINAL_WALL_M)
    uncertainty = float(np.linalg.norm(as_solid.center_of_mass_m - as_shell.center_of_mass_m))
    return (as_solid if wall_thickness_m is None else as_shell), uncertainty


def _distribution(estimates: PhysicalEstimates, by_parts: MassProperties | None) -> Literal["solid", "shell", "parts"]:
    if by_parts is not None:
        return "parts"
    return "solid" if estimates.wall_thickness_m is None else "shell"


def _known_mass(subject: Subject) -> MassProperties | None:
    """Return the mass properties of a template built from parts with a material each; None for other subjects."""
    known = subject.given
    if known is None or not known.has_part_masses or known.center_of_mass_m is None or known.inertia_kg_m2 is None:
        return None
    center, inertia = np.array(known.center_of_mass_m), np.array(known.inertia_kg_m2)
    return MassProperties(center, inertia, float(subject.solid.volume))


def _write_meshes(
    draft: Draft[Item],
    folder: Path,
    solid: trimesh.Trimesh,
    parts: list[trimesh.Trimesh],
    scale: float,
    max_texture_size: int,
) -> None:
    # An unscaled mesh keeps its file, as encoding its textures again would lose detail.
    unscaled = draft.path("canonical.glb").read_bytes() if scale == 1.0 else None
    (folder / "visual.glb").write_bytes(unscaled or write_glb(parts, max_texture_size=max_texture_size))
    np.savez(folder / "solid.npz", vertices=np.asarray(solid.vertices), faces=np.asarray(solid.faces, dtype=np.int64))


def _is_confirmed(said: Estimate) -> bool:
    return said.source in CONFIRMED or is_human(said.source)


def _within(value: float, interval: Interval, margin: float) -> bool:
    return interval.low / margin <= value <= interval.high * margin


def _span(interval: Interval) -> str:
    return f"{interval.low:.3g} to {interval.high:.3g}"
