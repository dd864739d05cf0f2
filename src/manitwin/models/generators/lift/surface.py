"""A closed surface with texture coordinates, and the cuts that keep it closed."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np

_EDGE_ON = 1e-6


@dataclass(frozen=True)
class LiftedSurface:
    """A closed triangle mesh: ``vertices (V, 3)``, ``faces (F, 3)`` wound outward, ``uv (V, 2)`` (v upward).

    x to the right of the photo, y up, z towards the camera, in pixels of the mask until scaled. Every vertex has one
    texture coordinate, of the photo seen along z: the projection has no seams. ``facing (V,)`` is 1 where the surface looks
    at the camera, 0 on the outline, -1 where the photo cannot show it.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray
    facing: np.ndarray

    def seen(self) -> np.ndarray:
        """Return for each face (F,) whether the photo shows it: no corner looks away from the camera."""
        return np.asarray(self.facing[self.faces].min(axis=1) > -_EDGE_ON)

    def moved(self, matrix: np.ndarray, offset: np.ndarray) -> LiftedSurface:
        """Return the surface under ``x -> matrix @ x + offset``; ``matrix`` must not mirror."""
        return LiftedSurface(self.vertices @ matrix.T + offset, self.faces, self.uv, self.facing)


def unseen_share(surface: LiftedSurface) -> float:
    """Return how much of the area the photo does not show."""
    a, b, c = (surface.vertices[surface.faces[:, corner]] for corner in range(3))
    areas = np.linalg.norm(np.cross(b - a, c - a), axis=1)
    return float(areas[~surface.seen()].sum() / areas.sum())


def to_manifold(surface: LiftedSurface) -> manifold3d.Manifold:
    """Return the solid; raises ValueError naming manifold3d's status where the surface is not closed."""
    properties = np.column_stack([surface.vertices, surface.uv, surface.facing]).astype(np.float32)
    solid = manifold3d.Manifold(manifold3d.Mesh(properties, surface.faces.astype(np.uint32)))
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"the lifted surface is not a solid: {solid.status().name}")
    return solid


def from_manifold(solid: manifold3d.Manifold) -> LiftedSurface:
    """Return the largest part of a solid as a surface."""
    parts = solid.decompose()
    largest = max(parts, key=lambda part: part.volume()) if parts else solid
    mesh = largest.to_mesh()
    properties = np.asarray(mesh.vert_properties, float)
    # a cut duplicates vertices on its edge; they have the same properties, so they may be one again
    target = np.arange(len(properties))
    target[np.asarray(mesh.merge_from_vert, np.int64)] = np.asarray(mesh.merge_to_vert, np.int64)
    used, faces = np.unique(target[np.asarray(mesh.tri_verts, np.int64)], return_inverse=True)
    return LiftedSurface(properties[used, :3], faces.reshape(-1, 3), properties[used, 3:5], properties[used, 5])


def cut_below(surface: LiftedSurface, axis: int, level: float) -> LiftedSurface:
    """Cut off what lies below ``level`` along a coordinate axis; the cut is closed by a flat face."""
    normal = np.zeros(3)
    normal[axis] = 1.0
    return from_manifold(to_manifold(surface).trim_by_plane(normal.tolist(), float(level)))
