"""A box from a silhouette with four straight sides."""

from __future__ import annotations

import numpy as np

from manitwin.models.generators.lift.silhouette import Silhouette
from manitwin.models.generators.lift.surface import Surface

DEPTH_SHARE = 0.4  # of the shorter side: nothing in one photo says how deep a box seen from the front is
_STEPS = 24
_INSET = 0.02


def make_box(silhouette: Silhouette, *, depth_share: float) -> Surface:
    """Make a box with the fitted rectangle as its front; its depth is ``depth_share`` of the shorter side.

    Sides continue the colours of the front's edge.
    """
    corners = _ordered(silhouette.corners)
    width = float(np.linalg.norm(corners[1] - corners[0]))
    height = float(np.linalg.norm(corners[3] - corners[0]))
    depth = depth_share * min(width, height)
    grid = np.linspace(0, 1, _STEPS + 1)
    u, v = np.meshgrid(grid, grid)
    flat_uv = np.column_stack([u.ravel(), v.ravel()])
    count = len(flat_uv)
    x, y = (flat_uv[:, 0] - 0.5) * width, (0.5 - flat_uv[:, 1]) * height
    front = np.column_stack([x, y, np.full(count, depth / 2)])
    back = np.column_stack([x, y, np.full(count, -depth / 2)])
    cell = np.arange(_STEPS)
    row, column = (g.ravel() for g in np.meshgrid(cell, cell, indexing="ij"))
    a = row * (_STEPS + 1) + column
    faces = np.concatenate(
        [np.column_stack([a, a + _STEPS + 1, a + 1]), np.column_stack([a + 1, a + _STEPS + 1, a + _STEPS + 2])]
    )
    rim = _rim()
    p, q = rim[:, 0], rim[:, 1]
    walls = np.concatenate([np.column_stack([q, p, p + count]), np.column_stack([q, p + count, q + count])])
    inset = _INSET + (1 - 2 * _INSET) * flat_uv
    pixels = corners[0] + inset[:, :1] * (corners[1] - corners[0]) + inset[:, 1:] * (corners[3] - corners[0])
    shape = silhouette.mask.shape
    uv = np.column_stack([(pixels[:, 0] + 0.5) / shape[1], 1 - (pixels[:, 1] + 0.5) / shape[0]])
    return Surface(
        np.concatenate([front, back]),
        np.concatenate([faces, faces[:, ::-1] + count, walls]),
        np.concatenate([uv, uv]),
        np.repeat([1.0, -1.0], count),
    )


def _ordered(corners: np.ndarray) -> np.ndarray:
    """Return the corners top left, top right, bottom right, bottom left of the upright rectangle nearest to the photo's."""
    centre = corners.mean(axis=0)
    angles = np.arctan2(corners[:, 1] - centre[1], corners[:, 0] - centre[0])
    ordered = corners[np.argsort(angles)]  # clockwise on the screen, from the left
    tops = [((ordered[k] + ordered[(k + 1) % 4]) / 2)[1] for k in range(4)]
    start = int(np.argmin(tops))
    return np.roll(ordered, -start, axis=0).astype(float)


def _rim() -> np.ndarray:
    """Return the front's outline edges, directed counter-clockwise on the screen."""
    side, last = _STEPS + 1, _STEPS * (_STEPS + 1)
    k = np.arange(_STEPS)
    left = np.column_stack([k * side, (k + 1) * side])
    bottom = np.column_stack([last + k, last + k + 1])
    right = np.column_stack([(k + 1) * side + _STEPS, k * side + _STEPS])
    top = np.column_stack([k + 1, k])
    return np.concatenate([left, bottom, right, top])
