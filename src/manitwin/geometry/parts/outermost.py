"""Features that extend farthest to one side: the outlet of a pump or trigger, a coat hanger's hook, wings and nose of an
aircraft.
"""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.scores import gaussian_falloff, relative_height
from manitwin.geometry.parts.shape import Shape, SurfacePoints

_OUTLETS_FROM = 0.85  # fraction of the height: outlets of pumps and triggers are above, triggers below
_SLICES = 16
_MIRRORED, _UNLIKE = 0.5, 0.1
"""Asymmetry under mirroring: largest ratio to the other axis, and least value."""
_LOPSIDED = 1.25  # how much farther a head extends on the side of its outlet; excludes round caps


def outlet(shape: Shape, points: SurfacePoints) -> np.ndarray | None:
    """Score the side of the top that extends farthest from the body's axis, such as a pump's outlet; None for a round top."""
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
    return gaussian_falloff(1 - relative_height(shape, points), 0.12) * reach**2


def crest(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score the farthest extent across the long axis, on the side with less material: the hook of a coat hanger."""
    order = np.argsort(-shape.obb_extents_m, kind="stable")
    across = shape.obb_to_object[:3, order[1]]
    reach = (shape.surface_m - shape.center_of_mass_m) @ across
    sign = 1.0 if reach.max() > -reach.min() else -1.0
    out = sign * (points.positions_m - shape.center_of_mass_m) @ across
    return gaussian_falloff(1 - out / max(float((sign * reach).max()), 1e-9), 0.12)


def bow(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score the centres of both ends along the direction of travel: the nose and tail of an aircraft."""
    along, across, length_m, width_m = _travel(shape)
    ahead, aside = _from_middle(shape, points.positions_m, along, across)
    return gaussian_falloff(1 - np.abs(ahead) / (length_m / 2), 0.12) * (
        0.3 + 0.7 * gaussian_falloff(aside / (width_m / 2), 0.15)
    )


def beam(shape: Shape, points: SurfacePoints) -> np.ndarray:
    """Score the farthest extents on both sides of the direction of travel: the tips of wings."""
    along, across, _, width_m = _travel(shape)
    _, aside = _from_middle(shape, points.positions_m, along, across)
    return gaussian_falloff(1 - np.abs(aside) / (width_m / 2), 0.12)


def _from_middle(
    shape: Shape, places_m: np.ndarray, along: np.ndarray, across: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    offset = places_m - shape.obb_to_object[:3, 3]
    return offset @ along, offset @ across


def _travel(shape: Shape) -> tuple[np.ndarray, np.ndarray, float, float]:
    """Return the horizontal directions ``(3,)`` along and across the direction of travel, and the extents (m) in both.

    The object travels along its longer side, unless it is mirror-symmetric along that side but not along the other, as an
    aircraft with wings wider than its length: then along the other.
    """
    level = np.argsort(np.abs(shape.obb_to_object[2, :3]), kind="stable")[:2]
    long, short = sorted(level, key=lambda axis: -float(shape.obb_extents_m[axis]))
    unlike = {axis: _mirror_asymmetry(shape, int(axis)) for axis in (long, short)}
    if unlike[short] > _UNLIKE and unlike[long] < _MIRRORED * unlike[short]:
        long, short = short, long
    axes, extents = shape.obb_to_object[:3, :3].T, np.maximum(shape.obb_extents_m, 1e-9)
    return axes[long], axes[short], float(extents[long]), float(extents[short])


def _mirror_asymmetry(shape: Shape, axis: int) -> float:
    """Return the distance of the surface from its mirror image along a box axis, in half extents (earth mover's distance)."""
    along = np.sort((shape.surface_m - shape.obb_to_object[:3, 3]) @ shape.obb_to_object[:3, axis])
    half = max(float(shape.obb_extents_m[axis]) / 2, 1e-9)
    return float(np.abs(along + along[::-1]).mean() / half)
