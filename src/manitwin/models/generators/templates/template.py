"""Templates: parametric objects built of named parts with known functions and materials.

A template defines the measures of its category with their usual intervals, and builds the parts from them. The object frame is
that of twins: Z up, standing or lying on z = 0 in the natural pose, metres, front towards -Y.
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
OFF_SURFACE_KINDS: frozenset[PointKind] = frozenset({"opening", "hole", "axis"})
"""Kinds of points that need not lie on the surface."""


@dataclass(frozen=True)
class Measure:
    """A measure of a category: the interval of nearly all such objects and the typical value; ``unit`` '' means a ratio."""

    low: float
    typical: float
    high: float
    unit: Literal["m", ""]

    def sample(self, rng: np.random.Generator) -> float:
        """Sample a value from the triangular distribution with its mode at the typical value."""
        return float(rng.triangular(self.low, self.typical, self.high)) if self.high > self.low else self.typical


@dataclass(frozen=True)
class KnownPoint:
    """A functional point known by construction, on part ``part``; ``direction`` is the outward normal, or the axis
    for an axis.
    """

    label: str
    kind: PointKind
    part: str
    position_m: Vector
    direction: Vector


@dataclass
class Model:
    """A built object: named parts, the slot of each part, and its functional points."""

    assembly: Assembly = field(default_factory=Assembly)
    slots: dict[str, str] = field(default_factory=dict)
    points: list[KnownPoint] = field(default_factory=list)
    perforated: bool = False

    def add(self, part: str, solid: Manifold, slot: str = "") -> Model:
        """Add a solid as a part; without a slot it belongs to the first slot."""
        self.assembly.add(part, solid)
        self.slots[part] = slot
        return self

    def cut(self, part: str, solid: Manifold, slot: str = "") -> Model:
        """Subtract a solid; the resulting walls form a part."""
        self.assembly.cut(part, solid)
        self.slots.setdefault(part, slot)
        return self

    def perforate(self, part: str, holes: Callable[[], Manifold], slot: str = "") -> Model:
        """Subtract many small holes; they are omitted from coarse solids, where they would be a pixel or two wide."""
        self.perforated = True
        return self if is_coarse() else self.cut(part, holes(), slot)

    def region(self, part: str, of: str, where: Callable[[np.ndarray], np.ndarray], slot: str | None = None) -> Model:
        """Give the faces of another part whose centres ``(N, 3)`` satisfy ``where`` a name of their own."""
        self.assembly.region(part, of, where)
        self.slots.setdefault(part, slot or self.slots[of])
        return self

    def point(self, label: str, kind: PointKind, part: str, position_m: Vector, direction: Vector) -> Model:
        """Add a functional point with its outward direction and return this model."""
        self.points.append(KnownPoint(label, kind, part, position_m, direction))
        return self

    def rest_on_ground(self) -> Model:
        """Return the model moved vertically to rest on z = 0."""
        by_m = -self.assembly.lowest_m()
        points = [
            replace(p, position_m=(p.position_m[0], p.position_m[1], p.position_m[2] + by_m)) for p in self.points
        ]
        return Model(self.assembly.moved((0.0, 0.0, by_m)), dict(self.slots), points, self.perforated)


Builder = Callable[..., Model]
"""Builds a model from measures given as keyword arguments; raises SolidError for measures that give no solid."""
BUILDERS: dict[str, Builder] = {}
"""Builders by category, registered by the modules of ``catalog``."""


@dataclass(frozen=True)
class Template:
    """A category's measures, looks and builder.

    - ``category`` is one of the priors' categories; ``names`` are other names.
    - ``slots`` are the looks by slot, each a list of 'colour material' or 'material' to sample from. Colours and materials stated
      without a part refer to the first slot.
    - A measure ``wall_m`` is given for ceramic and adapted to the material.
    - ``contents_kg_m3`` is the mean density of closed parts including their contents.
    - ``of_sheet`` lists parts that are hollow sheet metal if metallic; with ``of_plate``, metal parts keep the stated wall
      instead.
    - ``length_of`` is the part that a length without a direction refers to ('' for the whole object): a pan of 24 cm has that
      diameter without its handle.
    - ``diagonal_of`` is the part, a screen, whose diagonal such a length in inches is.
    - ``nominal`` are measures whose product, times ``nominal_times``, is the nominal size of a tool: the jaw width of a 13 mm
      wrench.
    - ``any_proportions``: length, width and height may be arbitrary, as for a box; other objects stay near their intervals.
    - ``any_front``: the object, such as an apple, has no front; the visible side of a photo becomes the front.
    - ``told_in_full``: the last word of the name alone does not mean it: a bottle is no perfume bottle.
    - ``bare`` are names, such as king, that mean it only in a text without other nouns.
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

    def sample_measures(self, rng: np.random.Generator) -> dict[str, float]:
        """Return sampled values of all measures by name."""
        return {name: measure.sample(rng) for name, measure in self.measures.items()}

    def typical_measures(self) -> dict[str, float]:
        """Return the typical values of all measures by name."""
        return {name: measure.typical for name, measure in self.measures.items()}


def template(category: str) -> Callable[[Builder], Builder]:
    """Register a builder for a category; its keyword arguments are the measures."""

    def register(build: Builder) -> Builder:
        if category in BUILDERS:
            raise ValueError(f"two templates of {category!r}")
        BUILDERS[category] = build
        return build

    return register
