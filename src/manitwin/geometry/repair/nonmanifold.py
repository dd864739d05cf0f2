"""Non-manifold edges (more than two faces): fins are dropped, and crossing sheets are glued in pairs."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.repair.halfedges import (
    EdgeGroups,
    group_edges,
    halfedge_vertices,
    next_halfedge,
    previous_halfedge,
    twins_of_manifold_edges,
)
from manitwin.geometry.repair.surface import Surface

_FOLD_COSINE = -0.5  # an ear folded by more than 60 degrees from its neighbour's plane is a fin
_MOST_WEIGHED = 12  # faces at an edge up to which all pairings are compared; otherwise neighbours are paired
_SAME_WAY_PENALTY = 0.3  # prefers partners with opposite winding over slightly flatter ones without


def fins(vertices: np.ndarray, faces: np.ndarray, groups: EdgeGroups) -> np.ndarray:
    """Return which faces ``(F,)`` are fins, attached only at edges with other faces.

    A face on an edge with three or more faces and without an edge with exactly two is a fin. So is an ear (two open edges) that
    folds sharply from its only neighbour: a fin on the rim of a hole.
    """
    uses = groups.uses.reshape(-1, 3)
    crowded, open_edges = (uses > 2).any(1), (uses == 1).sum(1)
    result = crowded & (open_edges > 0) & ~(uses == 2).any(1)
    if not crowded.any():
        return result
    ears = np.flatnonzero((open_edges == 2) & ~crowded)
    hinge = 3 * ears + (uses[ears] == 2).argmax(1)
    pair = groups.starts[groups.group_of[hinge]]
    partner = np.where(groups.order[pair] == hinge, groups.order[pair + 1], groups.order[pair])
    inward = _apex_directions(vertices, faces, hinge), _apex_directions(vertices, faces, partner)
    result[ears] = np.einsum("ij,ij->i", *inward) > _FOLD_COSINE
    return result


def glue_faces(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Glue faces along their edges; return ``twin (3F,)`` and a mask ``(3F,)`` of half-edges on edges with more than two faces.

    If equally many faces traverse an edge in each direction, partners bound one wedge of material, which separates solids
    touching there. Otherwise the flattest pairs that do not cross are glued, and an odd face stays open.
    """
    groups = group_edges(faces, len(vertices))
    twin = twins_of_manifold_edges(groups)
    start, end = halfedge_vertices(faces)
    for group in np.flatnonzero(groups.counts > 2):
        members = groups.members(int(group))
        forward = start[members] < end[members]
        toward_apex = _apex_directions(vertices, faces, members)
        low, high = sorted((start[members[0]], end[members[0]]))
        angle = _angles(toward_apex, vertices[high] - vertices[low])
        if 2 * forward.sum() == len(members):
            pairs = _wedges_of_matter(angle, forward)
        else:
            pairs = _flattest_pairs(angle, toward_apex, forward)
        for i, j in pairs:
            twin[members[i]], twin[members[j]] = members[j], members[i]
    return twin, groups.uses > 2


def separate_coincident_edges(surface: Surface) -> tuple[Surface, int]:
    """Insert a vertex in the middle of glued edges with the same end vertices as another edge; return the surface and their
    number.

    Splitting vertices cannot separate two sheets that meet along one edge and are connected around both of its ends.
    """
    groups = group_edges(surface.faces, len(surface.vertices))
    done = 0
    for group in np.flatnonzero(groups.counts > 2):
        waiting = groups.members(int(group)).tolist()
        waiting = [h for h in waiting if h < surface.twin[h]]
        for halfedge in waiting[1:]:
            surface = _split_glued_edge(surface, halfedge)
            done += 1
    return surface, done


def _split_glued_edge(surface: Surface, halfedge: int) -> Surface:
    """Split the two faces at a glued half-edge; half-edges keep their numbers and start vertices."""
    faces, twin = surface.faces.copy(), surface.twin.copy()
    middle, count = len(surface.vertices), len(faces)
    pair = (halfedge, int(twin[halfedge]))
    parents = np.array([h // 3 for h in pair])
    start, end = halfedge_vertices(faces)
    position = 0.5 * (surface.vertices[start[halfedge]] + surface.vertices[end[halfedge]])
    added = np.array([(middle, end[h], start[previous_halfedge(np.array(h))]) for h in pair])
    twin = np.append(twin, np.full(6, -1))
    for at, h in enumerate(pair):
        behind, new = int(next_halfedge(np.array(h))), 3 * (count + at)
        faces[behind // 3, behind % 3] = middle
        far = int(twin[behind])
        twin[new + 1] = far
        if far >= 0:
            twin[far] = new + 1
        twin[new + 2], twin[behind] = behind, new + 2
    for h, new in ((pair[0], 3 * count + 3), (pair[1], 3 * count)):
        twin[h], twin[new] = new, h
    return Surface(
        np.append(surface.vertices, position[None], axis=0),
        np.concatenate((faces, added)),
        np.append(surface.source, surface.source[parents]),
        np.append(surface.flipped, surface.flipped[parents]),
        twin,
    )


def _apex_directions(vertices: np.ndarray, faces: np.ndarray, halfedges: np.ndarray) -> np.ndarray:
    """Return unit vectors from each half-edge towards its face's third corner, perpendicular to the edge."""
    start, end = halfedge_vertices(faces)
    origin = vertices[start[halfedges]]
    along = vertices[end[halfedges]] - origin
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), np.finfo(float).tiny)
    across = vertices[start[previous_halfedge(halfedges)]] - origin
    across -= np.einsum("ij,ij->i", across, along)[:, None] * along
    return across / np.maximum(np.linalg.norm(across, axis=1, keepdims=True), np.finfo(float).tiny)


def _angles(toward_apex: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the angles ``(N,)`` rad of faces around an edge, counter-clockwise about ``along``, relative to the first."""
    x = toward_apex[0]
    y = np.cross(along / max(float(np.linalg.norm(along)), np.finfo(float).tiny), x)
    return np.asarray(np.round(np.arctan2(toward_apex @ y, toward_apex @ x), 9) % (2 * np.pi))


def _wedges_of_matter(angle: np.ndarray, forward: np.ndarray) -> list[tuple[int, int]]:
    """Pair balanced faces at angles ``(N,)`` around an edge like brackets.

    Counter-clockwise about the edge, material begins at a face that runs backward and ends at one that runs forward (its
    normal, along x apex direction, points in the direction of turning).
    """
    order = np.lexsort((np.arange(len(angle)), forward, angle))
    balance = np.cumsum(np.where(forward[order], -1, 1))
    order = np.roll(order, -(int(balance.argmin()) + 1))
    pairs: list[tuple[int, int]] = []
    begun: list[int] = []
    for i in order:
        if forward[i]:
            pairs.append((begun.pop(), int(i)))
        else:
            begun.append(int(i))
    return pairs


def _flattest_pairs(angle: np.ndarray, toward_apex: np.ndarray, forward: np.ndarray) -> list[tuple[int, int]]:
    """Return non-crossing pairs of faces around an edge with the least total fold; one face of an odd number is left out.

    Crossing sheets would turn the volume that they bound inside out beyond the edge.
    """
    fold = toward_apex @ toward_apex.T + _SAME_WAY_PENALTY * (forward[:, None] == forward[None])
    order = np.lexsort((np.arange(len(angle)), angle)).tolist()
    if len(order) > _MOST_WEIGHED:
        return _neighbours(order, fold)
    known: dict[tuple[int, int], tuple[float, list[tuple[int, int]]]] = {}

    def best(first: int, end: int) -> tuple[float, list[tuple[int, int]]]:
        """Return the least total fold, and its pairs, of the faces at positions ``first`` to ``end`` of the order."""
        if end - first < 2:
            return 0.0, []
        if (first, end) not in known:
            odd = (end - first) % 2
            choices = [best(first + 1, end)] if odd else []
            for place in range(first + 1, end):
                within, behind = best(first + 1, place), best(place + 1, end)
                if (place - first - 1) % 2 and (end - place - 1) % 2:
                    continue  # would leave an odd number of faces on each side
                i, j = sorted((order[first], order[place]))
                choices.append((float(fold[i, j]) + within[0] + behind[0], [(i, j), *within[1], *behind[1]]))
            known[first, end] = min(choices)
        return known[first, end]

    return best(0, len(order))[1]


def _neighbours(order: list[int], fold: np.ndarray) -> list[tuple[int, int]]:
    """Pair faces with their neighbours around an edge, flattest first."""
    left = list(order)
    pairs: list[tuple[int, int]] = []
    while len(left) > 1:
        beside = [(min(a, b), max(a, b)) for a, b in zip(left, left[1:] + left[:1], strict=True)]
        pairs.append(min(beside, key=lambda pair: (float(fold[pair]), *pair)))
        left = [k for k in left if k not in pairs[-1]]
    return pairs
