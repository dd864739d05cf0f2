"""Shading normals for parts without normals: smooth on smooth surfaces, sharp at creases."""

from __future__ import annotations

import numpy as np
import trimesh

from manitwin.formats.meshes.textures import make_part, material_of, normals_of, uv_of
from manitwin.geometry.repair.welding import weld_equal

_CREASE_COSINE = np.cos(np.radians(40.0))  # Blender's long-time default for "auto smooth" is 30 degrees, 3ds Max's 45
_MAX_PAIRS = 20_000_000
_ALIKE = 1e-6  # of unit vector components: the same written number, after a transform
_ALONG_COSINE = np.cos(np.radians(10.0))  # tolerates rounding of flat surfaces; no curved surface has a single normal


def with_normals(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the part with its own normals, or else with those of ``with_creased_normals``."""
    return part if normals_of(part) is not None else with_creased_normals(part)


def has_constant_normal(part: trimesh.Trimesh) -> bool:
    """Return whether all given normals of a part are one vector although some faces have another direction."""
    normals = normals_of(part)
    if normals is None or not len(part.faces) or np.ptp(normals, axis=0).max() > _ALIKE:
        return False
    triangles = part.vertices[part.faces]
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    along = np.abs(cross @ normals[0])  # either sign: a double-sided sheet has faces of both
    return bool((along < _ALONG_COSINE * np.linalg.norm(cross, axis=1)).any())


def without_normals(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the part without normals."""
    return make_part(part.vertices, part.faces, material=material_of(part), name=part.metadata["name"], uv=uv_of(part))


def with_creased_normals(part: trimesh.Trimesh) -> trimesh.Trimesh:
    """Return the part with a normal for each corner: the mean of the surrounding faces within 40 degrees of its own face.

    Means are weighted by the corner angles (Thürmer and Wüthrich 1998). Vertices at creases are split.
    """
    triangles = part.vertices[part.faces]
    cross = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    lengths = np.linalg.norm(cross, axis=1)
    normals = cross / np.where(lengths > 0, lengths, 1.0)[:, None]
    corner_normals = np.repeat(normals, 3, axis=0)
    weighted = corner_normals * _corner_angles(triangles).reshape(-1, 1)
    place = weld_equal(np.asarray(part.vertices), part.faces)[1].reshape(-1)
    sizes = np.bincount(place)
    if float((sizes.astype(float) ** 2).sum()) > _MAX_PAIRS:
        return part  # for a fan of thousands of faces, trimesh's mean over all of them has to suffice
    first, second = _pairs(place, sizes)
    alike = np.einsum("ij,ij->i", corner_normals[first], corner_normals[second]) > _CREASE_COSINE
    alike |= first == second
    sums = np.stack([np.bincount(first[alike], weighted[second[alike], k], minlength=len(place)) for k in range(3)], 1)
    norms = np.linalg.norm(sums, axis=1)
    shading = np.where(norms[:, None] > 1e-12, sums / np.where(norms > 1e-12, norms, 1.0)[:, None], (0.0, 0.0, 1.0))
    # sorting one integer for each corner, of vertex and normal in steps of 1/1000, is much faster than sorting rows
    steps = np.round(shading * 1000).astype(np.int64) + 1000
    keys = ((part.faces.reshape(-1) * 2001 + steps[:, 0]) * 2001 + steps[:, 1]) * 2001 + steps[:, 2]
    _, kept, inverse = np.unique(keys, return_index=True, return_inverse=True)
    old = part.faces.reshape(-1)[kept]
    uv = uv_of(part)
    return make_part(
        part.vertices[old],
        inverse.reshape(-1, 3),
        material=material_of(part),
        name=part.metadata["name"],
        uv=None if uv is None else uv[old],
        normals=shading[kept],
    )


def _corner_angles(triangles: np.ndarray) -> np.ndarray:
    """Return the angles ``(F, 3)`` rad at the corners of triangles ``(F, 3, 3)``."""
    angles = np.empty(triangles.shape[:2])
    for k in range(3):
        a, b = triangles[:, (k + 1) % 3] - triangles[:, k], triangles[:, (k + 2) % 3] - triangles[:, k]
        angles[:, k] = np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), np.einsum("ij,ij->i", a, b))
    return angles


def _pairs(place: np.ndarray, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return all ordered pairs of corners at the same position, including each corner with itself."""
    order = np.argsort(place, kind="stable")
    starts = np.cumsum(sizes) - sizes
    repeats = sizes[place[order]]
    first = np.repeat(order, repeats)
    within = np.arange(len(first)) - np.repeat(np.cumsum(repeats) - repeats, repeats)
    return first, order[np.repeat(starts[place[order]], repeats) + within]


def triangle_fans(sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cut polygons with ``sizes (P,)`` corners, listed consecutively, into fans about their first corners.

    Returns the corners' indices in that list ``(F, 3)`` and the polygon of every triangle ``(F,)``; polygons with fewer than
    three corners yield none.
    """
    inner = np.maximum(sizes - 2, 0)
    owner = np.repeat(np.arange(len(sizes)), inner)
    start = (np.cumsum(sizes) - sizes)[owner]
    step = np.arange(len(owner)) - (np.cumsum(inner) - inner)[owner]
    return np.stack([start, start + step + 1, start + step + 2], axis=1), owner
