"""Checks of a physical answer against the mesh, the densities of materials, and the priors."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from manitwin.config import PhysicalConfig
from manitwin.errors import Rejected
from manitwin.geometry.boxes import upright_extents
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.prior_records import HEAVIEST_CONTENTS_KG_M3, Interval
from manitwin.models.annotators.priors import load_materials
from manitwin.models.annotators.protocol import Subject
from manitwin.models.annotators.vlm.physical import PhysicalAnswer
from manitwin.models.annotators.walls import is_outer_skin, median_thickness

PROPORTION_FACTOR, PROPORTION_SHARE = 1.5, 0.1
"""Tolerances of a side: this factor, or this share of the longest side, because thin sides are hard to judge by eye."""

METRIC_FACTOR = 1.5
"""Tolerance of an answered size interval around the size of a mesh of declared scale."""

FRICTION = (0.05, 1.5)
"""Range for dry solids: PTFE on steel 0.04 to 0.1, soft clean rubber on rough ground above 1 (engineering handbooks)."""

LIGHTEST_CONTENTS_KG_M3 = 20.0
"""Minimum bulk density of a closed package; crisps in a bag have more."""

LIGHTER, HEAVIER = 5.0, 2.0
"""Factors by which the mass per mesh volume may be below and above the density of the material.

Scans are thicker than thin objects: by their scans a fork of steel and plastic has 1,735 kg/m3, scissors 1,752 (published
masses). Hollow handles have the same effect.
"""

PARTS_INSIDE = 8.0
"""Maximum ratio of the contents of a closed skin to its own mass: motors, batteries, springs."""


@dataclass(frozen=True)
class PhysicalFinding:
    """A contradiction, in words for the model; ``rejects`` is the rejection reason if no such object can exist."""

    text: str
    rejects: str | None = None


@dataclass(frozen=True)
class MeasuredMesh:
    """Measurements of the mesh in its own unit, metres if ``metric``.

    ``sides (3,)`` of the upright bounding box, the longest first; area, volume, and median thickness.
    """

    sides: np.ndarray
    area: float
    volume: float
    thickness: float
    metric: bool

    def scale(self, answer: PhysicalAnswer) -> float:
        """Return the factor from the mesh's unit to metres, by its longest extent."""
        return 1.0 if self.metric else answer.sides_m[0].typical / float(self.sides[0])

    def is_outer_skin(self, answer: PhysicalAnswer) -> bool:
        """Tell whether the mesh is a closed skin without the inner side of its wall."""
        return is_outer_skin(self.thickness * self.scale(answer), answer.wall_thickness_m)


def measure(subject: Subject) -> MeasuredMesh:
    """Measure the subject's solid."""
    return MeasuredMesh(
        sides=np.sort(upright_extents(subject.solid.vertices))[::-1],
        area=float(subject.solid.area),
        volume=float(subject.solid.volume),
        thickness=median_thickness(subject.solid, subject.seed),
        metric=subject.metric,
    )


def examine_physical(
    answer: PhysicalAnswer, mesh: MeasuredMesh, name: str | None, settings: PhysicalConfig
) -> list[PhysicalFinding]:
    """Return all findings about an answer, the impossible ones first."""
    findings = [
        *_density_findings(answer, mesh, settings),
        *_prior_findings(answer, mesh, name, settings),
        *_proportion_findings(answer, mesh),
        *_size_findings(answer, mesh),
        *_wall_findings(answer),
        *_friction_findings(answer),
        *_name_findings(answer, name),
    ]
    return sorted(findings, key=lambda finding: finding.rejects is None)


def texts(check: Callable[[PhysicalAnswer], list[PhysicalFinding]]) -> Callable[[PhysicalAnswer], list[str]]:
    """Return a check that returns the texts of its findings."""
    return lambda answer: [finding.text for finding in check(answer)]


def reject_impossible(findings: list[PhysicalFinding]) -> None:
    """Raise Rejected if a finding says that no such object can exist."""
    for finding in findings:
        if finding.rejects is not None:
            raise Rejected(finding.rejects, f"{finding.text} (the model said so when asked twice)")


def _density_findings(answer: PhysicalAnswer, mesh: MeasuredMesh, settings: PhysicalConfig) -> list[PhysicalFinding]:
    """Compare the mass per mesh volume with the configured limits and with the usual density of material and structure."""
    volume_m3 = mesh.volume * mesh.scale(answer) ** 3
    density = answer.mass_kg.typical / volume_m3
    said = f"{answer.mass_kg.typical:.3g} kg in a shape of {1e6 * volume_m3:.3g} cm3 is {density:.3g} kg/m3"
    if not settings.min_density_kg_m3 <= density <= settings.max_density_kg_m3:
        return [PhysicalFinding(f"{said}: no matter has that density; mass or size is wrong", "implausible_mass")]
    low, high = _usual_density(answer, mesh)
    if low <= density <= high:
        return []
    matter = ", ".join(dict.fromkeys(part.material for part in answer.materials))
    what = f"a thing of {matter} that is {answer.structure} has {low:.2g} to {high:.2g} kg/m3"
    return [PhysicalFinding(f"{said}, but {what}: check mass, size, material and structure")]


def _usual_density(answer: PhysicalAnswer, mesh: MeasuredMesh) -> tuple[float, float]:
    """Return the usual lower and upper mass per m3 of the mesh (kg) for these materials and structure."""
    named = [
        load_materials()["unknown" if p.material in ("other", "unknown") else p.material] for p in answer.materials
    ]
    lightest = min(material.density_kg_m3.low for material in named)
    heaviest = max(material.density_kg_m3.high for material in named)
    wall = answer.wall_thickness_m
    # the mesh of an open wall has both of its sides, that of a closed skin only one
    sides = 1 if mesh.is_outer_skin(answer) else 2
    share = mesh.area / sides * wall / (mesh.volume * mesh.scale(answer))
    skin_share = min(share, 1.0) if wall > 0 else 1.0
    if answer.structure == "full_closed":
        return LIGHTEST_CONTENTS_KG_M3, max(HEAVIEST_CONTENTS_KG_M3, heaviest)
    if answer.structure == "solid":
        return lightest / LIGHTER, heaviest * HEAVIER
    if answer.structure == "open_container":
        return lightest * skin_share / HEAVIER, heaviest * HEAVIER
    return lightest * skin_share / HEAVIER, heaviest * min(skin_share * PARTS_INSIDE, 1.0) * HEAVIER


def _prior_findings(
    answer: PhysicalAnswer, mesh: MeasuredMesh, name: str | None, settings: PhysicalConfig
) -> list[PhysicalFinding]:
    """Compare longest side (unless the scale is declared) and mass with the prior's intervals."""
    prior = find_prior(name) or find_prior(answer.object)
    if prior is None:
        return []
    findings = []
    if not mesh.metric:
        longest = answer.sides_m[0].typical
        findings += _interval_findings(
            prior.category, "longest side", longest, "m", prior.longest_axis_m, settings.size_margin, "implausible_size"
        )
    mass = answer.mass_kg.typical
    return findings + _interval_findings(
        prior.category, "mass", mass, "kg", prior.mass_kg, settings.mass_margin, "implausible_mass"
    )


def _interval_findings(
    category: str, what: str, value: float, unit: str, usual: Interval, margin: float, reason: str
) -> list[PhysicalFinding]:
    if usual.low <= value <= usual.high:
        return []
    impossible = not usual.low / margin <= value <= usual.high * margin
    text = f"{what} {value:.3g} {unit}, but nearly every {category} has {usual.low:.3g} to {usual.high:.3g} {unit}"
    return [PhysicalFinding(text, reason if impossible else None)]


def _proportion_findings(answer: PhysicalAnswer, mesh: MeasuredMesh) -> list[PhysicalFinding]:
    """Compare the proportions of the answered sides with those of the mesh."""
    said = np.array([side.typical for side in answer.sides_m])
    said, real = said / said[0], mesh.sides / mesh.sides[0]
    factor = np.maximum(said / real, real / said)
    if not ((factor > PROPORTION_FACTOR) & (np.abs(said - real) > PROPORTION_SHARE)).any():
        return []
    proportions = ["1 : " + " : ".join(f"{share:.2f}" for share in sides[1:]) for sides in (said, real)]
    return [
        PhysicalFinding(
            f"length, width and height are said to be as {proportions[0]}, but the object, as it stands, has"
            f" {proportions[1]}"
        )
    ]


def _size_findings(answer: PhysicalAnswer, mesh: MeasuredMesh) -> list[PhysicalFinding]:
    longest, real = answer.sides_m[0], float(mesh.sides[0])
    if not mesh.metric or longest.low / METRIC_FACTOR <= real <= longest.high * METRIC_FACTOR:
        return []
    return [
        PhysicalFinding(
            f"the longest side is said to be {longest.low:.3g} to {longest.high:.3g} m, but the file declares {real:.3g} m"
        )
    ]


def _wall_findings(answer: PhysicalAnswer) -> list[PhysicalFinding]:
    """Check that a hollow object has a wall thickness, and that the wall fits twice into the shortest side."""
    wall, shortest = answer.wall_thickness_m, answer.sides_m[2].typical
    if answer.structure in ("hollow_closed", "open_container") and wall == 0:
        return [
            PhysicalFinding(
                f"wall_thickness_m is 0, but the thing is said to be {answer.structure}: give its wall in metres"
            )
        ]
    if wall > shortest / 2:
        return [
            PhysicalFinding(
                f"a wall of {1000 * wall:.3g} mm does not fit twice into a shortest side of {1000 * shortest:.3g} mm"
            )
        ]
    return []


def _friction_findings(answer: PhysicalAnswer) -> list[PhysicalFinding]:
    """Check that friction is in the range of dry solids, and that dynamic friction does not exceed static friction."""
    findings = []
    low, high = FRICTION
    for what, said in (("friction_static", answer.friction_static), ("friction_dynamic", answer.friction_dynamic)):
        if not low <= said.typical <= high:
            findings.append(PhysicalFinding(f"{what} {said.typical:.3g}, but dry solids have {low} to {high}"))
    if answer.friction_dynamic.typical > answer.friction_static.typical:
        findings.append(
            PhysicalFinding(
                f"friction_dynamic {answer.friction_dynamic.typical:.3g} is above friction_static"
                f" {answer.friction_static.typical:.3g}"
            )
        )
    return findings


def _name_findings(answer: PhysicalAnswer, name: str | None) -> list[PhysicalFinding]:
    if name is None or answer.same_as_named != "no":
        return []
    return [
        PhysicalFinding(f"the user calls it {name!r}, but the answer says that it is {answer.object!r}: look again")
    ]
