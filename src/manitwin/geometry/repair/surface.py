"""The surface under repair: faces, their gluing, and their input faces."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from manitwin.geometry.repair.halfedges import BOUNDARY, face_components, split_vertices

NEW = -1
_REVERSED_CORNER = np.array([1, 0, 2])  # half-edge k of face (a, b, c) is half-edge _REVERSED_CORNER[k] of (c, b, a)


@dataclass(frozen=True)
class Surface:
    """Vertices ``(V, 3)``, faces ``(F, 3)`` and their gluing ``twin (3F,)``.

    ``source (F,)`` is the input face of each face (-1: new); ``flipped (F,)`` marks faces with reversed winding.
    """

    vertices: np.ndarray
    faces: np.ndarray
    source: np.ndarray
    flipped: np.ndarray
    twin: np.ndarray

    @staticmethod
    def unglued(vertices: np.ndarray, faces: np.ndarray, source: np.ndarray, flipped: np.ndarray) -> Surface:
        """Return a surface of unconnected faces."""
        return Surface(vertices, faces, source, flipped, np.full(3 * len(faces), BOUNDARY, dtype=np.int64))

    @property
    def areas(self) -> np.ndarray:
        """The area ``(F,)`` of every face."""
        return 0.5 * np.linalg.norm(face_cross_products(self.vertices, self.faces), axis=1)

    @property
    def boundary(self) -> np.ndarray:
        """The half-edges without a twin."""
        return np.flatnonzero(self.twin == BOUNDARY)

    def components(self) -> np.ndarray:
        """Return the component label ``(F,)`` of every face."""
        return face_components(self.twin)

    def select_faces(self, keep: np.ndarray) -> Surface:
        """Return the faces selected by ``keep (F,)``; half-edges glued to removed faces become boundary."""
        kept = np.flatnonzero(keep)
        where = np.full(len(self.faces), -1, dtype=np.int64)
        where[kept] = np.arange(len(kept))
        twin = self.twin.reshape(-1, 3)[kept].ravel()
        there = where[twin // 3]
        twin = np.where((twin >= 0) & (there >= 0), 3 * there + twin % 3, BOUNDARY)
        return Surface(self.vertices, self.faces[kept], self.source[kept], self.flipped[kept], twin)

    def reversed(self, which: np.ndarray) -> Surface:
        """Return the surface with the winding of faces ``which (F,)`` reversed."""
        faces = np.where(which[:, None], self.faces[:, ::-1], self.faces)
        halfedges = np.arange(3 * len(faces))
        moved = np.where(np.repeat(which, 3), halfedges - halfedges % 3 + _REVERSED_CORNER[halfedges % 3], halfedges)
        twin = np.full_like(self.twin, BOUNDARY)
        twin[moved] = np.where(self.twin >= 0, moved[self.twin], BOUNDARY)
        return replace(self, faces=faces, flipped=self.flipped ^ which, twin=twin)

    def with_split_vertices(self) -> Surface:
        """Return the surface with one vertex per fan of faces, without unused vertices."""
        vertices, faces = split_vertices(self.vertices, self.faces, self.twin)
        return replace(self, vertices=vertices, faces=faces)

    def followed_by(self, other: Surface) -> Surface:
        """Return the disjoint union of both surfaces."""
        twin = np.where(other.twin >= 0, other.twin + len(self.twin), BOUNDARY)
        return Surface(
            np.concatenate((self.vertices, other.vertices)),
            np.concatenate((self.faces, other.faces + len(self.vertices))),
            np.concatenate((self.source, other.source)),
            np.concatenate((self.flipped, other.flipped)),
            np.concatenate((self.twin, twin)),
        )


def face_cross_products(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the unit normal of every face times twice its area, ``(F, 3)``."""
    a, b, c = vertices[faces[:, 0]], vertices[faces[:, 1]], vertices[faces[:, 2]]
    return np.cross(b - a, c - a)


def face_normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return the unit normal ``(F, 3)`` of every face; zero for degenerate faces."""
    cross = face_cross_products(vertices, faces)
    length = np.linalg.norm(cross, axis=1, keepdims=True)
    return np.divide(cross, length, out=np.zeros_like(cross), where=length > 0)


def signed_volumes(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the signed volume per label (divergence theorem); meaningful for closed components."""
    count = int(labels.max()) + 1
    weight = np.bincount(labels, minlength=count)
    centers = (
        np.stack([np.bincount(labels, vertices[faces[:, 0], i], minlength=count) for i in range(3)], 1)
        / weight[:, None]
    )
    a, b, c = (vertices[faces[:, i]] - centers[labels] for i in range(3))
    return np.bincount(labels, np.einsum("ij,ij->i", a, np.cross(b, c)) / 6, minlength=count)
