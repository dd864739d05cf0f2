"""Sweeps of a section along a curve: handles, spouts, wires, blades of varying width."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from manifold3d import Manifold, Mesh

from manitwin.geometry.solids.shapes import CORNER_SIDES, SolidError, chords, require_solid


def tube(
    path_m: np.ndarray,
    radius_m: float | Sequence[float] | np.ndarray,
    *,
    flatten: float = 1.0,
    across: Sequence[float] = (0.0, 1.0, 0.0),
    sides: int | None = None,
) -> Manifold:
    """Return an elliptic section swept along a path ``(K, 3)`` in metres, with flat ends.

    ``radius_m`` is the half width of the section along ``across``, constant or per path point; ``flatten`` scales the half
    width in the other direction. The frame is transported without twist (Wang et al. 2008, "Computation of rotation minimizing
    frames"). Raises SolidError if the path has coincident points.
    """
    angles = np.linspace(0, 2 * np.pi, sides or chords(CORNER_SIDES), endpoint=False)
    return sweep(path_m, np.stack([np.cos(angles), flatten * np.sin(angles)], axis=1), radius_m, across=across)


def sweep(
    path_m: np.ndarray,
    section: np.ndarray,
    scale_m: float | Sequence[float] | np.ndarray,
    *,
    across: Sequence[float] = (0.0, 1.0, 0.0),
) -> Manifold:
    """Return a convex section ``(S, 2)``, counter-clockwise, swept along a path ``(K, 3)`` and closed at its ends.

    The section's first axis starts along ``across``, its second along tangent x first axis. ``scale_m`` is constant or per path
    point. Raises SolidError if the path has coincident points.
    """
    path = np.asarray(path_m, dtype=float)
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    if len(path) < 2 or not (steps > 0).all():
        raise SolidError("sweep: two points of its path are one; give a path of distinct points")
    scales = np.broadcast_to(np.asarray(scale_m, dtype=float), len(path))
    first, second = _frames(path, np.asarray(across, dtype=float))
    rings = path[:, None] + scales[:, None, None] * (
        section[None, :, :1] * first[:, None] + section[None, :, 1:] * second[:, None]
    )
    return loft(rings, path[[0, -1]])


def loft(rings_m: np.ndarray, ends_m: np.ndarray | None = None) -> Manifold:
    """Return the solid between rings ``(K, S, 3)`` in metres with corresponding points, closed at both ends by fans.

    The fans meet at ``ends_m (2, 3)``, by default the centres of the first and last ring. The rings must be counter-clockwise
    seen from the direction in which they advance.
    """
    count, around = rings_m.shape[:2]
    middles = rings_m[[0, -1]].mean(axis=1) if ends_m is None else ends_m
    vertices = np.concatenate([rings_m.reshape(-1, 3), middles])
    ring, side = np.meshgrid(np.arange(count - 1), np.arange(around), indexing="ij")
    a, b = ring * around + side, ring * around + (side + 1) % around
    walls = np.concatenate(
        [np.stack([a, b, b + around], -1).reshape(-1, 3), np.stack([a, b + around, a + around], -1).reshape(-1, 3)]
    )
    edge = np.arange(around)
    last = (count - 1) * around
    start = np.stack([np.full(around, count * around), (edge + 1) % around, edge], 1)
    end = np.stack([np.full(around, count * around + 1), last + edge, last + (edge + 1) % around], 1)
    faces = np.concatenate([walls, start, end])
    solid = Manifold(Mesh(vert_properties=vertices.astype(np.float32), tri_verts=faces.astype(np.uint32)))
    return require_solid(solid, "loft")


def arc(points: Sequence[Sequence[float]], *, samples: int = 24) -> np.ndarray:
    """Return a Catmull-Rom curve ``(samples, 3)`` through control points, with equal arc length between samples."""
    control = np.asarray(points, dtype=float)
    padded = np.concatenate([[2 * control[0] - control[1]], control, [2 * control[-1] - control[-2]]])
    pieces = []
    t = np.linspace(0, 1, 24, endpoint=False)[:, None]
    for p0, p1, p2, p3 in zip(padded[:-3], padded[1:-2], padded[2:-1], padded[3:], strict=True):
        pieces.append(
            0.5 * (2 * p1 + (p2 - p0) * t + (2 * p0 - 5 * p1 + 4 * p2 - p3) * t**2 + (3 * p1 - p0 - 3 * p2 + p3) * t**3)
        )
    curve = np.concatenate([*pieces, control[-1:]])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(curve, axis=0), axis=1))])
    wanted = np.linspace(0, along[-1], samples)
    return np.stack([np.interp(wanted, along, curve[:, axis]) for axis in range(3)], axis=1)


def _frames(path: np.ndarray, across: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the section's two axes at each point, transported by double reflection."""
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    start = across - (across @ tangents[0]) * tangents[0]
    if np.linalg.norm(start) < 1e-6:
        start = np.eye(3)[np.abs(tangents[0]).argmin()]
        start = start - (start @ tangents[0]) * tangents[0]
    first = [start / np.linalg.norm(start)]
    for here, there, tangent, following in zip(path[:-1], path[1:], tangents[:-1], tangents[1:], strict=True):
        step = there - here
        reflected = first[-1] - 2 * (step @ first[-1]) / (step @ step) * step
        tangent = tangent - 2 * (step @ tangent) / (step @ step) * step
        turn = following - tangent
        length = turn @ turn
        carried = reflected if length < 1e-18 else reflected - 2 * (turn @ reflected) / length * turn
        carried -= (carried @ following) * following
        first.append(carried / np.linalg.norm(carried))
    axes = np.array(first)
    return axes, np.cross(tangents, axes)
