"""Ray casting against triangle meshes (Embree), and the local thickness of a solid."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from manitwin.geometry.hulls.reduction import hull_mesh
from manitwin.geometry.mesh_cache import cached_on_mesh

MILLIMETRES = 1000.0  # Embree uses float32 with absolute tolerances, so hand-sized objects need larger units

_START_BELOW_SURFACE_M = 1e-5  # so that the ray does not hit the face it starts on


class RayCaster:
    """A mesh for ray casting; its acceleration structure is built with the first ray."""

    def __init__(self, mesh: trimesh.Trimesh):
        self._mesh = mesh

    @classmethod
    def of_hulls(cls, hulls: Sequence[np.ndarray]) -> RayCaster:
        """Build a caster for the faces of convex hulls, each ``(V, 3)`` m, including faces inside other hulls."""
        surfaces = [hull_mesh(vertices) for vertices in hulls]
        vertices, faces = trimesh.util.append_faces([s.vertices for s in surfaces], [s.faces for s in surfaces])
        return cls(trimesh.Trimesh(vertices, faces, process=False))

    def scaled(self, factor: float) -> RayCaster:
        """Return a caster for the mesh scaled by a factor about its origin."""
        return RayCaster(trimesh.Trimesh(self._mesh.vertices * factor, self._mesh.faces, process=False))

    @cached_property
    def face_normals(self) -> np.ndarray:
        """The outward unit normals ``(F, 3)`` of the faces."""
        return np.asarray(self._mesh.face_normals)

    @cached_property
    def _prepared(self) -> tuple[EmbreeScene, TriangleMesh]:
        return cached_on_mesh(self._mesh, "rays", lambda: _rays(self._mesh))

    def first_hits(self, origins_m: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return distance (m; inf: no hit) and face index (-1: no hit) of each ray's first hit.

        ``origins_m`` and ``directions`` are ``(N, 3)``, with directions of unit length.
        """
        if not len(origins_m):
            return np.zeros(0), np.zeros(0, dtype=np.int64)
        hits = self._prepared[0].run(
            np.ascontiguousarray(origins_m * MILLIMETRES, dtype=np.float32),
            np.ascontiguousarray(directions, dtype=np.float32),
            output=1,
        )
        face = hits["primID"].astype(np.int64)
        return np.where(face >= 0, hits["tfar"].astype(float) / MILLIMETRES, np.inf), face


def _rays(mesh: trimesh.Trimesh) -> tuple[EmbreeScene, TriangleMesh]:
    scene = EmbreeScene()  # the scene does not keep a reference to its mesh
    return scene, TriangleMesh(scene, (mesh.triangles * MILLIMETRES).astype(np.float32))


def local_thickness(mesh: trimesh.Trimesh, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the thickness (m) of the solid at surface points ``(N, 3)``, along the inverted outward normals ``(N, 3)``.

    It is the length of an inward ray to the first surface; 0 if the ray hits nothing (a grazing point of an imperfect mesh).
    """
    inward = -normals / np.linalg.norm(normals, axis=1, keepdims=True)
    distance, _ = RayCaster(mesh).first_hits(points_m + inward * _START_BELOW_SURFACE_M, inward)
    return np.where(np.isfinite(distance), distance + _START_BELOW_SURFACE_M, 0.0)
