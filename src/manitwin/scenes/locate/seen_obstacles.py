"""What is seen on a table and is no located twin, as boxes that nothing may run into."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy.spatial import cKDTree

from manitwin.geometry.poses import transform_points
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.world_frame import WorldFrame

CELL_M, MOST_BOXES = 0.02, 80
"""Columns of 2 cm, wider where there would be more boxes than that."""
AROUND_M, HIGHEST_M = 0.8, 0.6
_ABOVE_M, _LEAST_POINTS, _ALIKE_M, _BELOW_M, _OWN_M = 0.01, 4, 0.02, 0.01, 0.012
_JUMP_M, _JUMP_PX = 0.02, 3
"""Depths beside a jump are of neither side: they would make columns in the air."""


@dataclass(frozen=True)
class SeenBox:
    """A box along the world's axes, from ``low_m (3,)`` to ``high_m (3,)``."""

    low_m: np.ndarray
    high_m: np.ndarray


def seen_boxes(
    view: DepthView, located: np.ndarray, world: WorldFrame, surfaces: np.ndarray, noise_m: float
) -> list[SeenBox]:
    """Return boxes of what stands on the table and is not ``located (H, W) bool``, near to the things.

    ``surfaces (N, 3)`` are points of the located things in the world: what is within 12 mm of them is theirs. Each box is a
    column from the table, since what is below a seen top is hidden, up to the highest point; over a thing it begins 1 cm below
    the lowest point that is seen. Columns alike in height are one box.
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
    """Cells ``(first, last)`` along x and y, and the corners of what is seen in them."""

    x: tuple[int, int]
    y: tuple[int, int]
    low_m: np.ndarray
    high_m: np.ndarray

    def alike(self, other: _Column) -> bool:
        """Tell whether two columns begin and end at about the same heights."""
        return bool(abs(self.low_m[2] - other.low_m[2]) < _ALIKE_M and abs(self.high_m[2] - other.high_m[2]) < _ALIKE_M)

    def joined(self, other: _Column) -> _Column:
        """Return both as one, the ``other`` one being behind."""
        return _Column(
            (self.x[0], other.x[1]),
            (self.y[0], other.y[1]),
            np.minimum(self.low_m, other.low_m),
            np.maximum(self.high_m, other.high_m),
        )


def _boxes(points: np.ndarray, footprints: np.ndarray, table_m: float, cell_m: float) -> list[SeenBox]:
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
    return [SeenBox(each.low_m, each.high_m) for each in _merged(_runs(columns))]


def _runs(columns: list[_Column]) -> list[_Column]:
    """Return rows of columns side by side along x that are about as low and as high."""
    runs: list[_Column] = []
    for column in sorted(columns, key=lambda each: (each.y, each.x)):
        if runs and (last := runs[-1]).y == column.y and last.x[1] == column.x[0] - 1 and last.alike(column):
            runs[-1] = last.joined(column)
        else:
            runs.append(column)
    return runs


def _merged(runs: list[_Column]) -> list[_Column]:
    """Return the runs with those of neighbouring rows as one that begin and end at the same cells."""
    done: list[_Column] = []
    for run in runs:
        for number, last in enumerate(done):
            if last.x == run.x and last.y[1] == run.y[0] - 1 and last.alike(run):
                done[number] = last.joined(run)
                break
        else:
            done.append(run)
    return done
