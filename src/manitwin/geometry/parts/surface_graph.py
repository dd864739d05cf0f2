"""A surface as a graph of its faces, and region growing that stops at concavities.

Large faces are subdivided first, so that borders can run anywhere; each piece knows its original face.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
import trimesh
from scipy.sparse import coo_matrix, csr_matrix, diags
from scipy.sparse.csgraph import dijkstra

from manitwin.geometry.parts.edge_subdivision import subdivide_long_edges

EDGE_SHARE = 1 / 40  # fraction of the longest side: longer edges are subdivided
# fraction of the longest side: scale at which creases and concavities are detected, above the noise
_SMOOTH_SHARE = 0.012
_MOST_ROUNDS = 60  # of averaging; a dense scan needs more
_CONCAVE_SHARE = 0.35  # fraction of the longest side: extra path length per radian of concave bend
_LEAST_TURN_RAD = 0.03  # smaller bends are noise left by averaging


class SurfaceGraph:
    """The faces of a closed mesh, subdivided, as a graph; ``size_m`` is its longest side."""

    def __init__(self, mesh: trimesh.Trimesh):
        self.size_m = float(mesh.extents.max())
        places, corner = np.unique(np.asarray(mesh.vertices), axis=0, return_inverse=True)  # merges seams
        vertices, faces, of_face = subdivide_long_edges(
            places, corner.reshape(-1)[mesh.faces], EDGE_SHARE * self.size_m
        )
        self._mesh = trimesh.Trimesh(vertices, faces, process=False)
        self._of_face, self._face_count = of_face, len(mesh.faces)

    @property
    def centers_m(self) -> np.ndarray:
        """The centres ``(P, 3)`` of the pieces."""
        return np.asarray(self._mesh.triangles_center)

    @property
    def normals(self) -> np.ndarray:
        """The outward unit normals ``(P, 3)`` of the pieces."""
        return np.asarray(self._mesh.face_normals)

    @property
    def corners_m(self) -> np.ndarray:
        """The vertices ``(C, 3)`` of the pieces."""
        return np.asarray(self._mesh.vertices)

    @property
    def areas_m2(self) -> np.ndarray:
        """The areas ``(P,)`` of the pieces."""
        return np.asarray(self._mesh.area_faces)

    def regrow_labels(self, labels: np.ndarray, band_share: float) -> np.ndarray:
        """Return labels ``(P,)`` that are kept away from their borders and regrown within a band, so that regions meet at
        concavities.

        ``band_share`` is relative to the longest side. A region thinner than the band everywhere keeps its middle.
        """
        a, b = self._pairs.T
        differ = labels[a] != labels[b]
        border = np.unique(np.concatenate([a[differ], b[differ]]))
        if not len(border):
            return labels
        away_m = dijkstra(self._plain, indices=border, min_only=True)
        names = np.unique(labels)
        reach = []
        for name in names:
            mine = labels == name
            width = min(band_share * self.size_m, 0.5 * float(away_m[mine & np.isfinite(away_m)].max(initial=0.0)))
            seeds = np.flatnonzero(mine & (away_m >= width))
            reach.append(dijkstra(self._concavity_graph, indices=seeds, min_only=True))
        distance = np.stack(reach)
        found = names[distance.argmin(0)]
        return np.where(np.isfinite(distance.min(0)), found, labels)

    def labels_by_face(self, labels: np.ndarray) -> np.ndarray:
        """Return the label of each original face ``(F,)``: that of the largest part of its area."""
        names, place = np.unique(labels, return_inverse=True)
        share = np.zeros((self._face_count, len(names)))
        np.add.at(share, (self._of_face, place), self.areas_m2 + 1e-15)
        return np.asarray(names[share.argmax(1)])

    def labels_by_piece(self, labels: np.ndarray) -> np.ndarray:
        """Return the label of each piece ``(P,)`` from those of the original faces ``(F,)``."""
        return np.asarray(labels[self._of_face])

    @cached_property
    def _pairs(self) -> np.ndarray:
        return np.asarray(self._mesh.face_adjacency)

    @cached_property
    def _steps_m(self) -> np.ndarray:
        a, b = self._pairs.T
        return np.asarray(np.linalg.norm(self.centers_m[a] - self.centers_m[b], axis=1)) + 1e-9

    @cached_property
    def _plain(self) -> csr_matrix:
        return self._graph(self._steps_m)

    @cached_property
    def _concavity_graph(self) -> csr_matrix:
        """The graph in which crossing a concavity costs as much as a path across a good part of the object."""
        a, b = self._pairs.T
        normals = self._smooth_normals
        turn = np.arccos(np.clip(np.einsum("ij,ij->i", normals[a], normals[b]), -1, 1))
        toward = self.centers_m[b] - self.centers_m[a]
        hollow = np.einsum("ij,ij->i", normals[b] - normals[a], toward) < 0
        turn = np.where(hollow, np.maximum(turn - _LEAST_TURN_RAD, 0.0), 0.0)
        return self._graph(self._steps_m + _CONCAVE_SHARE * self.size_m * turn)

    @cached_property
    def _smooth_normals(self) -> np.ndarray:
        """Normals ``(P, 3)`` averaged over neighbours by area, to suppress scan noise."""
        typical_m = float(np.median(self._steps_m))
        rounds = int(np.clip(round((_SMOOTH_SHARE * self.size_m / typical_m) ** 2), 1, _MOST_ROUNDS))
        a, b = self._pairs.T
        count = len(self.centers_m)
        ones = np.ones(len(a))
        near = coo_matrix((ones, (a, b)), shape=(count, count)).tocsr()
        weighted = (near + near.T + diags(np.ones(count))) @ diags(self.areas_m2 + 1e-15)
        normals = np.array(self._mesh.face_normals)
        for _ in range(rounds):
            normals = weighted @ normals
            normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
        return normals

    def _graph(self, cost: np.ndarray) -> csr_matrix:
        a, b = self._pairs.T
        count = len(self.centers_m)
        return coo_matrix((np.r_[cost, cost], (np.r_[a, b], np.r_[b, a])), shape=(count, count)).tocsr()
