"""Records of the priors' table: usual sizes and masses, materials, parts and uses of a category of objects."""

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
"""Upper bound of the bulk density of closed packages; sugar, sand and shampoo in a jar are below."""

Distribution = Literal["full", "solid", "shell"]
"""Mass distribution.

``full``: filled with its contents or of one material; ``solid``: the mesh is the material itself, including its walls;
``shell``: hollow behind a closed skin.
"""


DEVIATIONS_ACROSS = 3.29
"""Standard deviations between the ends of an interval that holds 90 % of a log-normal distribution."""
LEAST_LOG_SPREAD = 0.02
_UPWARD = 0.9  # cosine between an opening's axis and the vertical


class Interval(Record):
    """A typical value and the interval that contains nearly all (about 19 of 20) objects of the category."""

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
        """Standard deviation of the value's natural logarithm, at least ``LEAST_LOG_SPREAD``."""
        return max(math.log(self.high / self.low) / DEVIATIONS_ACROSS, LEAST_LOG_SPREAD)

    @property
    def upper_log_spread(self) -> float:
        """The same for the values above the typical one only."""
        return max(2 * math.log(self.high / self.typical) / DEVIATIONS_ACROSS, LEAST_LOG_SPREAD)

    def estimate(self, source: str) -> Estimate:
        """Return the typical value with its interval as an estimate of ``source``."""
        return Estimate(value=self.typical, low=self.low, high=self.high, source=source)


def _interval_from_list(value: Any) -> Any:
    if isinstance(value, list) and len(value) == 3:
        return dict(zip(("low", "typical", "high"), value, strict=True))
    return value


LowTypicalHigh = Annotated[Interval, BeforeValidator(_interval_from_list)]


class FunctionalPart(Record):
    """A part with a function; ``feature`` is the geometric feature that locates it."""

    label: str
    description: str
    feature: Feature


class GraspPart(Record):
    """A place to grasp the object: grasp type, purpose, and the geometric feature that locates it."""

    type: GraspType
    scenario: str
    feature: Feature


class Material(Record):
    """Contact properties of a surface material; ``source`` is their origin.

    ``wall_m`` is the usual wall thickness of open containers of this material; None if there are none.
    """

    friction_static: LowTypicalHigh
    friction_dynamic: LowTypicalHigh
    restitution: LowTypicalHigh
    density_kg_m3: LowTypicalHigh
    wall_m: LowTypicalHigh | None = None
    source: str


class Form(Record):
    """Shape, resting pose and parts that a family of categories shares; ``parts`` is the rule that segments the surface.

    ``stands``: whether it is put down upright (None: either). ``level``: the long axis of a standing object is horizontal.
    ``often_stands``: usually laid down, but stays upright if its file has it upright. ``opens_aside``: its openings are in
    the sides, not the top. ``vessel``: closed and holding contents; its bulk densities range from empty to full.
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
    """The parts and places of an object, as far as another ``Form`` may replace them."""

    parts: PartRule | None
    functional: tuple[FunctionalPart, ...]
    grasp: tuple[GraspPart, ...]


class Prior(Form):
    """Usual values of one category of objects.

    - ``longest_axis_m``: longest side of the oriented bounding box
    - ``bulk_density_kg_m3``: mass per volume of a repaired scan, not of the material; None if a scan's volume does not
      determine the mass
    - ``like``: category whose numbers are used because there are none for this one
    - ``kin_of``: category whose form is used
    - ``counter``: word by which such objects are counted ('pair of')
    - ``part_materials``: materials of the parts by role, if parts differ in material
    - ``measured``: published measurements; ``sources``: origin of the other values
    - ``with_handle``: places of the variant with a side handle, if there is one; ``with_bail``: of the variant with an
      overhead handle
    - ``stated``: material that the user has stated
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
        """Return the prior with the places that an object of this shape has.

        A tea cup or a basket may have a handle or not; a teapot with its lid on has a lid in place of the opening.
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
        """Source of its estimates: the category of the numbers and the stated material, as in 'prior:mug of steel'."""
        return f"prior:{self.like or self.category}{f' of {self.stated}' if self.stated else ''}"
