"""What the priors' table says of a category of things: usual sizes and masses, matter, parts and how they are used."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from manitwin.geometry.parts.feature_names import Feature, HeadEnd
from manitwin.geometry.parts.membership import PartRole, PartRule
from manitwin.twin.point_records import GraspType
from manitwin.twin.record_values import Estimate, Finite, Record

if TYPE_CHECKING:
    from manitwin.geometry.parts.shape import Shape

HEAVIEST_CONTENTS_KG_M3 = 2000.0
"""Closed packages hold no more: sugar, sand and shampoo in a jar are below."""

Distribution = Literal["full", "solid", "shell"]
"""Full of its contents or of one matter; solid: the mesh is the matter itself; shell: hollow behind a closed skin."""


DEVIATIONS_ACROSS = 3.29
"""Standard deviations between the ends of an interval that holds 90 % of a log-normal value."""
LEAST_LOG_SPREAD = 0.02
_UPWARD = 0.9  # cosine of an opening's axis and the vertical


class Interval(Record):
    """A usual value and the interval that nearly all (about 19 of 20) such things are in."""

    low: Finite
    typical: Finite
    high: Finite

    @model_validator(mode="after")
    def _ordered(self) -> Interval:
        if not 0 <= self.low <= self.typical <= self.high:
            raise ValueError(f"not in order: {self.low}, {self.typical}, {self.high}")
        return self

    @property
    def log_spread(self) -> float:
        """The standard deviation of a value's natural logarithm, at least ``LEAST_LOG_SPREAD``."""
        return max(math.log(self.high / self.low) / DEVIATIONS_ACROSS, LEAST_LOG_SPREAD)

    @property
    def upper_log_spread(self) -> float:
        """That of the values above the typical one alone."""
        return max(2 * math.log(self.high / self.typical) / DEVIATIONS_ACROSS, LEAST_LOG_SPREAD)

    def estimate(self, source: str) -> Estimate:
        """Return the typical value with the interval around it, said by ``source``."""
        return Estimate(value=self.typical, low=self.low, high=self.high, source=source)


def _interval_from_list(value: Any) -> Any:
    if isinstance(value, list) and len(value) == 3:
        return dict(zip(("low", "typical", "high"), value, strict=True))
    return value


LowTypicalHigh = Annotated[Interval, BeforeValidator(_interval_from_list)]


class FunctionalPart(Record):
    """A part with a use: ``feature`` says where it is, as geometry."""

    label: str
    description: str
    feature: Feature


class GraspPart(Record):
    """A place to hold such a thing, how, and for what."""

    type: GraspType
    scenario: str
    feature: Feature


class Material(Record):
    """Contact properties of a surface material; ``source`` says where they are from.

    ``wall_m`` is how thick walls of open ware are made of it; None where they are not.
    """

    friction_static: LowTypicalHigh
    friction_dynamic: LowTypicalHigh
    restitution: LowTypicalHigh
    density_kg_m3: LowTypicalHigh
    wall_m: LowTypicalHigh | None = None
    source: str


class Form(Record):
    """The shape, rest and parts that a family of categories shares; ``parts`` is the rule that tells them apart on a surface.

    ``level``: what stands has its long axis level, and is put on no end. ``often_stands``: laid down, but stands where its
    file has it so. ``opens_aside``: its openings are in its sides and not its top.
    ``vessel``: closed, and weighs what it holds: its bulk densities are from empty to full.
    """

    shape: str
    stands: bool | None = None
    level: bool = False
    often_stands: bool = False
    opens_aside: bool = False
    container: bool
    mass_distribution: Distribution
    vessel: bool = False
    wall_thickness_m: float | None = None
    head_end: HeadEnd = "wide"
    parts: PartRule | None = None
    functional: tuple[FunctionalPart, ...] = Field(min_length=2, max_length=4)
    grasp: tuple[GraspPart, ...] = Field(min_length=2, max_length=3)


class Places(Record):
    """What is where on a thing: the parts of ``Form`` that another form may have of it."""

    parts: PartRule | None
    functional: tuple[FunctionalPart, ...]
    grasp: tuple[GraspPart, ...]


class Prior(Form):
    """The usual values of one category of things.

    ``longest_axis_m`` is that of the oriented box. ``bulk_density_kg_m3`` is mass per volume of a repaired scan, not of
    the matter; None where a scan's volume says nothing of the mass. ``stands``: whether it is put down upright (None:
    either). ``like`` is the category whose numbers it has for want of its own, ``kin_of`` that whose form it has. ``counter``
    is what such things are counted by ('pair of'). ``part_materials`` are the materials of its parts by role, where they are
    of unlike matter. ``measured`` names the published measurements; ``sources`` says where the rest is from.
    ``with_handle`` are the places of such a thing from which a handle sticks out, where some have one, ``with_bail`` those of one
    that a handle goes over; ``stated`` is the material that somebody has said it is of.
    """

    category: str
    domain: str
    aliases: tuple[str, ...]
    longest_axis_m: LowTypicalHigh
    mass_kg: LowTypicalHigh
    bulk_density_kg_m3: LowTypicalHigh | None
    material: str
    surface: str
    friction_static: LowTypicalHigh
    friction_dynamic: LowTypicalHigh
    restitution: LowTypicalHigh
    function: str
    like: str | None = None
    kin_of: str | None = None
    counter: str | None = None
    part_materials: dict[PartRole, str] = Field(default_factory=dict)
    sources: tuple[str, ...] = Field(min_length=1)
    measured: tuple[str, ...]
    with_handle: Places | None = None
    with_bail: Places | None = None
    stated: str | None = None

    def of_shape(self, shape: Shape) -> Prior:
        """Return the prior with the places that a thing of this shape has.

        A tea cup or a basket may have a handle, or none; and a teapot whose lid is on has a lid where one without has an opening.
        """
        fitted, handle = self, shape.added_handle
        if handle is not None:
            places = self.with_handle if handle.bail is None else self.with_bail or self.with_handle
            fitted = self if places is None else self.model_copy(update=dict(places))
        if shape.opening is not None and shape.opening.axis[2] > _UPWARD:
            return fitted
        lid = {"label": "lid", "description": f"the lid, which closes the top of the {self.category}"}
        closed = [part.model_copy(update=lid) if part.feature == "mouth" else part for part in fitted.functional]
        return fitted if closed == list(fitted.functional) else fitted.model_copy(update={"functional": tuple(closed)})

    @property
    def source(self) -> str:
        """The source of its Estimates: whose numbers they are, and of which stated material: 'prior:mug of steel'."""
        return f"prior:{self.like or self.category}{f' of {self.stated}' if self.stated else ''}"
