"""Meshes of spheres, cylinders, capsules and ellipsoids, in metres, centred on the origin, with their axis along Z."""

from __future__ import annotations

import numpy as np
import trimesh

_END_COSINE, _AT_POLE = 0.9, 1e-9
_SECTIONS = 48  # a cylinder's volume is 0.3 % below the exact value


def sphere(radius_m: float) -> trimesh.Trimesh:
    """Return a sphere about the origin."""
    return trimesh.creation.icosphere(subdivisions=3, radius=radius_m)


def cylinder(radius_m: float, length_m: float) -> trimesh.Trimesh:
    """Return a cylinder along Z about the origin."""
    return trimesh.creation.cylinder(radius=radius_m, height=length_m, sections=_SECTIONS)


def capsule(radius_m: float, length_m: float) -> trimesh.Trimesh:
    """Return a capsule along Z about the origin; ``length_m`` is the length of the cylinder without the caps."""
    mesh = trimesh.creation.capsule(height=length_m, radius=radius_m, count=[_SECTIONS, 24])
    mesh.apply_translation(-mesh.bounds.mean(0))
    return mesh


def ellipsoid(radii_m: np.ndarray) -> trimesh.Trimesh:
    """Return an ellipsoid about the origin with semi-axes ``radii_m (3,)``."""
    mesh = sphere(1.0)
    mesh.apply_scale(np.asarray(radii_m, float))
    return mesh


def unwrap_primitive(solid: trimesh.Trimesh, kind: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return vertices ``(V, 3)``, faces ``(F, 3)`` and texture coordinates ``(V, 2)``, origin at the lower left, of a
    primitive.

    - ``cylinder``: the picture wraps around the side as in Gazebo, clockwise from +Y seen from above, with its lower edge at
      the top; each end shows the whole picture.
    - ``sphere``, ``ellipsoid``, ``capsule``: longitude and latitude, as a globe shows a map.
    - any other kind: each side of the bounding box shows the whole picture, upright.
    """
    triangles = np.asarray(solid.vertices, float)[solid.faces]
    corners = triangles - solid.bounds.mean(0)
    half = np.maximum(np.ptp(solid.bounds, axis=0) / 2, np.finfo(float).tiny)
    if kind == "cylinder":
        around = _turns(np.arctan2(corners[..., 0], corners[..., 1]))
        side = np.stack([around, 0.5 - 0.5 * corners[..., 2] / half[2]], axis=-1)
        is_end = np.abs(solid.face_normals[:, 2]) > _END_COSINE
        uv = np.where(is_end[:, None, None], _on_each_side(corners, solid.face_normals, half), side)
    elif kind in ("sphere", "ellipsoid", "capsule"):
        ways = corners / half
        ways /= np.maximum(np.linalg.norm(ways, axis=-1, keepdims=True), np.finfo(float).tiny)
        at_pole = np.abs(ways[..., 2]) > 1 - _AT_POLE
        around = _turns(np.arctan2(ways[..., 1], ways[..., 0]), at_pole)
        uv = np.stack([around, 0.5 + np.arcsin(np.clip(ways[..., 2], -1, 1)) / np.pi], axis=-1)
    else:
        uv = _on_each_side(corners, solid.face_normals, half)
    rows = np.column_stack([np.asarray(solid.faces).reshape(-1), np.round(uv.reshape(-1, 2), 9)])
    _, kept, inverse = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    return triangles.reshape(-1, 3)[kept], inverse.reshape(-1, 3), uv.reshape(-1, 2)[kept]


def _turns(angle_rad: np.ndarray, free: np.ndarray | None = None) -> np.ndarray:
    """Convert angles ``(F, 3)`` to turns, with the corners of each triangle on one side of the seam.

    Corners marked ``free`` lie at a pole, where the angle is undefined; they take the mean of the other corners.
    """
    turns = angle_rad / (2 * np.pi) % 1.0
    held = np.ones_like(turns, dtype=bool) if free is None else ~free
    low, high = np.where(held, turns, 1.0).min(1), np.where(held, turns, 0.0).max(1)
    turns = turns + ((high - low > 0.5)[:, None] & (turns < 0.5))
    mean = (turns * held).sum(1) / np.maximum(held.sum(1), 1)
    return np.where(held, turns, mean[:, None])


def _on_each_side(corners: np.ndarray, normals: np.ndarray, half: np.ndarray) -> np.ndarray:
    """Return coordinates ``(F, 3, 2)`` of corners ``(F, 3, 3)`` in the picture on the box side that each face points to."""
    axis = np.abs(normals).argmax(1)
    outward = np.where(np.take_along_axis(normals, axis[:, None], 1)[:, 0] < 0, -1.0, 1.0)
    x, y, z = (corners[..., k] / half[k] for k in range(3))
    sign, flat, along_x = outward[:, None], (axis == 2)[:, None], (axis == 0)[:, None]
    right = np.where(flat, x, np.where(along_x, sign * y, -sign * x))
    up = np.where(flat, sign * y, z)
    return np.asarray(0.5 + 0.5 * np.stack([right, up], axis=-1))
