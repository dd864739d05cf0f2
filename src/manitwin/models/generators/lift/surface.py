"""A closed surface with texture coordinates, and the cuts that keep it closed."""

from __future__ import annotations

from dataclasses import dataclass

import manifold3d
import numpy as np


@dataclass(frozen=True)
class Surface:
    """A closed triangle mesh: ``vertices (V, 3)``, ``faces (F, 3)`` wound outward, ``uv (V, 2)`` (v upward).

    x to the right of the photo, y up, z towards the camera, in pixels of the mask until scaled. Every vertex has one
    texture coordinate: the projection has no seams.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray

    def moved(self, matrix: np.ndarray, offset: np.ndarray) -> Surface:
        """Return the surface under ``x -> matrix @ x + offset``; ``matrix`` must not mirror."""
        return Surface(self.vertices @ matrix.T + offset, self.faces, self.uv)


def to_manifold(surface: Surface) -> manifold3d.Manifold:
    """Return the solid; raises ValueError naming manifold3d's status where the surface is not closed."""
    properties = np.column_stack([surface.vertices, surface.uv]).astype(np.float32)
    solid = manifold3d.Manifold(manifold3d.Mesh(properties, surface.faces.astype(np.uint32)))
    if solid.status() != manifold3d.Error.NoError:
        raise ValueError(f"the lifted surface is not a solid: {solid.status().name}")
    return solid


def from_manifold(solid: manifold3d.Manifold) -> Surface:
    """Return the largest part of a solid as a surface."""
    parts = solid.decompose()
    largest = max(parts, key=lambda part: part.volume()) if parts else solid
    mesh = largest.to_mesh()
    properties = np.asarray(mesh.vert_properties, float)
    # a cut duplicates vertices on its edge; they have the same texture coordinates, so they may be one again
    target = np.arange(len(properties))
    target[np.asarray(mesh.merge_from_vert, np.int64)] = np.asarray(mesh.merge_to_vert, np.int64)
    used, faces = np.unique(target[np.asarray(mesh.tri_verts, np.int64)], return_inverse=True)
    return Surface(properties[used, :3], faces.reshape(-1, 3), properties[used, 3:5])


def cut_below(surface: Surface, axis: int, level: float) -> Surface:
    """Cut off what lies below ``level`` along a coordinate axis; the cut is closed by a flat face."""
    normal = np.zeros(3)
    normal[axis] = 1.0
    return from_manifold(to_manifold(surface).trim_by_plane(normal.tolist(), float(level)))
