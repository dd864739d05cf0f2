"""The striking face of a hammer: the blunt end of its head, on either side of the handle's line."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.shape import Shape, SurfacePoints

_BALANCED_HEAD = 0.6  # ratio of the shorter to the longer reach of a head from which either side may strike
_HEAD_END = 0.8  # fraction of a head's reach; beyond is its end
# ratio of the shorter end's extent along the handle to the longer end's, above which the longer is a claw
_TALLER = 1.3
_BEYOND_HANDLE = 1.5  # fraction of the handle's half width; farther points belong to the head


def striking_face(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score the outermost points of the head across the handle, where a hammer strikes.

    If the head reaches about equally far to both sides, it strikes with the blunt end, which has the larger section; otherwise
    with the end that reaches farther, as an axe, unless that tapers to a claw. Distances are from the handle's own line: a long
    claw rotates the box, so that the blunt end would appear shorter or outside the head.
    """
    along = shape.axis.along(shape.surface_m)
    line, direction = handle_line(shape), handle_direction(shape)
    across = shape.axis.across[0] - (shape.axis.across[0] @ direction) * direction
    across /= np.linalg.norm(across)
    frame = np.stack([across, direction, np.cross(across, direction)])
    surface, here = (shape.surface_m - line) @ frame.T, (points.positions_m - line) @ frame.T
    half_m = float(np.quantile(np.abs(surface[along > 0.5, 0]), 0.95))
    sides = [surface[(along < 0.5) & (side * surface[:, 0] > _BEYOND_HANDLE * half_m)] for side in (-1, 1)]
    reach = np.array([np.abs(side[:, 0]).max(initial=0.0) for side in sides])
    facing = 0.7 + 0.3 * np.maximum(points.normals @ across * np.sign(here[:, 0]), 0)
    facing *= shape.axis.along(points.positions_m) < 0.5
    blunt = _blunt_side(sides, reach)
    if blunt is None:
        return (here[:, 0] / max(float(reach.max()), half_m)) ** 2 * facing
    mine = (here[:, 0] > 0) == (blunt == 1)
    scores = np.minimum(np.abs(here[:, 0]) / reach[np.where(here[:, 0] > 0, 1, 0)], 1) ** 2 * facing
    return np.where(mine, scores, 0.5 * scores)


def _blunt_side(sides: list[np.ndarray], reach: np.ndarray) -> int | None:
    """Return which of two sides ``(N, 3)`` of a head is blunt; None if one is missing or the longer one may strike."""
    if not reach.min():
        return None
    ends = [side[np.abs(side[:, 0]) > _HEAD_END * far] for side, far in zip(sides, reach, strict=True)]
    extents = np.array([np.ptp(end[:, 1:], axis=0) for end in ends])
    if reach.min() >= _BALANCED_HEAD * reach.max():
        return int(extents.prod(1).argmax())
    shorter = int(reach.argmin())
    return shorter if extents[shorter, 0] > _TALLER * extents[1 - shorter, 0] else None


def handle_line(shape: Shape) -> np.ndarray:
    """Return the centre of the handle half of an elongated object, ``(3,)``."""
    handle = shape.surface_m[shape.axis.along(shape.surface_m) > 0.5]
    return (handle.min(0) + handle.max(0)) / 2 if len(handle) else shape.obb_to_object[:3, 3]


def handle_direction(shape: Shape) -> np.ndarray:
    """Return the direction ``(3,)`` in which the handle half of an elongated object is longest, away from the head."""
    handle = shape.surface_m[shape.axis.along(shape.surface_m) > 0.5]
    longest = np.linalg.eigh(np.cov(handle.T))[1][:, 2] if len(handle) > 2 else shape.axis.direction
    return np.asarray(longest * np.sign(longest @ shape.axis.direction))
