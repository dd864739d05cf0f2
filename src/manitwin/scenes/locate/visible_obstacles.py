"""Visible obstacles on a table that are no located twins, as boxes for collision checks."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from manitwin.geometry.poses import transform_points
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.world_frame import WorldFrame

CELL_M, MOST_BOXES = 0.02, 80
"""Columns of 2 cm, wider if there would be more boxes than this."""
AROUND_M, HIGHEST_M = 0.8, 0.6
_ABOVE_M, _LEAST_POINTS, _ALIKE_M, _BELOW_M, _OWN_M = 0.01, 4, 0.02, 0.01, 0.012
_JUMP_M, _JUMP_PX = 0.02, 3
"""Depths beside a jump belong to neither side and would create columns in the air."""


@dataclass(frozen=True)
class ObstacleBox:
    """An axis-aligned box in the world, from ``low_m (3,)`` to ``high_m (3,)``."""

    low_m: np.ndarray
    high_m: np.ndarray


def obstacle_boxes(
    view: DepthView, located: np.ndarray, world: WorldFrame, surfaces: np.ndarray, noise_m: float
) -> list[ObstacleBox]:
    """Return boxes of visible surfaces above the table that are not ``located (H, W) bool``, near the objects.

    ``surfaces (N, 3)`` are points of the located objects in the world: points within 12 mm of them belong to these. Each box is
    a column from the table up to the highest point, since the space below a visible top is hidden; above a located object, it
    begins 1 cm below the lowest visible point. Columns of similar height are merged.
    """
    pixels = np.flatnonzero(known_depth(view) & ~located & ~_beside_jumps(view))
    points = transform_points(world.camera_to_world, view.points(pixels))
    above = points[:, 2] - world.table_m
    near = np.linalg.norm(points[:, :2] - surfaces[:, :2].mean(0), axis=1) < AROUND_M
    points = points[near & (above > _ABOVE_M + 2 * noise_m) & (above < HIGHEST_M)]
    points = points[cKDTree(surfaces).query(points)[0] > _OWN_M] if len(points) else points
    cell_m = CELL_M
    while True:
        boxes = _boxes(points, surfaces[:, :2], world.table_m, cell_m)
        if len(boxes) <= MOST_BOXES:
            return boxes
        cell_m *= 1.5


def _beside_jumps(view: DepthView) -> np.ndarray:
    depth = np.where(known_depth(view), view.depth_m, 0.0)
    kernel = np.ones((_JUMP_PX, _JUMP_PX), np.uint8)
    return np.asarray(cv2.dilate(depth, kernel) - cv2.erode(depth, kernel) > _JUMP_M)


@dataclass(frozen=True)
class _Column:
    """Cell ranges ``(first, last)`` along x and y, and the corners of the points in them."""

    x: tuple[int, int]
    y: tuple[int, int]
    low_m: np.ndarray
    high_m: np.ndarray

    def is_similar(self, other: _Column) -> bool:
        """Return whether two columns begin and end at similar heights."""
        return bool(abs(self.low_m[2] - other.low_m[2]) < _ALIKE_M and abs(self.high_m[2] - other.high_m[2]) < _ALIKE_M)

    def joined(self, other: _Column) -> _Column:
        """Return the union with an ``other`` column that follows."""
        return _Column(
            (self.x[0], other.x[1]),
            (self.y[0], other.y[1]),
            np.minimum(self.low_m, other.low_m),
            np.maximum(self.high_m, other.high_m),
        )


def _boxes(points: np.ndarray, footprints: np.ndarray, table_m: float, cell_m: float) -> list[ObstacleBox]:
    if not len(points):
        return []
    cells = np.floor(points[:, :2] / cell_m).astype(int)
    places, of, counts = np.unique(cells, axis=0, return_inverse=True, return_counts=True)
    high, low = np.full((len(places), 3), -np.inf), np.full((len(places), 3), np.inf)
    np.maximum.at(high, of.ravel(), points)
    np.minimum.at(low, of.ravel(), points)
    taken = {(int(x), int(y)) for x, y in np.unique(np.floor(footprints / cell_m).astype(int), axis=0)}
    columns = []
    for (x, y), first, last, count in zip(places.tolist(), low, high, counts, strict=True):
        if count >= _LEAST_POINTS:
            first[2] = max(table_m, first[2] - _BELOW_M) if (x, y) in taken else table_m
            columns.append(_Column((x, x), (y, y), first, last))
    return [ObstacleBox(each.low_m, each.high_m) for each in _merged(_runs(columns))]


def _runs(columns: list[_Column]) -> list[_Column]:
    """Return runs of adjacent columns along x with similar heights."""
    runs: list[_Column] = []
    for column in sorted(columns, key=lambda each: (each.y, each.x)):
        if runs and (last := runs[-1]).y == column.y and last.x[1] == column.x[0] - 1 and last.is_similar(column):
            runs[-1] = last.joined(column)
        else:
            runs.append(column)
    return runs


def _merged(runs: list[_Column]) -> list[_Column]:
    """Merge runs of neighbouring rows with the same cell range and similar heights."""
    done: list[_Column] = []
    for run in runs:
        for number, last in enumerate(done):
            if last.x == run.x and last.y[1] == run.y[0] - 1 and last.is_similar(run):
                done[number] = last.joined(run)
                break
        else:
            done.append(run)
    return done
