"""Features that make one side of an object unlike the other: teeth of a comb, case on a watch strap, lens of a camera."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.scores import gaussian_falloff
from manitwin.geometry.parts.shape import Shape, SurfacePoints

_TOOTHED = 1.1  # times the samples of the other side: slots between teeth add surface, sampling noise is 1.03
_OUTER = 0.2  # of half the width: points nearer to the middle belong to neither side
_LOOP = 0.4  # ratio of width to length from which a strap is a closed loop
_THICKER = 1.5  # times the usual thickness of a strap, for a case
_PIECES = 36  # along a strap, for comparing thickness
_CASE = 0.05  # of its length: largest distance of the dial from the centre of the case
_LOPSIDED = 1.15  # times the reach to the other side, for a lens


def teeth(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the long side with the teeth of a comb; None if neither side has teeth."""
    return _long_side(shape, points, 1.0)


def spine(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the long side opposite the teeth of a comb; None if it has no teeth."""
    return _long_side(shape, points, -1.0)


def _long_side(shape: Shape, points: SurfacePoints, sign: float) -> np.ndarray | None:
    order = np.argsort(-shape.obb_extents_m, kind="stable")
    across, half = shape.obb_to_object[:3, order[1]], shape.obb_extents_m[order[1]] / 2
    reach = (shape.surface_m - shape.obb_to_object[:3, 3]) @ across / half
    one, other = np.count_nonzero(reach > _OUTER), np.count_nonzero(reach < -_OUTER)
    if max(one, other) < _TOOTHED * min(one, other):
        return None
    toward = sign * across * (1.0 if one > other else -1.0)
    out = (points.positions_m - shape.obb_to_object[:3, 3]) @ toward / half
    along = np.abs(shape.axis.along(points.positions_m) - 0.5)
    return gaussian_falloff(1 - out, 0.2) * (0.7 + 0.3 * gaussian_falloff(along, 0.25))


def case(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the outside of the thickest part of a ring or strap, such as a watch case; None if no part is thicker."""
    found = _along_strap(shape, points.positions_m)
    return None if found is None else _outside(shape, points) * gaussian_falloff(found, _CASE)


def strap(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the outside of a ring or strap by distance from its case; None if it has no case."""
    found = _along_strap(shape, points.positions_m)
    return (
        None
        if found is None
        else _outside(shape, points) * gaussian_falloff(1 - found / max(float(found.max()), 1e-9), 0.4)
    )


def _along_strap(shape: Shape, positions_m: np.ndarray) -> np.ndarray | None:
    """Return the distance of points ``(N, 3)`` along a strap from its thickest part, in lengths or turns; None for an even
    strap.
    """
    axes = shape.obb_to_object[:3, np.argsort(-shape.obb_extents_m, kind="stable")]
    surface, places = ((each - shape.obb_to_object[:3, 3]) @ axes for each in (shape.surface_m, positions_m))
    closed = _is_closed(shape)
    through = np.hypot(surface[:, 0], surface[:, 1]) if closed else surface[:, 2]
    at, wanted = (
        (np.arctan2(each[:, 1], each[:, 0]) / (2 * np.pi) if closed else each[:, 0] / shape.size_m)
        for each in (surface, places)
    )
    index = np.floor((at + 0.5) * _PIECES).astype(int).clip(0, _PIECES - 1)
    thickness = np.array([np.ptp(through[index == i]) if (index == i).any() else 0.0 for i in range(_PIECES)])
    if thickness.max() < _THICKER * np.median(thickness):
        return None
    thick = np.flatnonzero(thickness > (thickness.max() + np.median(thickness)) / 2)
    turns = 2 * np.pi * (thick + 0.5) / _PIECES
    middle = (
        np.arctan2(np.sin(turns).sum(), np.cos(turns).sum()) / (2 * np.pi) if closed else (thick.mean() + 0.5) / _PIECES
    )
    apart = np.abs(wanted + 0.5 - middle) % 1.0 if closed else np.abs(wanted + 0.5 - middle)
    return np.minimum(apart, 1 - apart) if closed else apart


def _is_closed(shape: Shape) -> bool:
    length, width = np.sort(shape.obb_extents_m)[:0:-1]
    return bool(width >= _LOOP * length)


def _outside(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score how much points face away from the centre: from the hole of a closed strap, or across a straight one."""
    shortest = shape.obb_to_object[:3, int(shape.obb_extents_m.argmin())]
    offset = points.positions_m - shape.obb_to_object[:3, 3]
    if not _is_closed(shape):
        return np.abs(points.normals @ shortest)
    radial = offset - (offset @ shortest)[:, None] * shortest
    radial /= np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-9)
    return np.clip(np.einsum("ij,ij->i", points.normals, radial), 0.0, 1.0)


def lens(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score a protrusion from a box along one of its shorter axes, such as a camera lens; None if there is none."""
    order = np.argsort(-shape.obb_extents_m, kind="stable")
    best: tuple[float, np.ndarray] | None = None
    for axis in shape.obb_to_object[:3, order[1:]].T:
        reach = (shape.surface_m - shape.center_of_mass_m) @ axis
        ratio = float(reach.max() / max(-reach.min(), 1e-9))
        direction = axis if ratio > 1 else -axis
        if best is None or max(ratio, 1 / ratio) > best[0]:
            best = max(ratio, 1 / ratio), direction
    if best is None or best[0] < _LOPSIDED:
        return None
    out = (points.positions_m - shape.center_of_mass_m) @ best[1]
    farthest = float(((shape.surface_m - shape.center_of_mass_m) @ best[1]).max())
    return gaussian_falloff(1 - out / farthest, 0.15) * (0.4 + 0.6 * np.clip(points.normals @ best[1], 0.0, 1.0))
