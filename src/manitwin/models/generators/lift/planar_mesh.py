"""Triangulate a mask in the plane by marching squares, with its outline smooth below the grid's step."""

from __future__ import annotations

import cv2
import numpy as np

_SNAP = 0.12  # crossings nearer to a grid node than this share of a cell are moved off it: no sliver triangles
_AROUND = ((0, 0), (0, 1), (1, 1), (1, 0))  # a cell's corners (row, column), clockwise on the screen


def triangulate_mask(mask: np.ndarray, cell_px: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangulate ``mask`` (H, W) bool over a square grid of ``cell_px`` pixels.

    Returns points (P, 2) as pixel (x, y), y downward; triangles (T, 3), counter-clockwise on the screen; and the outline's
    edges (E, 2), directed as in the triangles. Where two parts touch at a corner only they are kept apart, so the outline
    never crosses itself.
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
    """Points, triangles and outline edges, cell by cell; points on shared nodes and edges are made once."""

    def __init__(self, field: np.ndarray, cell_px: float):
        self.field = field
        self.points: list[tuple[float, float]] = []
        self.triangles: list[tuple[int, int, int]] = []
        self.rim: list[tuple[int, int]] = []
        self._cell_px = cell_px
        self._known: dict[tuple[int, int, int], int] = {}

    def add_cell(self, row: int, column: int) -> None:
        corners = [(row + r, column + c) for r, c in _AROUND]
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
