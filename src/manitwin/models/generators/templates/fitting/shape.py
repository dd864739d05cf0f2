"""A template as a family of shapes with its measures as normalized unknowns, and coarse solids of it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from manitwin.geometry.solids.parts import PartedMesh
from manitwin.geometry.solids.shapes import SolidError, coarser
from manitwin.models.annotators.prior_names import find_prior
from manitwin.models.generators.templates.fitting.drawing import edges_between
from manitwin.models.generators.templates.fitting.view import normalised
from manitwin.models.generators.templates.template import Template

_COARSE = 0.6  # of the chords of a full circle: the contour is off by 0.4 % of a radius
_SPREADS_IN_INTERVAL = 1.5  # standard deviations from the middle to either end of the usual interval
MOST_SPREADS = 4.0
_LEAST_SPREAD = 0.04  # of the typical value


@dataclass(frozen=True)
class CoarseSolid:
    """A solid with normalized ``vertices (V, 3)``, ``faces (F, 3)``, ``part (F,)`` and part ``names``.

    ``edges`` is the result of ``edges_between``. A ``perforated`` solid lacks its small holes.
    """

    vertices: np.ndarray
    faces: np.ndarray
    part: np.ndarray
    names: tuple[str, ...]
    edges: tuple[np.ndarray, np.ndarray]
    perforated: bool = False

    @classmethod
    def of(cls, mesh: PartedMesh, *, perforated: bool = False) -> CoarseSolid:
        """Normalize a closed mesh and find its edges."""
        unit, _, _ = normalised(mesh.vertices)
        return cls(unit, mesh.faces, mesh.part, mesh.names, edges_between(mesh.faces), perforated)

    @property
    def normals(self) -> np.ndarray:
        """Outward unit normals ``(F, 3)`` of the faces."""
        cross = self._cross
        return np.asarray(cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-15))

    @property
    def areas(self) -> np.ndarray:
        """Areas ``(F,)`` of the faces, in squares of the half diagonal."""
        return np.asarray(np.linalg.norm(self._cross, axis=1) / 2)

    @property
    def _cross(self) -> np.ndarray:
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        return np.cross(b - a, c - a)

    def with_vertices(self, vertices: np.ndarray) -> CoarseSolid:
        """Return the same faces with other normalized vertices."""
        return replace(self, vertices=vertices)


class ShapeFamily:
    """The shapes of a template. A photo does not determine the size: the first length keeps its expected value, the
    others vary.
    """

    def __init__(self, template: Template, initial: Mapping[str, float] | None = None):
        """Take the template, and expected measures that replace the typical ones."""
        self.template = template
        prior = find_prior(template.category)
        self.stands = prior is not None and prior.stands is True
        expected = template.typical_measures() | {
            name: value for name, value in (initial or {}).items() if name in template.measures
        }
        lengths = [name for name in template.measures if template.measures[name].unit == "m"]
        self._fixed = {name: expected[name] for name in lengths[:1]}
        self.free = [name for name in template.measures if name not in self._fixed]
        self._middle = np.array([expected[name] for name in self.free])
        least = _LEAST_SPREAD * np.abs(self._middle)
        low, high = (
            np.array([getattr(template.measures[name], end) for name in self.free], dtype=float)
            for end in ("low", "high")
        )
        self._below = np.maximum((self._middle - low) / _SPREADS_IN_INTERVAL, least)
        self._above = np.maximum((high - self._middle) / _SPREADS_IN_INTERVAL, least)
        self._made: dict[tuple[float, ...], CoarseSolid | None] = {}

    def measures(self, spreads: np.ndarray) -> dict[str, float]:
        """Return the measures at ``spreads (K,)`` standard deviations from the expected ones."""
        values = self._middle + spreads * np.where(spreads < 0, self._below, self._above)
        return self._fixed | {name: float(value) for name, value in zip(self.free, values, strict=True)}

    def solid(self, spreads: np.ndarray) -> CoarseSolid | None:
        """Return the coarse solid at ``spreads``, cached; None if the measures give none."""
        key = tuple(np.round(spreads, 3).tolist())
        if key not in self._made:
            self._made[key] = self._build(np.array(key))
        return self._made[key]

    def vertex_displacements(self, spreads: np.ndarray, step: float) -> list[tuple[np.ndarray, np.ndarray] | None]:
        """Return the vertex displacements when each measure grows and shrinks by ``step`` spreads.

        None for a measure whose change alters the faces, such as the number of chords; the solid must then be rebuilt.
        """
        here = self.solid(spreads)
        moves: list[tuple[np.ndarray, np.ndarray] | None] = []
        for k in range(len(spreads)):
            away = np.eye(len(spreads))[k] * step
            more, less = self.solid(spreads + away), self.solid(spreads - away)
            same = [
                other is not None
                and here is not None
                and other.faces.shape == here.faces.shape
                and np.array_equal(other.faces, here.faces)
                for other in (more, less)
            ]
            if here is None or more is None or less is None or not all(same):
                moves.append(None)
            else:
                moves.append((more.vertices - here.vertices, less.vertices - here.vertices))
        return moves

    def _build(self, spreads: np.ndarray) -> CoarseSolid | None:
        try:
            with coarser(_COARSE):
                model = self.template.build(**self.measures(spreads))
                mesh = model.assembly.mesh()
        except SolidError:
            return None
        return CoarseSolid.of(mesh, perforated=model.perforated)
