"""Inflate a silhouette: the height over it solves a Poisson equation, so that a strip becomes a round bar.

laplace(h) = -4 inside, h = 0 on the outline; z = sqrt(h / 2). For a strip of half-width r that is the circle
z^2 + x^2 = r^2 (h = 2 (r^2 - x^2)). The family of Repousse (Joshi and Carr 2008) and Monster Mash (Dvoroznak et al. 2020).
"""

from __future__ import annotations

import cv2
import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from manitwin.models.generators.lift.planar_mesh import triangulate_mask
from manitwin.models.generators.lift.surface import Surface, from_manifold, to_manifold

_TARGET_CELLS = 2200
_SOLVER_SIDE_PX = 224


def inflate(mask: np.ndarray, *, depth_limit_px: float | None, rise: float, flat_back: bool) -> Surface:
    """Inflate ``mask`` (H, W) to a closed surface in its pixels.

    ``depth_limit_px`` flattens what would rise higher (thin flat things); ``flat_back`` makes a relief on the plane z = 0
    instead of a body mirrored about it. ``rise`` multiplies the height. Holes of the mask stay holes.
    """
    cell = float(np.clip(np.sqrt(mask.sum() / _TARGET_CELLS), 1.5, max(mask.shape) / 24))
    points, triangles, rim = triangulate_mask(mask, cell)
    height = np.sqrt(np.maximum(_sample(_solve(mask), points, mask.shape), 0) / 2)
    if depth_limit_px is not None:
        height = depth_limit_px * np.tanh(height / depth_limit_px)
    height *= rise
    height[rim] = 0
    height = np.maximum(height, 0.35 * cell)  # a rim of some thickness: front and back never share an edge
    back_depth = np.zeros(len(points)) if flat_back else height
    x, y = points[:, 0], -points[:, 1]
    count = len(points)
    vertices = np.concatenate([np.column_stack([x, y, height]), np.column_stack([x, y, -back_depth])])
    a, b = rim.T
    walls = np.concatenate([np.column_stack([b, a, a + count]), np.column_stack([b, a + count, b + count])])
    faces = np.concatenate([triangles, triangles[:, ::-1] + count, walls])
    uv = np.column_stack([(x + 0.5) / mask.shape[1], 1 - (0.5 - y) / mask.shape[0]])
    # a bridge thinner than the grid may have broken: the largest part is the object
    facing = np.repeat([1.0, -1.0], count)
    return from_manifold(to_manifold(Surface(vertices, faces, np.concatenate([uv, uv]), facing)))


def _solve(mask: np.ndarray) -> np.ndarray:
    """Return h on a coarse pixel grid, in units of mask pixels squared."""
    scale = min(1.0, _SOLVER_SIDE_PX / max(mask.shape))
    size = (max(2, round(mask.shape[1] * scale)), max(2, round(mask.shape[0] * scale)))
    small = cv2.resize(mask.astype(np.float32), size, interpolation=cv2.INTER_AREA) > 0.5
    small[[0, -1]] = small[:, [0, -1]] = False
    index = np.full(small.shape, -1)
    rows, columns = np.nonzero(small)
    index[rows, columns] = np.arange(len(rows))
    entries = []
    diagonal = np.full(len(rows), 4.0)
    for dy, dx in ((0, 1), (0, -1), (1, 0), (-1, 0)):
        neighbour = index[rows + dy, columns + dx]
        inside = neighbour >= 0
        diagonal += ~inside  # the outline lies half a pixel away: the value beyond it is the negative of this one
        entries.append((np.nonzero(inside)[0], neighbour[inside], np.full(inside.sum(), -1.0)))
    entries.append((np.arange(len(rows)), np.arange(len(rows)), diagonal))
    row, column, value = (np.concatenate(part) for part in zip(*entries, strict=True))
    laplacian = coo_matrix((value, (row, column)), shape=(len(rows), len(rows))).tocsr()
    solution = np.zeros(small.shape, np.float32)
    solution[rows, columns] = spsolve(laplacian, np.full(len(rows), 4.0))
    return solution / scale**2


def _sample(field: np.ndarray, points: np.ndarray, shape: tuple[int, ...]) -> np.ndarray:
    scale = np.array([field.shape[1] / shape[1], field.shape[0] / shape[0]])
    at = ((points + 0.5) * scale - 0.5).astype(np.float32)
    return cv2.remap(field, at[:, :1], at[:, 1:], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)[:, 0]
