"""Exact unsigned and signed distances from points to a triangle mesh."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.mesh_cache import cached_on_mesh

_LEAF_TRIANGLES = 4
_PAIRS_PER_CHUNK = 400_000  # (point, node) pairs tested at once, to bound the memory
_FEATURE_TOLERANCE = 1e-9  # barycentric tolerance within which a closest point lies on an edge or vertex


def distance_to_surface(points: np.ndarray, mesh: trimesh.Trimesh) -> np.ndarray:
    """Return the exact unsigned distance ``(N,)`` m from points ``(N, 3)`` to the surface of a mesh."""
    return closest_faces(points, mesh)[1]


def closest_faces(points: np.ndarray, mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """Return the index ``(N,)`` of the face closest to each point ``(N, 3)``, and the exact distance ``(N,)`` m.

    Method: branch and bound over a balanced tree of boxes, with the nearest vertex as the initial bound; point to triangle
    distance after Ericson, Real-Time Collision Detection, 5.1.5.
    """
    return ClosestFaces(mesh).find_closest(points)


def signed_distance(points: np.ndarray, mesh: trimesh.Trimesh) -> np.ndarray:
    """Return the exact distance ``(N,)`` m of points ``(N, 3)`` to a watertight welded mesh, negative inside.

    The sign is that of the angle-weighted pseudonormal at the closest point.
    Source: Baerentzen and Aanaes 2005, Signed distance computation using the angle weighted pseudonormal.
    """
    points = np.asarray(points, dtype=float).reshape(-1, 3)
    faces, distance = closest_faces(points, mesh)
    closest, weights = closest_points_on_triangles(points, np.asarray(mesh.triangles, dtype=float)[faces])
    normals = np.array(mesh.face_normals)[faces]
    near_zero = weights < _FEATURE_TOLERANCE
    on_edge, on_vertex = near_zero.sum(1) == 1, near_zero.sum(1) == 2
    normals[on_edge] = _edge_normals(mesh)[
        mesh.faces_unique_edges[faces[on_edge], (near_zero[on_edge].argmax(1) + 1) % 3]
    ]
    normals[on_vertex] = mesh.vertex_normals[mesh.faces[faces[on_vertex], weights[on_vertex].argmax(1)]]
    outside = np.einsum("ij,ij->i", points - closest, normals) >= 0
    return np.where(outside, distance, -distance)


def closest_points_on_triangles(points: np.ndarray, triangles: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the closest point ``(N, 3)`` on each triangle ``(N, 3, 3)`` to its point, and the barycentric weights ``(N, 3)``.

    Degenerate triangles are treated as their edges.
    """
    a, b, c = triangles[:, 0], triangles[:, 1], triangles[:, 2]
    weights = _interior_weights(points, a, b, c)
    outside = np.flatnonzero((weights < 0).any(1))
    if len(outside):
        weights[outside] = _boundary_weights(points[outside], triangles[outside])
    return np.einsum("nij,ni->nj", triangles, weights), weights


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.einsum("ij,ij->i", a, b)


def _interior_weights(points: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return barycentric weights of the projections onto the triangles' planes; -1 for degenerate triangles."""
    ab, ac, ap = b - a, c - a, points - a
    d00, d01, d11, d20, d21 = _dot(ab, ab), _dot(ab, ac), _dot(ac, ac), _dot(ap, ab), _dot(ap, ac)
    determinant = d00 * d11 - d01 * d01
    flat = determinant <= 1e-14 * d00 * d11
    safe = np.where(flat, 1.0, determinant)
    v, w = (d11 * d20 - d01 * d21) / safe, (d00 * d21 - d01 * d20) / safe
    weights = np.stack([1 - v - w, v, w], axis=1)
    weights[flat] = -1
    return weights


def _boundary_weights(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return barycentric weights of the closest points on the triangles' edges."""
    best = np.full(len(points), np.inf)
    weights = np.zeros((len(points), 3))
    for i, j in ((0, 1), (1, 2), (2, 0)):
        start, edge = triangles[:, i], triangles[:, j] - triangles[:, i]
        along = np.clip(_dot(points - start, edge) / np.maximum(_dot(edge, edge), 1e-300), 0, 1)
        offset = points - start - along[:, None] * edge
        squared = _dot(offset, offset)
        closer = squared < best
        best[closer] = squared[closer]
        weights[closer] = 0
        weights[closer, i], weights[closer, j] = 1 - along[closer], along[closer]
    return weights


def _edge_normals(mesh: trimesh.Trimesh) -> np.ndarray:
    """Return the sum of the normals of the faces at every unique edge, ``(E, 3)``."""
    normals = np.zeros((len(mesh.edges_unique), 3))
    np.add.at(normals, mesh.faces_unique_edges.ravel(), np.repeat(mesh.face_normals, 3, axis=0))
    return normals


class ClosestFaces:
    """A mesh prepared for repeated ``closest_faces`` queries."""

    def __init__(self, mesh: trimesh.Trimesh):
        self._tree = cached_on_mesh(mesh, "box tree", lambda: _BoxTree(np.asarray(mesh.triangles, dtype=float)))

    def find_closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the index ``(N,)`` of the face closest to each point ``(N, 3)``, and the exact distance ``(N,)`` m."""
        return self._tree.closest(np.asarray(points, dtype=float).reshape(-1, 3))


class _BoxTree:
    """A complete binary tree of axis-aligned boxes over triangles, stored level by level."""

    def __init__(self, triangles: np.ndarray):
        count = len(triangles)
        self.depth = max(0, int(np.ceil(np.log2(max(1.0, count / _LEAF_TRIANGLES)))))
        leaves = 2**self.depth
        size = -(-count // leaves)
        centers = triangles.mean(1)
        order: np.ndarray = np.resize(np.arange(count), leaves * size)  # triangles are repeated to fill the last leaf
        for level in range(self.depth):
            order = order.reshape(2**level, -1)
            grouped = centers[order]
            axis = np.ptp(grouped, axis=1).argmax(1)
            key = np.take_along_axis(grouped, axis[:, None, None], axis=2)[..., 0]
            order = np.take_along_axis(order, np.argsort(key, axis=1, kind="stable"), axis=1)
        self.order = order.reshape(leaves, size)
        self.triangles = triangles
        self.corners = cKDTree(triangles.reshape(-1, 3))
        low, high = triangles[self.order].min((1, 2)), triangles[self.order].max((1, 2))
        self.low, self.high = [low], [high]
        for _ in range(self.depth):
            low, high = low.reshape(-1, 2, 3).min(1), high.reshape(-1, 2, 3).max(1)
            self.low.insert(0, low)
            self.high.insert(0, high)

    def closest(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the index of the closest triangle and its distance for every point."""
        # The nearest vertex gives the initial bound for pruning.
        face = self.corners.query(points)[1] // 3
        offset = points - closest_points_on_triangles(points, self.triangles[face])[0]
        squared = _dot(offset, offset)
        chunk = max(1, _PAIRS_PER_CHUNK // 32)
        for start in range(0, len(points), chunk):
            self._descend(points, np.arange(start, min(start + chunk, len(points))), face, squared)
        return face, np.sqrt(squared)

    def _box_distance(self, points: np.ndarray, level: int, node: np.ndarray) -> np.ndarray:
        gap = np.maximum(np.maximum(self.low[level][node] - points, points - self.high[level][node]), 0)
        return _dot(gap, gap)

    def _descend(self, points: np.ndarray, index: np.ndarray, face: np.ndarray, squared: np.ndarray) -> None:
        node: np.ndarray = np.zeros(len(index), dtype=np.int64)
        for level in range(1, self.depth + 1):
            index, node = np.repeat(index, 2), (2 * node[:, None] + [0, 1]).ravel()
            keep = self._box_distance(points[index], level, node) < squared[index]
            index, node = index[keep], node[keep]
        lower = self._box_distance(points[index], self.depth, node)
        nearest_first = np.lexsort((lower, index))
        index, node, lower = index[nearest_first], node[nearest_first], lower[nearest_first]
        rank: np.ndarray = np.arange(len(index)) - np.searchsorted(index, index)
        tried = 0
        while len(index):  # leaves in rounds, nearest first: each round tightens the bound of the next
            now = rank < tried + max(1, tried)
            self._try_leaves(points, index[now], node[now], face, squared)
            tried += max(1, tried)
            keep = ~now & (lower < squared[index])
            index, node, lower, rank = index[keep], node[keep], lower[keep], rank[keep]

    def _try_leaves(
        self, points: np.ndarray, index: np.ndarray, leaf: np.ndarray, face: np.ndarray, squared: np.ndarray
    ) -> None:
        size = self.order.shape[1]
        for start in range(0, len(index), max(1, _PAIRS_PER_CHUNK // size)):
            part = slice(start, start + max(1, _PAIRS_PER_CHUNK // size))
            candidates = self.order[leaf[part]].ravel()
            owner = np.repeat(index[part], size)
            closest, _ = closest_points_on_triangles(points[owner], self.triangles[candidates])
            offset = points[owner] - closest
            found = _dot(offset, offset)
            first = np.lexsort((candidates, found, owner))
            owner, found, candidates = owner[first], found[first], candidates[first]
            head = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]])
            owner, found, candidates = owner[head], found[head], candidates[head]
            closer = found < squared[owner]
            squared[owner[closer]], face[owner[closer]] = found[closer], candidates[closer]
