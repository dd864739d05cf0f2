"""Through holes of a solid that its convex hulls keep open, in projection along its axes."""

from __future__ import annotations

from collections.abc import Sequence

import manifold3d
import numpy as np
import trimesh

from manitwin.geometry.hulls.cutting_planes import own_and_principal_axes

_LEAST_SHARE = 0.01  # fraction of the outline's area; smaller holes are scan defects or irrelevant


def holes_kept(mesh: trimesh.Trimesh, hulls: Sequence[np.ndarray]) -> float | None:
    """Return the open share of the most closed through hole under hulls, each ``(V, 3)`` m; None if the watertight mesh has no
    holes.

    Only straight holes along the object's or its principal axes with at least 1 % of the outline's area are considered.
    """
    if mesh.euler_number >= 2 * mesh.body_count:  # genus 0: no holes
        return None
    vertices = np.array(mesh.vertices, dtype=np.float64, order="C")  # a copy, as manifold3d rejects read-only arrays
    solid = manifold3d.Manifold(manifold3d.Mesh64(vertices, np.array(mesh.faces, dtype=np.uint64, order="C")))
    if solid.status() != manifold3d.Error.NoError:
        return None
    kept = [share for axis in own_and_principal_axes(vertices) for share in _kept_along(solid, hulls, axis)]
    return min(kept, default=None)


def _kept_along(solid: manifold3d.Manifold, hulls: Sequence[np.ndarray], axis: np.ndarray) -> list[float]:
    across = np.linalg.svd(axis[None])[2]
    frame = np.stack([across[1], np.cross(axis, across[1]), axis])
    seen = solid.transform(np.hstack([frame, np.zeros((3, 1))])).project()
    least = _LEAST_SHARE * seen.hull().area()
    flat = [manifold3d.CrossSection.hull_points(np.ascontiguousarray((hull @ frame.T)[:, :2])) for hull in hulls]
    filled = manifold3d.CrossSection.batch_boolean(flat, manifold3d.OpType.Add)
    outlines = [np.asarray(ring) for ring in seen.to_polygons()]
    # outlines of holes are clockwise
    holes = [manifold3d.CrossSection([ring[::-1]]) for ring in outlines if _area(ring) < 0]
    return [1 - (hole ^ filled).area() / hole.area() for hole in holes if hole.area() >= least]


def _area(ring: np.ndarray) -> float:
    return float(ring[:, 0] @ (np.roll(ring[:, 1], -1) - np.roll(ring[:, 1], 1))) / 2
