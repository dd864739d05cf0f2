"""Find what reaches out farthest to one side: the outlet of a pump or trigger, the hook of a coat hanger, wings and a nose."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.scores import near, share_of_height
from manitwin.geometry.parts.shape import Shape, SurfacePoints

_OUTLETS_FROM = 0.85  # of the height: above it are the outlets of pumps and triggers, and no trigger
_SLICES = 16
_MIRRORED, _UNLIKE = 0.5, 0.1
"""The share of the surface that is elsewhere in the mirror: relative to the other axis, and least."""
_LOPSIDED = 1.25  # how much farther a head reaches out to the side of its outlet than to the other: round caps do not


def outlet(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the side of the top that reaches out farthest from the body's axis, as a pump's outlet does; None of a round top."""
    share = (shape.surface_m[:, 2] - shape.bounds_m[0, 2]) / max(float(np.ptp(shape.bounds_m[:, 2])), 1e-9)
    head = shape.surface_m[share > _OUTLETS_FROM, :2] - shape.body.axis_xy_m
    if not len(head):
        return None
    radius = np.hypot(*head.T)
    out = head[int(radius.argmax())] / max(float(radius.max()), 1e-9)
    behind = float((head @ -out).max())
    if radius.max() < _LOPSIDED * behind:
        return None
    reach = np.clip((points.positions_m[:, :2] - shape.body.axis_xy_m) @ out / radius.max(), 0, 1)
    return near(1 - share_of_height(shape, points), 0.12) * reach**2


def crest(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score what reaches out farthest across the long axis, on the side where less matter is: a coat hanger's hook."""
    order = np.argsort(-shape.obb_extents_m, kind="stable")
    across = shape.obb_to_object[:3, order[1]]
    reach = (shape.surface_m - shape.center_of_mass_m) @ across
    sign = 1.0 if reach.max() > -reach.min() else -1.0
    out = sign * (points.positions_m - shape.center_of_mass_m) @ across
    return near(1 - out / max(float((sign * reach).max()), 1e-9), 0.12)


def bow(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score either end of the way in which a thing travels, in its middle: the nose and the tail of an aircraft."""
    along, across, length_m, width_m = _travel(shape)
    ahead, aside = _from_middle(shape, points.positions_m, along, across)
    return near(1 - np.abs(ahead) / (length_m / 2), 0.12) * (0.3 + 0.7 * near(aside / (width_m / 2), 0.15))


def beam(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score what reaches out farthest to either side of the way in which a thing travels: the tips of wings."""
    along, across, _, width_m = _travel(shape)
    _, aside = _from_middle(shape, points.positions_m, along, across)
    return near(1 - np.abs(aside) / (width_m / 2), 0.12)


def _from_middle(
    shape: Shape, places_m: np.ndarray, along: np.ndarray, across: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    offset = places_m - shape.obb_to_object[:3, 3]
    return offset @ along, offset @ across


def _travel(shape: Shape) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Return the level directions ``(3,)`` along and across the way in which a thing travels, and its extents (m) in both.

    That is along its longer side; but what is mirrored about its middle along that side, and along the other is not, travels
    along the other: an aircraft whose wings are wider than it is long.
    """
    level = np.argsort(np.abs(shape.obb_to_object[2, :3]), kind="stable")[:2]
    long, short = sorted(level, key=lambda axis: -float(shape.obb_extents_m[axis]))
    unlike = {axis: _unlike_its_mirror_image(shape, int(axis)) for axis in (long, short)}
    if unlike[short] > _UNLIKE and unlike[long] < _MIRRORED * unlike[short]:
        long, short = short, long
    axes, extents = shape.obb_to_object[:3, :3].T, np.maximum(shape.obb_extents_m, 1e-9)
    return axes[long], axes[short], float(extents[long]), float(extents[short])


def _unlike_its_mirror_image(shape: Shape, axis: int) -> float:
    """Return how far the surface is from its mirror image along a box's axis, in halves of the box (earth mover)."""
    along = np.sort((shape.surface_m - shape.obb_to_object[:3, 3]) @ shape.obb_to_object[:3, axis])
    half = max(float(shape.obb_extents_m[axis]) / 2, 1e-9)
    return float(np.abs(along + along[::-1]).mean() / half)
