"""Segmentation of a surface into parts: rules assign points away from borders, and regions grow to meet at concavities."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import trimesh
from scipy.spatial import cKDTree

from manitwin.geometry.parts.edge_subdivision import subdivide_long_edges
from manitwin.geometry.parts.membership import PartRule
from manitwin.geometry.parts.part_rules import membership
from manitwin.geometry.parts.shape import Shape
from manitwin.geometry.parts.skin_rules import skin_membership
from manitwin.geometry.parts.surface_graph import EDGE_SHARE, SurfaceGraph

_LEAST_AREA_SHARE = 0.005  # smaller parts are errors of the rules
_NEIGHBOURS = 8
_SAME_M = 1e-6  # distance between centres of the same face, read from a file in single precision


@dataclass(frozen=True)
class Segmentation:
    """The parts of a mesh: ``role (F,)`` of each face as an index into ``roles``, and the confidence in the border."""

    roles: tuple[str, ...]
    role: np.ndarray
    confidence: float


def segment_by_rule(mesh: trimesh.Trimesh, shape: Shape, rule: PartRule) -> Segmentation | None:
    """Return the parts of a closed mesh by the rule for its form; None if it does not show at least two of them."""
    graph = SurfaceGraph(mesh)
    found = membership(rule, shape, graph.centers_m) or skin_membership(rule, shape, graph, mesh)
    if found is None:
        return None
    shares = np.bincount(found.index, graph.areas_m2, len(found.roles)) / graph.areas_m2.sum()
    large = np.flatnonzero(shares >= _LEAST_AREA_SHARE)
    if len(large) < 2:
        return None
    index = np.where(np.isin(found.index, large), found.index, large[shares[large].argmax()])
    role = graph.labels_by_face(graph.regrow_labels(index, found.band_share))
    return Segmentation(found.roles, role, found.confidence)


def transfer_face_labels(labels: np.ndarray, mesh: trimesh.Trimesh, to: trimesh.Trimesh) -> np.ndarray:
    """Transfer face labels ``(F,)`` of a mesh to the faces ``(G,)`` of another mesh of the same surface.

    Each face takes the label of the nearest piece with a similar normal, as both sides of a thin wall are near.
    """
    centers, normals = np.asarray(to.triangles_center), np.asarray(to.face_normals)
    apart, same = cKDTree(mesh.triangles_center).query(centers)
    same_face = (apart < _SAME_M) & (np.einsum("ij,ij->i", np.asarray(mesh.face_normals)[same], normals) > 0)
    if same_face.all():
        return np.asarray(labels[same])
    vertices, faces, of_face = subdivide_long_edges(mesh.vertices, mesh.faces, EDGE_SHARE * float(mesh.extents.max()))
    pieces = trimesh.Trimesh(vertices, faces, process=False)
    count = min(_NEIGHBOURS, len(faces))
    _, near = cKDTree(pieces.triangles_center).query(centers, k=count)
    near = near.reshape(len(centers), count)
    agree = np.einsum("nki,ni->nk", np.asarray(pieces.face_normals)[near], normals) > 0
    first = np.where(agree.any(1), agree.argmax(1), 0)
    nearest = of_face[near[np.arange(len(centers)), first]]
    return np.asarray(labels[np.where(same_face, same, nearest)])
