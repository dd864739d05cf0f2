"""Approximation error of a set of convex hulls with respect to a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
import trimesh
from scipy.spatial import ConvexHull

from manitwin.geometry.cavity import Opening, cavity_volume
from manitwin.geometry.distance import distance_to_surface, signed_distance
from manitwin.geometry.hulls.reduction import hull_mesh
from manitwin.geometry.sampling import sample_surface

_INSIDE_M = 1e-6


@dataclass(frozen=True)
class HullError:
    """Differences between the union of hulls and the mesh.

    ``surface_error_p95_m`` and ``surface_error_max_m`` are over mesh surface outside the hulls and hull surface outside the
    mesh together; ``surface_uncovered_max_m`` is over mesh surface only. ``volume_ratio`` is union over mesh. ``cavity_kept``
    is the open cavity volume of the union over that of the mesh; None without an opening.
    """

    surface_error_p95_m: float
    surface_error_max_m: float
    surface_uncovered_max_m: float
    volume_ratio: float
    cavity_kept: float | None


def hull_error(
    mesh: trimesh.Trimesh,
    hulls: Sequence[np.ndarray],
    opening: Opening | None,
    rng: np.random.Generator,
    samples: int = 6000,
) -> HullError:
    """Measure hulls (each ``(V, 3)`` m) against a watertight mesh.

    Cutting planes inside the mesh are ignored: hull surface counts only where it lies outside. ``samples`` points are taken on
    either surface; the uncovered maximum also includes every vertex.
    """
    union = hull_union(hulls)
    on_mesh = sample_surface(mesh, samples, rng)[0]
    on_hulls = sample_surface(union, samples, rng)[0]
    uncovered = uncovered_distance(np.vstack([on_mesh, mesh.vertices]), hulls, union)
    beyond = signed_distance(on_hulls, mesh)
    beyond = beyond[beyond > 0]
    both = np.concatenate([uncovered[:samples], beyond])
    cavity_kept = None
    if opening is not None:
        cavity_kept = cavity_volume(union, opening.axis) / cavity_volume(mesh, opening.axis)
    return HullError(
        surface_error_p95_m=float(np.percentile(both, 95)),
        surface_error_max_m=float(max(uncovered.max(), both.max())),
        surface_uncovered_max_m=float(uncovered.max()),
        volume_ratio=float(union.volume / mesh.volume),
        cavity_kept=cavity_kept,
    )


def hull_union(hulls: Sequence[np.ndarray]) -> trimesh.Trimesh:
    """Return the surface of the union of convex hulls as a watertight mesh."""
    solids = []
    for hull in hulls:  # Manifold.hull_points would lose corners of nearly flat clouds
        surface = hull_mesh(hull)
        faces = np.ascontiguousarray(surface.faces, dtype=np.uint64)
        solids.append(
            manifold3d.Manifold(manifold3d.Mesh64(np.ascontiguousarray(surface.vertices, dtype=float), faces))
        )
    union = manifold3d.Manifold.batch_boolean(solids, manifold3d.OpType.Add).to_mesh64()
    return trimesh.Trimesh(np.array(union.vert_properties)[:, :3], union.tri_verts.astype(np.int64), process=False)


def inside_any_hull(points: np.ndarray, hulls: Sequence[np.ndarray], tolerance_m: float = _INSIDE_M) -> np.ndarray:
    """Return which points ``(N, 3)`` lie inside a hull or within ``tolerance_m`` of its planes, ``(N,) bool``."""
    inside = np.zeros(len(points), dtype=bool)
    for hull in hulls:
        near = np.flatnonzero(
            ~inside & ((points >= hull.min(0) - tolerance_m) & (points <= hull.max(0) + tolerance_m)).all(1)
        )
        equations = ConvexHull(hull).equations
        inside[near] = (points[near] @ equations[:, :3].T + equations[:, 3] <= tolerance_m).all(1)
    return inside


def uncovered_distance(points: np.ndarray, hulls: Sequence[np.ndarray], union: trimesh.Trimesh) -> np.ndarray:
    """Return the distance ``(N,)`` m of points ``(N, 3)`` from the union of hulls, 0 inside."""
    distance = np.zeros(len(points))
    outside = ~inside_any_hull(points, hulls)
    if outside.any():
        distance[outside] = distance_to_surface(points[outside], union)
    return distance
