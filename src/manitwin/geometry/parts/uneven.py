"""Find what makes one side of a thing unlike the other: the teeth of a comb, the case on a watch's strap, a camera's lens."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.scores import near
from manitwin.geometry.parts.shape import Shape, SurfacePoints

_TOOTHED = 1.1  # times the surface of the other side: slots between teeth make more of it, samples differ by 1.03
_OUTER = 0.2  # of half the width: what is nearer to the middle is on neither side
_LOOP = 0.4  # width by length from which a strap is closed and not laid straight
_THICKER = 1.5  # times the usual thickness of a strap: less is no case
_PIECES = 36  # along a strap, whose thickness is compared
_CASE = 0.05  # of its length: how near to the middle of a case its dial is
_LOPSIDED = 1.15  # times the reach to the other side: a lens stands out that much


def teeth(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the long side with the teeth of a comb; None where neither has any."""
    return _long_side(shape, points, 1.0)


def spine(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the long side away from the teeth of a comb; None where it has none."""
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
    return near(1 - out, 0.2) * (0.7 + 0.3 * near(along, 0.25))


def case(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the outside of the thickest part of a ring or strap, as a watch's case is; None where none is thicker."""
    found = _along_strap(shape, points.positions_m)
    return None if found is None else _outside(shape, points) * near(found, _CASE)


def strap(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the outside of a ring or strap by how far it is from its case; None where it has no case."""
    found = _along_strap(shape, points.positions_m)
    return None if found is None else _outside(shape, points) * near(1 - found / max(float(found.max()), 1e-9), 0.4)


def _along_strap(shape: Shape, positions_m: np.ndarray) -> np.ndarray | None:
    """Return how far along a strap places ``(N, 3)`` are from its thickest part, in its lengths or turns; None of an even one."""
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
    """Return how much places look away from the middle: of a closed strap from its hole, of a straight one from its back."""
    shortest = shape.obb_to_object[:3, int(shape.obb_extents_m.argmin())]
    offset = points.positions_m - shape.obb_to_object[:3, 3]
    if not _is_closed(shape):
        return np.abs(points.normals @ shortest)
    radial = offset - (offset @ shortest)[:, None] * shortest
    radial /= np.maximum(np.linalg.norm(radial, axis=1, keepdims=True), 1e-9)
    return np.clip(np.einsum("ij,ij->i", points.normals, radial), 0.0, 1.0)


def lens(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score what stands out from a box across one of its shorter axes, as a camera's lens does; None where nothing does."""
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
    return near(1 - out / farthest, 0.15) * (0.4 + 0.6 * np.clip(points.normals @ best[1], 0.0, 1.0))
