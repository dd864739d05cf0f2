"""Physical question: name, materials, size, mass, friction and restitution of the object."""

from __future__ import annotations

import math
from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator

from manitwin.geometry.parts.membership import ROLES
from manitwin.models.annotators.part_names import roles_in_label
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.annotators.protocol import PhysicalEstimates, Subject
from manitwin.models.annotators.vlm.prompt_files import Prompt
from manitwin.models.annotators.vlm.question_parts import extents_of, name_line, size_phrase
from manitwin.models.annotators.vlm.view_pictures import clean_views, longest_extent_view
from manitwin.models.vlm.protocol import Question
from manitwin.models.vlm.strict_schema import strict_schema
from manitwin.twin.record_values import Estimate

Matter = Literal[
    "plastic", "ceramic", "glass", "steel", "aluminium", "wood", "cardboard", "paper", "rubber", "foam", "textile",
    "leather", "food skin", "wax", "stone", "other", "unknown",
]  # fmt: skip
"""The materials of the priors (``prior_tables/materials.toml``), any other one, and unknown."""

Structure = Literal["solid", "open_container", "hollow_closed", "full_closed"]
SameAsNamed = Literal["yes", "no", "unsure", "no name given"]


class AnsweredInterval(BaseModel):
    """A quantity with the interval that holds the truth in 19 of 20 cases."""

    model_config = ConfigDict(frozen=True)

    low: float = Field(ge=0)
    typical: float = Field(ge=0)
    high: float = Field(ge=0)

    @model_validator(mode="after")
    def _ordered(self) -> AnsweredInterval:
        if not (self.low <= self.typical <= self.high and math.isfinite(self.high)):
            raise ValueError(f"low <= typical <= high does not hold: {self.low}, {self.typical}, {self.high}")
        return self

    def estimate(self, source: str) -> Estimate:
        """Return the quantity as an estimate of the twin."""
        return Estimate(value=self.typical, low=self.low, high=self.high, source=source)


class Positive(AnsweredInterval):
    """A quantity that cannot be zero."""

    low: float = Field(gt=0)


class Share(AnsweredInterval):
    """A quantity from 0 to 1."""

    high: float = Field(ge=0, le=1)


class PartMaterial(BaseModel):
    """A part and its material."""

    model_config = ConfigDict(frozen=True)

    part: str = Field(description="the part, or 'all'")
    material: Matter


class PhysicalAnswer(BaseModel):
    """The answer: reasons before numbers."""

    model_config = ConfigDict(frozen=True)

    shown: str = Field(description="what the pictures show, in one sentence")
    object: str = Field(description="the everyday noun for it, singular", min_length=1)
    same_as_named: SameAsNamed = Field(description="whether it is what the user calls it")
    materials: list[PartMaterial] = Field(description="1 to 4, most of the mass first", min_length=1, max_length=4)
    material: str = Field(description="the materials in one phrase, such as 'steel with plastic handle'", min_length=1)
    size_rationale: str = Field(description="what the size is inferred from")
    length_m: Positive
    width_m: Positive
    height_m: Positive
    structure: Structure
    wall_thickness_m: float = Field(ge=0, description="0 for solid and full_closed")
    mass_rationale: str = Field(description="volume of matter, density and contents behind the mass")
    mass_kg: Positive
    friction_rationale: str = Field(description="the surface where it is held")
    friction_static: AnsweredInterval
    friction_dynamic: AnsweredInterval
    restitution: Share

    @property
    def sides_m(self) -> tuple[Positive, Positive, Positive]:
        """Sides of the box, the longest first, whatever their names."""
        first, second, third = sorted((self.length_m, self.width_m, self.height_m), key=lambda s: -s.typical)
        return first, second, third


def physical_question(subject: Subject, prompt: Prompt) -> Question:
    """Ask for size, mass and contact properties with all views.

    A declared size is stated, because the mass has to fit it; proportions are not, because the answer is checked against
    them.
    """
    values = {"count": str(len(subject.views)), "name": name_line(subject.name), "size": _size_sentence(subject)}
    instructions, parts = prompt.filled(values, [*clean_views(subject), *longest_extent_view(subject)])
    return Question("physical", instructions, parts, strict_schema(PhysicalAnswer))


def _size_sentence(subject: Subject) -> str:
    if not subject.metric:
        return "Nobody has said how large it is."
    extents = extents_of(subject.parts)
    return (
        f"Its file declares how large it is: {size_phrase(extents)}, so that its longest extent is"
        f" {100 * float(extents.max()):.1f} cm or, across corners, a little more."
    )


def part_materials(answer: PhysicalAnswer, name: str | None) -> dict[str, str] | None:
    """Return the materials of parts by role; None if no parts are named.

    Of several materials named for a part, the one with more of the mass is used. A neck that is not mentioned has the
    material that necks of such objects share with the head or the handle (priors).
    """
    prior = find_prior(name) or find_prior(answer.object)
    if prior is None or prior.parts is None:
        return None
    said: dict[str, str] = {}
    for part in answer.materials:
        for role in roles_in_label(part.part, ROLES[prior.parts]):
            said.setdefault(role, part.material)
    if "neck" not in said and {"head", "handle"} <= said.keys():
        usual = prior.part_materials
        said["neck"] = said["handle" if usual and usual.get("neck") == usual.get("handle") else "head"]
    told = {role: material for role, material in said.items() if material not in ("other", "unknown")}
    return told or None


def physical_estimates(
    answer: PhysicalAnswer, subject: Subject, model: str, *, outer_skin: bool, findings: tuple[str, ...]
) -> PhysicalEstimates:
    """Return the answer as ``PhysicalEstimates``; a metric mesh keeps its size.

    ``outer_skin``: the mesh is a closed skin without its inner side, so that a hollow object needs a wall thickness.
    """
    source = f"vlm:{model}"
    hollow = answer.structure == "hollow_closed" and outer_skin and answer.wall_thickness_m > 0
    return PhysicalEstimates(
        longest_axis_m=None if subject.metric else answer.sides_m[0].estimate(source),
        mass_kg=answer.mass_kg.estimate(source),
        bulk_density_kg_m3=None,
        friction_static=answer.friction_static.estimate(source),
        friction_dynamic=answer.friction_dynamic.estimate(source),
        restitution=answer.restitution.estimate(source),
        material=answer.material,
        wall_thickness_m=answer.wall_thickness_m if hollow else None,
        findings=findings,
        called=answer.object,
        part_materials=part_materials(answer, subject.name),
    )
