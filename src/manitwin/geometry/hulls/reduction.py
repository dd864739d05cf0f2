"""Reduction of convex hulls to few vertices, and their OBJ representation."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import ConvexHull, QhullError

DECIMALS = 6  # micrometres, so that an OBJ file contains exactly the numbers that were checked
_FOLD_SHARE = 2e-6  # fraction of the hull's size; trimesh.convex.is_convex tolerates 1e-5
_LEAST_AREA_M2 = 1e-14  # trimesh.convex.is_convex ignores facets below 1e-13


def reduced_hull(points: np.ndarray, max_vertices: int, tolerance_m: float) -> np.ndarray:
    """Return at most ``max_vertices`` of ``points (N, 3)`` whose hull covers the others to within ``tolerance_m`` if possible.

    Starts from the six axis extremes, which preserves the bounding box, and adds the points farthest outside the current hull.
    Returns ``(V, 3)`` m rounded to micrometres, in lexicographic order, each a vertex of their hull. Raises QhullError if the
    points have no volume.
    """
    points = np.unique(np.round(points, DECIMALS), axis=0)
    points = points[np.sort(_hull(points).vertices)]
    if len(points) > max_vertices:
        points = points[_farthest_outside(points, max_vertices, tolerance_m)]
    return _strictly_convex(points)


def convex_corners(points: np.ndarray) -> tuple[np.ndarray, float]:
    """Return the vertices ``(V, 3)`` and volume (m3) of the hull of ``points (N, 3)``; all points and 0 if flat."""
    try:
        hull = _hull(points)
    except QhullError:
        return points, 0.0
    return points[np.sort(hull.vertices)], float(hull.volume)


def hull_volume(points: np.ndarray) -> float:
    """Return the volume (m3) of the convex hull of ``points (N, 3)``; 0 if flat."""
    return convex_corners(points)[1]


def hull_mesh(vertices: np.ndarray) -> trimesh.Trimesh:
    """Return the convex hull of ``vertices (V, 3)`` as a mesh with outward faces, keeping the order of vertices."""
    hull = _hull(vertices)
    faces = hull.simplices.copy()
    a, b, c = np.swapaxes(vertices[faces], 0, 1)
    inward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) < 0
    faces[inward] = faces[inward, ::-1]
    return trimesh.Trimesh(vertices, faces, process=False)


def hull_to_obj(vertices: np.ndarray) -> bytes:
    """Return the convex hull of ``vertices (V, 3)`` m as a Wavefront OBJ file; equal vertices give equal bytes."""
    mesh = hull_mesh(np.round(vertices, DECIMALS))
    faces = np.take_along_axis(mesh.faces, (mesh.faces.argmin(1)[:, None] + np.arange(3)) % 3, axis=1)
    faces = faces[np.lexsort(faces.T[::-1])]
    lines = [f"v {x:.{DECIMALS}f} {y:.{DECIMALS}f} {z:.{DECIMALS}f}" for x, y, z in mesh.vertices + 0.0]
    lines += [f"f {a} {b} {c}" for a, b, c in faces + 1]
    return ("\n".join(lines) + "\n").encode("ascii")


def _hull(points: np.ndarray) -> ConvexHull:
    return ConvexHull(points)


def _farthest_outside(points: np.ndarray, count: int, tolerance_m: float) -> np.ndarray:
    """Return indices of up to ``count`` hull vertices, greedily those farthest outside the current hull.

    The hull is rebuilt in each round, because Qhull's incremental mode aborts on nearly coplanar points (QH6347). A round
    therefore adds several points: the farthest one over each facet, if it is at least half as far outside as the farthest of
    all.
    """
    chosen = list(dict.fromkeys(np.r_[points.argmin(0), points.argmax(0)].tolist()))
    while len(chosen) < 4 or np.linalg.matrix_rank(points[chosen[1:]] - points[chosen[0]], tol=1e-7) < 3:
        away = _distance_to_span(points, chosen)
        chosen.append(int(away.argmax()))
    while len(chosen) < count:
        equations = _hull(points[chosen]).equations
        heights = points @ equations[:, :3].T + equations[:, 3]
        heights[chosen] = 0
        facet, outside = heights.argmax(1), heights.max(1)
        order = np.argsort(-outside, kind="stable")
        order = order[np.sort(np.unique(facet[order], return_index=True)[1])]
        far = order[(outside[order] >= tolerance_m) & (outside[order] >= outside[order[0]] / 2)]
        if not len(far):
            break
        chosen += far[: count - len(chosen)].tolist()
    return np.sort(np.array(chosen))


def _distance_to_span(points: np.ndarray, chosen: list[int]) -> np.ndarray:
    """Return the distance of each point from the point, line or plane through the chosen ones."""
    offsets = points - points[chosen[0]]
    _, strength, axes = np.linalg.svd(offsets[chosen])
    rank = int((strength > 1e-7).sum())
    return np.linalg.norm(offsets @ axes[rank:].T, axis=1)


def _strictly_convex(points: np.ndarray) -> np.ndarray:
    """Remove vertices with sliver facets that fold inward according to their triangles' own normals.

    Qhull's facets are convex by their planes, but a triangle between nearly collinear vertices has a different normal.
    """
    while True:
        hull = _hull(points)
        if len(hull.vertices) < len(points):
            points = points[np.sort(hull.vertices)]
            continue
        folded = _folded_vertices(hull)
        if not len(folded) or len(points) <= 4:
            return points
        stands_out = [_distance_outside(points, int(vertex)) for vertex in folded]
        points = np.delete(points, int(folded[int(np.argmin(stands_out))]), axis=0)


def _folded_vertices(hull: ConvexHull) -> np.ndarray:
    """Return the vertices of facets across whose edges the hull folds inward by more than rounding."""
    triangles = hull.points[hull.simplices]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    area = np.linalg.norm(normals, axis=1)
    normals /= np.maximum(area, 1e-300)[:, None]
    normals *= np.where(np.einsum("ij,ij->i", normals, hull.equations[:, :3]) < 0, -1.0, 1.0)[:, None]
    height = np.einsum("fkvj,fj->fkv", triangles[hull.neighbors] - triangles[:, None, :1], normals)
    limit = _FOLD_SHARE * float(np.linalg.norm(np.ptp(hull.points, axis=0)))
    facets = np.flatnonzero((height.max((1, 2)) > limit) & (area > _LEAST_AREA_M2))
    return np.unique(np.r_[hull.simplices[facets].ravel(), hull.simplices[hull.neighbors[facets]].ravel()])


def _distance_outside(points: np.ndarray, vertex: int) -> float:
    """Return the distance of a vertex from the hull of the others."""
    equations = _hull(np.delete(points, vertex, axis=0)).equations
    return float((equations[:, :3] @ points[vertex] + equations[:, 3]).max())
