"""Unions of named parts: one closed surface with the part of each face."""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, field

import numpy as np
from manifold3d import Manifold

from manitwin.geometry.solids.borders import cut_along_border
from manitwin.geometry.solids.shapes import require_solid


@dataclass(frozen=True)
class PartedMesh:
    """A closed mesh in metres: ``vertices (V, 3)``, outward ``faces (F, 3)``, ``part (F,)`` as indices into ``names``."""

    vertices: np.ndarray
    faces: np.ndarray
    part: np.ndarray
    names: tuple[str, ...]

    def faces_of(self, name: str) -> np.ndarray:
        """Return the indices of a part's faces."""
        return np.nonzero(self.part == self.names.index(name))[0]


@dataclass
class Assembly:
    """Parts combined step by step: added solids are united, and cut solids leave walls with their own part name.

    Where parts overlap, the surface belongs to the outer one. Each face keeps its part name through all later steps.
    """

    _solid: Manifold = field(default_factory=Manifold)
    _names: dict[int, str] = field(default_factory=dict)
    _regions: list[tuple[str, str, Callable[[np.ndarray], np.ndarray]]] = field(default_factory=list)
    _volumes: list[tuple[str, Manifold]] = field(default_factory=list)

    def add(self, name: str, solid: Manifold) -> Assembly:
        """Unite with a solid, whose surface becomes the part ``name``; the portion inside other parts adds nothing."""
        own = self._named(name, solid)
        before = self._solid
        self._solid = before + own
        self._volumes.append((name, own - before))
        return self

    def cut(self, name: str, solid: Manifold) -> Assembly:
        """Subtract a solid; the resulting walls become the part ``name``."""
        own = self._named(name, solid)
        self._solid = self._solid - own
        self._volumes = [(part, volume - own) for part, volume in self._volumes]
        return self

    def region(self, name: str, of: str, where: Callable[[np.ndarray], np.ndarray]) -> Assembly:
        """Rename faces of part ``of`` whose centre satisfies ``where`` (centres ``(N, 3)`` to ``(N,) bool``)."""
        self._regions.append((name, of, where))
        return self

    def moved(self, offset_m: tuple[float, float, float]) -> Assembly:
        """Return the translated assembly; its regions are still evaluated in the original frame."""
        shift = np.array(offset_m)
        moved_regions = [(name, of, _shifted(where, shift)) for name, of, where in self._regions]
        volumes = [(name, solid.translate(offset_m)) for name, solid in self._volumes]
        return Assembly(self._solid.translate(offset_m), dict(self._names), moved_regions, volumes)

    def turned(self, rotation: np.ndarray) -> Assembly:
        """Return the assembly rotated about the origin ``(3, 3)``; its regions are still evaluated in the original frame."""
        matrix = np.column_stack([rotation, np.zeros(3)])
        turned_regions = [(name, of, _turned(where, rotation)) for name, of, where in self._regions]
        volumes = [(name, solid.transform(matrix)) for name, solid in self._volumes]
        return Assembly(self._solid.transform(matrix), dict(self._names), turned_regions, volumes)

    def triangles_m(self) -> np.ndarray:
        """Return the corners of the union's faces ``(F, 3, 3)``, wound outward."""
        mesh = self._solid.to_mesh()
        return np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3][np.asarray(mesh.tri_verts, dtype=np.int64)]

    def lowest_m(self) -> float:
        """Return the height of the lowest point."""
        return float(self._solid.bounding_box()[2])

    def solids(self) -> list[tuple[str, Manifold]]:
        """Return the non-overlapping volumes that each part contributes to the union, minus the cuts."""
        return [(name, solid) for name, solid in self._volumes if not solid.is_empty()]

    def regions(self) -> list[tuple[str, str]]:
        """Return the name of each region and the part that it belongs to."""
        return [(name, of) for name, of, _ in self._regions]

    def mesh(self, bordered: Collection[tuple[str, str]] = ()) -> PartedMesh:
        """Return the union as a mesh. Raises SolidError if it is empty.

        ``bordered`` are regions, as (name, part), whose borders become mesh edges by cutting faces. Other regions consist of
        whole faces.
        """
        mesh = require_solid(self._solid, "assembly").to_mesh()
        vertices = np.asarray(mesh.vert_properties, dtype=np.float64)[:, :3]
        faces = np.asarray(mesh.tri_verts, dtype=np.int64)
        merged = np.arange(len(vertices))
        merged[np.asarray(mesh.merge_from_vert, dtype=np.int64)] = np.asarray(mesh.merge_to_vert, dtype=np.int64)
        faces = merged[faces]
        names = list(dict.fromkeys([*self._names.values(), *(name for name, _, _ in self._regions)]))
        part = np.zeros(len(faces), dtype=np.int64)
        starts = np.asarray(mesh.run_index, dtype=np.int64) // 3
        for original, start, end in zip(mesh.run_original_id, starts[:-1], starts[1:], strict=True):
            part[start:end] = names.index(self._names[int(original)])
        for name, of, where in self._regions:
            chosen = part == names.index(of)
            if (name, of) in bordered:
                vertices, faces, origin, within = cut_along_border(vertices, faces, chosen, where)
                part = part[origin]
            else:
                within = chosen & where(vertices[faces].mean(axis=1))
            part[within] = names.index(name)
        used, faces_used = np.unique(faces, return_inverse=True)
        return PartedMesh(vertices[used], faces_used.reshape(-1, 3), part, tuple(names))

    def _named(self, name: str, solid: Manifold) -> Manifold:
        own = solid.as_original()
        self._names[own.original_id()] = name
        return own


def _turned(where: Callable[[np.ndarray], np.ndarray], rotation: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    return lambda centers: where(centers @ rotation)


def _shifted(where: Callable[[np.ndarray], np.ndarray], shift: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    return lambda centers: where(centers - shift)
