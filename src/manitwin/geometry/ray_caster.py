"""First hits of many rays on a triangle mesh (Embree), and the thickness of a body by them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
import trimesh
from embreex.mesh_construction import TriangleMesh
from embreex.rtcore_scene import EmbreeScene

from manitwin.geometry.hulls.reduction import hull_mesh
from manitwin.geometry.kept import kept

MILLIMETRES = 1000.0  # Embree works in float32 with absolute tolerances: objects of a hand's size want larger units

_START_BELOW_SURFACE_M = 1e-5  # the ray must not meet the face that it starts on


class RayCaster:
    """A mesh prepared for rays, at the first of them."""

    def __init__(self, mesh: trimesh.Trimesh):
        self._mesh = mesh

    @classmethod
    def of_hulls(cls, hulls: Sequence[np.ndarray]) -> RayCaster:
        """Return that of the faces of convex hulls, each ``(V, 3)`` m; those inside other hulls are among them."""
        surfaces = [hull_mesh(vertices) for vertices in hulls]
        vertices, faces = trimesh.util.append_faces([s.vertices for s in surfaces], [s.faces for s in surfaces])
        return cls(trimesh.Trimesh(vertices, faces, process=False))

    def scaled(self, factor: float) -> RayCaster:
        """Return that of the mesh multiplied by a factor about its origin."""
        return RayCaster(trimesh.Trimesh(self._mesh.vertices * factor, self._mesh.faces, process=False))

    @cached_property
    def face_normals(self) -> np.ndarray:
        """The outward unit normals ``(F, 3)`` of the faces."""
        return np.asarray(self._mesh.face_normals)

    @cached_property
    def _prepared(self) -> tuple[EmbreeScene, TriangleMesh]:
        return kept(self._mesh, "rays", lambda: _rays(self._mesh))

    def first_hits(self, origins_m: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the distance (m; inf: nothing) and the face (-1: nothing) of each ray's first hit.

        ``origins_m`` and ``directions`` are ``(N, 3)``, the directions of unit length.
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
    scene = EmbreeScene()  # knows of its mesh, but does not keep it
    return scene, TriangleMesh(scene, (mesh.triangles * MILLIMETRES).astype(np.float32))


def local_thickness(mesh: trimesh.Trimesh, points_m: np.ndarray, normals: np.ndarray) -> np.ndarray:
    """Return the length (m) of matter behind surface points ``(N, 3)``, straight against outward normals ``(N, 3)``.

    A ray goes inward to the first surface. Where it meets none (a grazing point of an imperfect mesh), the answer is 0.
    """
    inward = -normals / np.linalg.norm(normals, axis=1, keepdims=True)
    distance, _ = RayCaster(mesh).first_hits(points_m + inward * _START_BELOW_SURFACE_M, inward)
    return np.where(np.isfinite(distance), distance + _START_BELOW_SURFACE_M, 0.0)
