"""Find what reaches out farthest to one side: the outlet of a pump or trigger, the hook of a coat hanger."""

from __future__ import annotations

import numpy as np

from manitwin.geometry.parts.scores import near, share_of_height
from manitwin.geometry.parts.shape import Shape, SurfacePoints

_OUTLETS_FROM = 0.85  # of the height: above it are the outlets of pumps and triggers, and no trigger
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
