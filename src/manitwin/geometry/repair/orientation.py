"""Face winding: consistent within every component, and outward on solids."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order

from manitwin.geometry.repair.halfedges import BOUNDARY, face_components, halfedge_vertices, label_components
from manitwin.geometry.repair.surface import Surface, signed_volumes

_PAIRS_PER_CHUNK = 200_000  # (point, triangle) pairs in memory at once


def wind_consistently(surface: Surface) -> Surface:
    """Reverse as few faces as possible so that glued faces traverse their edge in opposite directions.

    Each component keeps the winding of most of its faces. A one-sided component (Moebius strip) is cut open along the edges
    where a breadth-first traversal meets itself with opposite winding.
    """
    twin, count = surface.twin, len(surface.faces)
    start, _ = halfedge_vertices(surface.faces)
    glued = np.flatnonzero(twin >= 0)
    same_way = start[glued] == start[twin[glued]]
    if not same_way.any():
        return surface
    a, b = glued // 3, twin[glued] // 3
    # Double cover: node f is face f as given, node F + f is face f reversed; links join consistent states.
    labels = label_components(
        2 * count,
        np.concatenate((a, a + count)),
        np.concatenate((b + count * same_way, b + count * ~same_way)),
    )
    as_is, turned = labels[:count], labels[count:]
    reverse = _fewer_reversed(as_is, turned)
    one_sided = as_is == turned
    if one_sided.any():
        reverse[one_sided] = _tree_parity(face_components(twin), a, b, same_way, one_sided)[one_sided]
    conflict = glued[same_way ^ reverse[a] ^ reverse[b]]
    cut = twin.copy()
    cut[conflict] = BOUNDARY
    return Surface(surface.vertices, surface.faces, surface.source, surface.flipped, cut).reversed(reverse)


def _fewer_reversed(as_is: np.ndarray, turned: np.ndarray) -> np.ndarray:
    """Choose the state with fewer reversed faces per component; return ``reverse (F,)``."""
    first = np.minimum(as_is, turned)  # the state in which the first face of the component is as given
    agrees = as_is == first
    votes = np.bincount(first, np.where(agrees, 1, -1), minlength=int(max(as_is.max(), turned.max())) + 1)
    return np.where(votes[first] >= 0, ~agrees, agrees)


def _tree_parity(
    labels: np.ndarray, a: np.ndarray, b: np.ndarray, same_way: np.ndarray, which: np.ndarray
) -> np.ndarray:
    """Return ``reverse (F,)`` along breadth-first trees of the components that contain the faces ``which``."""
    count = len(labels)
    links = coo_matrix((np.where(same_way, 2, 1), (a, b)), shape=(count, count)).tocsr()
    reverse = np.zeros(count, dtype=bool)
    for label in np.unique(labels[which]):
        root = int(np.flatnonzero(labels == label)[0])
        order, parent = breadth_first_order(links, root, directed=False)
        for face in order[1:]:
            reverse[face] = reverse[parent[face]] ^ (links[parent[face], face] >= 2)
    return reverse


def face_outward(surface: Surface) -> Surface:
    """Orient closed components outward, and cavities towards the cavity.

    A component inside another is a cavity if the two are given with opposite orientation; otherwise it is a solid of its own.
    """
    labels = surface.components()
    given = np.sign(signed_volumes(surface.vertices, surface.faces, labels))
    wanted = np.ones(len(given))
    parents = enclosing_components(surface.vertices, surface.faces, labels) if len(given) > 1 else np.full(1, -1)
    for child in np.argsort([_depth(parents, i) for i in range(len(parents))], kind="stable"):
        parent = parents[child]
        if parent >= 0 and given[child] * given[parent] < 0 and wanted[parent] > 0:
            wanted[child] = -1
    reverse = (given * wanted < 0)[labels]
    return surface.reversed(reverse) if reverse.any() else surface


def _depth(parents: np.ndarray, component: int) -> int:
    depth = 0
    while parents[component] >= 0:
        component, depth = parents[component], depth + 1
    return depth


def enclosing_components(vertices: np.ndarray, faces: np.ndarray, labels: np.ndarray) -> np.ndarray:
    """Return the smallest component that encloses each closed component ``(C,)``, or -1.

    Enclosed means that its box lies within the other's box, and that the winding number of the other is not zero at one of its
    vertices (the one deepest inside that box).
    """
    count = int(labels.max()) + 1
    low, high = np.full((count, 3), np.inf), np.full((count, 3), -np.inf)
    for corner in faces.T:
        np.minimum.at(low, labels, vertices[corner])
        np.maximum.at(high, labels, vertices[corner])
    size = np.prod(high - low, axis=1)
    parents = np.full(count, -1, dtype=np.int64)
    groups = np.split(np.argsort(labels, kind="stable"), np.cumsum(np.bincount(labels))[:-1])
    for child in range(count):
        holders = np.flatnonzero((low <= low[child]).all(1) & (high >= high[child]).all(1) & (size > size[child]))
        for holder in holders[np.argsort(size[holders], kind="stable")]:
            points = vertices[np.unique(faces[groups[child]])]
            margin = np.minimum(points - low[holder], high[holder] - points).min(1)
            probe = points[margin.argmax()][None]
            if abs(winding_numbers(probe, vertices[faces[groups[holder]]])[0]) > 0.5:
                parents[child] = holder
                break
    return parents


def winding_numbers(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Return the winding number ``(N,)`` of triangles ``(F, 3, 3)`` at points ``(N, 3)``: 1 inside an outward-oriented solid.

    Source: Jacobson et al. 2013, "Robust inside-outside segmentation using generalized winding numbers", eq. 5 (solid angle of
    Van Oosterom and Strackee 1983).
    """
    result = np.empty(len(points))
    step = max(1, _PAIRS_PER_CHUNK // max(len(triangles), 1))
    for at in range(0, len(points), step):
        a, b, c = (triangles[None, :, i] - points[at : at + step, None] for i in range(3))
        la, lb, lc = (np.linalg.norm(x, axis=-1) for x in (a, b, c))
        determinant = np.einsum("nfi,nfi->nf", a, np.cross(b, c))
        dot_ab, dot_bc, dot_ca = (np.einsum("nfi,nfi->nf", x, y) for x, y in ((a, b), (b, c), (c, a)))
        angle = np.arctan2(determinant, la * lb * lc + dot_ab * lc + dot_bc * la + dot_ca * lb)
        result[at : at + step] = angle.sum(1) / (2 * np.pi)
    return result
