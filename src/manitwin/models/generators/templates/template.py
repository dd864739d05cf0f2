"""Templates: things described by a few measures, built of named parts whose use and matter are known.

A template gives the measures of its category with the interval that such things are in, and builds the parts from them. The
object frame is that of twins: Z up, standing or lying on z = 0 as such a thing does, metres, front towards -Y.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.parts import Assembly
from manitwin.geometry.solids.shapes import is_coarse

Group = Literal["kitchen", "tools", "electronics", "personal", "office", "household"]
"""The paper's six groups of categories."""
Vector = tuple[float, float, float]
PointKind = Literal["opening", "face", "tip", "edge", "hole", "axis", "button", "surface"]
IN_THE_OPEN: frozenset[PointKind] = frozenset({"opening", "hole", "axis"})
"""The kinds whose places need not be on the surface."""


@dataclass(frozen=True)
class Measure:
    """A measure of a category: the interval that nearly all such things are in and the usual value; ``unit`` '' is a ratio."""

    low: float
    typical: float
    high: float
    unit: Literal["m", ""]

    def drawn(self, rng: np.random.Generator) -> float:
        """Draw a value: triangular, so that most are near the usual one and none outside."""
        return float(rng.triangular(self.low, self.typical, self.high)) if self.high > self.low else self.typical


@dataclass(frozen=True)
class KnownPoint:
    """A place with a use, known by construction: on part ``part``, ``direction`` out of the object (of an axis, along it)."""

    label: str
    kind: PointKind
    part: str
    position_m: Vector
    direction: Vector


@dataclass
class Model:
    """What a template builds: named parts, the slot of looks that each wears, and the places with a use."""

    assembly: Assembly = field(default_factory=Assembly)
    slots: dict[str, str] = field(default_factory=dict)
    points: list[KnownPoint] = field(default_factory=list)
    perforated: bool = False

    def add(self, part: str, solid: Manifold, slot: str = "") -> Model:
        """Join a solid as a part; without a slot it wears the first one."""
        self.assembly.add(part, solid)
        self.slots[part] = slot
        return self

    def cut(self, part: str, solid: Manifold, slot: str = "") -> Model:
        """Cut a solid out; the walls that this leaves are a part."""
        self.assembly.cut(part, solid)
        self.slots.setdefault(part, slot)
        return self

    def perforate(self, part: str, holes: Callable[[], Manifold], slot: str = "") -> Model:
        """Cut many small holes; they are left out of solids that are drawn small, where they are of a pixel or two."""
        self.perforated = True
        return self if is_coarse() else self.cut(part, holes(), slot)

    def region(self, part: str, of: str, where: Callable[[np.ndarray], np.ndarray], slot: str | None = None) -> Model:
        """Give the faces of another part whose centres ``(N, 3)`` are ``where`` a name of their own."""
        self.assembly.region(part, of, where)
        self.slots.setdefault(part, slot or self.slots[of])
        return self

    def point(self, label: str, kind: PointKind, part: str, position_m: Vector, direction: Vector) -> Model:
        """Add a place that is known to have a use, with its direction out of the thing; return this model."""
        self.points.append(KnownPoint(label, kind, part, position_m, direction))
        return self

    def laid(self) -> Model:
        """Return the model moved up or down to rest on z = 0."""
        by_m = -self.assembly.lowest_m()
        points = [
            replace(p, position_m=(p.position_m[0], p.position_m[1], p.position_m[2] + by_m)) for p in self.points
        ]
        return Model(self.assembly.moved((0.0, 0.0, by_m)), dict(self.slots), points, self.perforated)


Builder = Callable[..., Model]
"""Builds a model from measures, each given by its name; raises SolidError for measures that give no solid."""
BUILDERS: dict[str, Builder] = {}
"""Builders by category, filled by the modules of ``catalog``."""


@dataclass(frozen=True)
class Template:
    """A category's measures, looks and builder.

    ``category`` is one of the priors', ``names`` what it is called besides. ``slots`` are the looks by slot, each a list of
    'colour material' or 'material' to draw from; the first slot is what colours and materials without a part's name mean. A
    measure ``wall_m`` is that of ceramic and follows the material. ``contents_kg_m3`` is the mean density of parts that are
    closed containers, with what is in them. ``of_sheet`` are parts that are hollow behind a sheet where they are of metal;
    ``of_plate``: what is of metal has the wall that is stated, and none of sheet. ``length_of`` is the part that a length
    without a direction is of: a pan of 24 cm has that diameter, without its handle; '' for the whole. ``diagonal_of`` is the
    part, a screen, that such a length in inches is the diagonal of. ``nominal`` are the measures whose product, times
    ``nominal_times``, is what such a tool is called by: a wrench of 13 mm has a jaw so wide. What has ``any_proportions``, a
    box, is as long, wide and high as is said; other things keep near their intervals. What has ``any_front``, an apple, has no
    side that is its front: of a photo it is the side that is seen. What is ``told_in_full`` is not meant by the last word of
    its name alone: who says bottle means no perfume bottle. ``bare`` are names that mean it in a text where no other noun is said
    with them: king.
    """

    category: str
    group: Group
    measures: Mapping[str, Measure]
    slots: Mapping[str, tuple[str, ...]]
    build: Builder
    names: tuple[str, ...] = ()
    contents_kg_m3: Mapping[str, float] = field(default_factory=dict)
    of_sheet: tuple[str, ...] = ()
    of_plate: bool = False
    length_of: str = ""
    diagonal_of: str = ""
    nominal: tuple[str, ...] = ()
    nominal_times: float = 1.0
    any_proportions: bool = False
    any_front: bool = False
    told_in_full: bool = False
    bare: tuple[str, ...] = ()

    def drawn(self, rng: np.random.Generator) -> dict[str, float]:
        """Return a value of each measure, by name, drawn within its interval."""
        return {name: measure.drawn(rng) for name, measure in self.measures.items()}

    def typical(self) -> dict[str, float]:
        """Return the usual value of each measure, by name."""
        return {name: measure.typical for name, measure in self.measures.items()}


def template(category: str) -> Callable[[Builder], Builder]:
    """Register a builder as that of a category, whose measures are its keyword arguments."""

    def register(build: Builder) -> Builder:
        if category in BUILDERS:
            raise ValueError(f"two templates of {category!r}")
        BUILDERS[category] = build
        return build

    return register
