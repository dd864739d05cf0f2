"""Inflation of a silhouette: the height is the solution of a Poisson equation, so that a strip becomes a round bar.

laplace(h) = -4 inside, h = 0 on the outline; z = sqrt(h / 2). For a strip of half-width r this is the circle z^2 + x^2 = r^2
(h = 2 (r^2 - x^2)). The method follows Repousse (Joshi and Carr 2008) and Monster Mash (Dvoroznak et al. 2020).
"""

from __future__ import annotations

import cv2
import numpy as np
import trimesh
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

from manitwin.models.generators.lift.surface import LiftedSurface, from_manifold, to_manifold

_HALVINGS = 24
_TARGET_CELLS = 2200
_SOLVER_SIDE_PX = 224
_SNAP = 0.12  # minimum distance of crossings from grid nodes, as a share of a cell, which avoids sliver triangles
_CELL_CORNERS = ((0, 0), (0, 1), (1, 1), (1, 0))  # corners of a cell (row, column), clockwise on the screen


def inflate(
    mask: np.ndarray, *, depth_limit_px: float | None, rise: float, flat_back: bool, fullness: float = 1.0
) -> LiftedSurface:
    """Inflate ``mask`` (H, W) to a closed surface in its pixels.

    ``depth_limit_px`` limits the height smoothly (for thin flat objects); ``flat_back`` makes a relief on the plane z = 0
    instead of a body mirrored about it. ``fullness`` multiplies the height before the limit, ``rise`` after it. Holes of the
    mask remain holes.
    """
    cell = float(np.clip(np.sqrt(mask.sum() / _TARGET_CELLS), 1.5, max(mask.shape) / 24))
    points, triangles, rim = triangulate_mask(mask, cell)
    height = fullness * np.sqrt(np.maximum(_sample(_solve(mask), points, mask.shape), 0) / 2)
    if depth_limit_px is not None:
        height = depth_limit_px * np.tanh(height / depth_limit_px)
    height *= rise
    height[rim] = 0
    height = np.maximum(
        height, 0.35 * cell
    )  # minimum thickness at the rim, so that front and back do not share an edge
    back_depth = np.zeros(len(points)) if flat_back else height
    x, y = points[:, 0], -points[:, 1]
    count = len(points)
    vertices = np.concatenate([np.column_stack([x, y, height]), np.column_stack([x, y, -back_depth])])
    a, b = rim.T
    walls = np.concatenate([np.column_stack([b, a, a + count]), np.column_stack([b, a + count, b + count])])
    faces = np.concatenate([triangles, triangles[:, ::-1] + count, walls])
    uv = np.column_stack([(x + 0.5) / mask.shape[1], 1 - (0.5 - y) / mask.shape[0]])
    # a bridge thinner than the grid may have broken, so the largest part is kept
    front = trimesh.Trimesh(vertices[:count], triangles, process=False)
    facing = np.concatenate([np.asarray(front.vertex_normals)[:, 2], np.full(count, -1.0)])
    return from_manifold(to_manifold(LiftedSurface(vertices, faces, np.concatenate([uv, uv]), facing)))


def depth_limit_for_volume(mask: np.ndarray, volume_px: float, *, fullness: float, most_px: float) -> float:
    """Return the ``depth_limit_px`` at which the inflated ``mask`` (H, W) has a given volume; at most ``most_px``.

    The limit is not the mean thickness: a round object is half again as thick in its middle as in the mean.
    """
    field = _solve(mask)
    height = fullness * np.sqrt(np.maximum(field, 0) / 2)
    cell_px2 = mask.size / field.size
    low, high = 0.0, most_px
    for _ in range(_HALVINGS):
        limit = (low + high) / 2
        volume = 2 * cell_px2 * float((limit * np.tanh(height / limit)).sum())
        low, high = (limit, high) if volume < volume_px else (low, limit)
    return high


def round_fullness(mask: np.ndarray) -> float:
    """Return the ``fullness`` that makes the inflated ``mask`` (H, W) as thick as its largest circle is wide: 1.41 for a disc."""
    peak_px = float(np.sqrt(max(float(_solve(mask).max()), 1e-9) / 2))
    return float(cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5).max()) / peak_px


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
        diagonal += ~inside  # the outline is half a pixel away, so the value beyond it is the negative of this one
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


def triangulate_mask(mask: np.ndarray, cell_px: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangulate ``mask`` (H, W) bool over a square grid of ``cell_px`` pixels.

    Returns points (P, 2) as pixel (x, y), y downward; triangles (T, 3), counter-clockwise on the screen; and the outline's
    edges (E, 2), directed as in the triangles. Parts that touch only at a corner are separated, so the outline never crosses
    itself.
    """
    builder = _Builder(_node_field(mask, cell_px), cell_px)
    inside = builder.field > 0
    some = inside[:-1, :-1] | inside[:-1, 1:] | inside[1:, :-1] | inside[1:, 1:]
    for row, column in zip(*np.nonzero(some), strict=True):
        builder.add_cell(int(row), int(column))
    return np.array(builder.points), np.array(builder.triangles), np.array(builder.rim)


def _node_field(mask: np.ndarray, cell_px: float) -> np.ndarray:
    """Sample the smoothed mask at the grid's nodes: positive inside."""
    smooth = cv2.GaussianBlur(mask.astype(np.float32), (0, 0), max(0.8, 0.35 * cell_px)) - 0.5
    rows, columns = (int(np.ceil(side / cell_px)) + 1 for side in mask.shape)
    x, y = np.meshgrid(np.arange(columns) * cell_px, np.arange(rows) * cell_px)
    field = cv2.remap(
        smooth,
        x.astype(np.float32),
        y.astype(np.float32),
        cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=-0.5,
    )
    field[[0, -1]] = field[:, [0, -1]] = -0.5
    return np.where(field == 0, 1e-6, field)


class _Builder:
    """Builder of points, triangles and outline edges, cell by cell; points on shared nodes and edges are created once."""

    def __init__(self, field: np.ndarray, cell_px: float):
        self.field = field
        self.points: list[tuple[float, float]] = []
        self.triangles: list[tuple[int, int, int]] = []
        self.rim: list[tuple[int, int]] = []
        self._cell_px = cell_px
        self._known: dict[tuple[int, int, int], int] = {}

    def add_cell(self, row: int, column: int) -> None:
        corners = [(row + r, column + c) for r, c in _CELL_CORNERS]
        inside = [bool(self.field[corner] > 0) for corner in corners]
        if inside in ([True, False, True, False], [False, True, False, True]):
            for k in range(4):
                if inside[k]:
                    before, after = corners[k - 1], corners[(k + 1) % 4]
                    self._add_polygon(
                        [self._node(corners[k]), self._crossing(corners[k], after), self._crossing(before, corners[k])],
                        [False, True, True],
                    )
            return
        polygon, crossed = [], []
        for k in range(4):
            following = (k + 1) % 4
            if inside[k]:
                polygon.append(self._node(corners[k]))
                crossed.append(False)
            if inside[k] != inside[following]:
                polygon.append(self._crossing(corners[k], corners[following]))
                crossed.append(True)
        self._add_polygon(polygon, crossed)

    def _add_polygon(self, polygon: list[int], crossed: list[bool]) -> None:
        """Add a convex polygon given clockwise; an edge between two crossings is part of the outline."""
        self.triangles += [(polygon[0], polygon[k + 1], polygon[k]) for k in range(1, len(polygon) - 1)]
        for k in range(len(polygon)):
            following = (k + 1) % len(polygon)
            if crossed[k] and crossed[following]:
                self.rim.append((polygon[following], polygon[k]))

    def _node(self, at: tuple[int, int]) -> int:
        return self._point((*at, 0), (at[1], at[0]))

    def _crossing(self, a: tuple[int, int], b: tuple[int, int]) -> int:
        first, second = min(a, b), max(a, b)
        low, high = float(self.field[first]), float(self.field[second])
        share = min(max(low / (low - high), _SNAP), 1 - _SNAP)
        along_row = first[0] == second[0]
        at = (first[1] + share, first[0]) if along_row else (first[1], first[0] + share)
        return self._point((*first, 1 if along_row else 2), at)

    def _point(self, key: tuple[int, int, int], at: tuple[float, float]) -> int:
        if key not in self._known:
            self._known[key] = len(self.points)
            self.points.append((at[0] * self._cell_px, at[1] * self._cell_px))
        return self._known[key]
