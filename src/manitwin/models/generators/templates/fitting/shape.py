"""A template as a family of shapes: its measures as unknowns in units of their spread, and coarse solids of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from manitwin.geometry.solids.parts import PartedMesh
from manitwin.geometry.solids.shapes import SolidError, coarser
from manitwin.models.annotators.prior_names import lookup
from manitwin.models.generators.templates.fitting.drawing import edges_between
from manitwin.models.generators.templates.fitting.view import normalised
from manitwin.models.generators.templates.template import Template

_COARSE = 0.6  # of the chords of a full circle: the outline is off by 0.4 % of a radius
_SPREADS_IN_INTERVAL = 1.5  # the interval that nearly all things are in reaches so many standard deviations either way
MOST_SPREADS = 4.0
_LEAST_SPREAD = 0.04  # of the usual value


@dataclass(frozen=True)
class CoarseSolid:
    """A solid with normalised ``vertices (V, 3)``, ``faces (F, 3)``, ``part (F,)`` and its ``names``.

    ``edges`` are those of ``edges_between``. What is ``perforated`` is without its small holes."""

    vertices: np.ndarray
    faces: np.ndarray
    part: np.ndarray
    names: tuple[str, ...]
    edges: tuple[np.ndarray, np.ndarray]
    perforated: bool = False

    @classmethod
    def of(cls, mesh: PartedMesh, *, perforated: bool = False) -> CoarseSolid:
        """Normalise a closed mesh and find its edges."""
        unit, _, _ = normalised(mesh.vertices)
        return cls(unit, mesh.faces, mesh.part, mesh.names, edges_between(mesh.faces), perforated)

    @property
    def normals(self) -> np.ndarray:
        """The faces' outward unit normals ``(F, 3)``."""
        cross = self._cross
        return np.asarray(cross / np.maximum(np.linalg.norm(cross, axis=1, keepdims=True), 1e-15))

    @property
    def areas(self) -> np.ndarray:
        """The faces' areas ``(F,)``, in squares of the half diagonal."""
        return np.asarray(np.linalg.norm(self._cross, axis=1) / 2)

    @property
    def _cross(self) -> np.ndarray:
        a, b, c = (self.vertices[self.faces[:, corner]] for corner in range(3))
        return np.cross(b - a, c - a)

    def reshaped(self, vertices: np.ndarray) -> CoarseSolid:
        """Return the same faces with other normalised vertices."""
        return replace(self, vertices=vertices)


class Family:
    """The shapes of a template. A photo tells no size, so its first length keeps its usual value and only the others vary."""

    def __init__(self, template: Template, initial: Mapping[str, float] | None = None):
        """Take the template, and measures that are expected in place of the usual ones."""
        self.template = template
        prior = lookup(template.category)
        self.stands = prior is not None and prior.stands is True
        expected = template.typical() | {
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
        """Return the measures that lie ``spreads (K,)`` from the expected ones."""
        values = self._middle + spreads * np.where(spreads < 0, self._below, self._above)
        return self._fixed | {name: float(value) for name, value in zip(self.free, values, strict=True)}

    def solid(self, spreads: np.ndarray) -> CoarseSolid | None:
        """Return the coarse solid there; None where the measures give none."""
        key = tuple(np.round(spreads, 3).tolist())
        if key not in self._made:
            self._made[key] = self._build(np.array(key))
        return self._made[key]

    def changes(self, spreads: np.ndarray, step: float) -> list[tuple[np.ndarray, np.ndarray] | None]:
        """Return for each measure how the vertices move when it grows and when it shrinks by ``step`` spreads.

        None where the solid there has other faces, as where a chord more fits in: then it has to be built.
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
