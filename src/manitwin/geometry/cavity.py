"""Open cavities of containers: opening, depth and capacity, measured on a height field of parallel rays."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
import trimesh
from trimesh.ray.ray_pyembree import RayMeshIntersector

from manitwin.geometry.hulls.reduction import hull_volume
from manitwin.geometry.mesh_cache import cached_on_mesh
from manitwin.geometry.poses import rotation_between

# Measured on 25 real meshes: the shallowest vessel (a plate) has a depth of 4.4 % of the longest side, and the smallest (a
# shoe) holds 5.4 % of its convex hull. The largest hollow of an object that is not a vessel holds 3.9 % (a can's lid), and
# sideways 5.2 % (a clamp's jaws).
_MIN_DEPTH_SHARE = 0.04
_MIN_VOLUME_SHARE = 0.05
_MIN_VOLUME_SHARE_SIDEWAYS = 0.10
# fraction of the outline's rectangle: the drain of a pot, but not the hole of a ring or a nut
_LARGEST_DRAIN_SHARE = 0.02
_CROSS = np.array([[0, 1, 0], [1, 1, 1], [0, 1, 0]], dtype=np.uint8)  # a cell and its four neighbours


@dataclass(frozen=True)
class Opening:
    """The largest cavity that would hold water, in the object frame.

    ``axis (3,)`` points out of it, ``center_m (3,)`` is the centre of its rim, ``rim_radius_m`` the radius of a circle with the
    rim's area, ``volume_m3`` its capacity to the brim, ``depth_m`` the distance from the brim to its deepest point.
    """

    axis: np.ndarray
    center_m: np.ndarray
    rim_radius_m: float
    volume_m3: float
    depth_m: float


def cavity_volume(
    mesh: trimesh.Trimesh, up: np.ndarray, hull: trimesh.Trimesh | None = None, cells: int = 120
) -> float:
    """Return the volume (m3) between the convex hull and the first surface met along ``-up (3,)``.

    ``hull`` is the mesh's convex hull if already known. The grid has ``cells`` along the longer side.
    """
    hull = mesh.convex_hull if hull is None else hull
    grid = _make_ray_grid(hull, np.asarray(up, dtype=float), cells)
    return grid.volume_between(grid.heights(RayMeshIntersector(mesh)), grid.heights(RayMeshIntersector(hull)))


def find_opening(mesh: trimesh.Trimesh, cells: int = 64) -> Opening | None:
    """Return the largest opening of a mesh; None if nothing would hold water.

    The directions tried are the mesh's own axes and its principal axes. An opening is a basin of the height field seen from
    outside, with a depth of at least 4 % of the longest side and a volume of at least 5 % of the convex hull's, or 10 % if it
    does not open upward. Walls thinner than a grid cell are represented by their edges. A drain in the floor (at most 2 % of
    the outline's rectangle) counts as closed. The result is cached with the mesh.

    Source: filling of depressions as in priority flood (Barnes, Lehman and Mulla 2014).
    """
    return cached_on_mesh(mesh, f"opening {cells}", lambda: _found_opening(mesh, cells))


def _found_opening(mesh: trimesh.Trimesh, cells: int) -> Opening | None:
    if hull_volume(np.asarray(mesh.vertices)) == 0:
        return None
    hull = mesh.convex_hull
    mesh_rays, hull_rays = RayMeshIntersector(mesh), RayMeshIntersector(hull)
    best: Opening | None = None
    for axis in _candidate_axes(hull):
        least_m3 = hull.volume * (_MIN_VOLUME_SHARE if axis[2] > 0.99 else _MIN_VOLUME_SHARE_SIDEWAYS)
        if best is not None:
            least_m3 = max(least_m3, best.volume_m3 * 1.02)
        grid = _make_ray_grid(hull, axis, cells)
        heights = grid.heights(mesh_rays)
        if grid.volume_between(heights, grid.heights(hull_rays)) < least_m3:
            continue
        # A wall thinner than a cell may fall between two rays. Raising cells to its edges closes it, but it then fills whole
        # cells.
        basins = [_basin(grid, grid.close_drains(each)) for each in (heights, grid.raise_to_edges(heights, mesh))]
        opening = max((b for b in basins if b is not None), key=lambda basin: basin.volume_m3, default=None)
        if (
            opening is not None
            and opening.volume_m3 >= least_m3
            and opening.depth_m >= _MIN_DEPTH_SHARE * mesh.extents.max()
        ):
            best = opening
    return best


@dataclass(frozen=True)
class _RayGrid:
    """Parallel rays along ``-up`` from a square grid: ``origins (R, 3)`` above the mesh, in rows of ``shape``."""

    origins: np.ndarray
    shape: tuple[int, int]
    up: np.ndarray
    cell_m: float

    def heights(self, surface: RayMeshIntersector) -> np.ndarray:
        """Return the height along ``up`` of the first surface hit, in the grid's shape; NaN for no hit."""
        directions = np.repeat(-self.up[None], len(self.origins), axis=0)
        _, rays, locations = surface.intersects_id(self.origins, directions, multiple_hits=False, return_locations=True)
        heights = np.full(len(self.origins), np.nan)
        if len(rays):
            heights[rays] = locations @ self.up
        return heights.reshape(self.shape)

    def raise_to_edges(self, heights: np.ndarray, mesh: trimesh.Trimesh) -> np.ndarray:
        """Return heights raised to the mesh's edges in each cell, so that a rim counts however thin its wall is."""
        rotation = rotation_between(self.up, np.array([0.0, 0, 1]))
        ends = (mesh.vertices @ rotation.T)[mesh.edges_unique]
        spans = np.linalg.norm(np.diff(ends[:, :, :2], axis=1)[:, 0], axis=1)
        counts = np.ceil(2 * spans / self.cell_m).astype(int) + 1
        edge = np.repeat(np.arange(len(ends)), counts)
        step = np.arange(len(edge)) - np.repeat(np.cumsum(counts) - counts, counts)
        share = (step / np.maximum(counts[edge] - 1, 1))[:, None]
        points = ends[edge, 0] * (1 - share) + ends[edge, 1] * share
        first = (self.origins[0] @ rotation.T)[:2]
        cell = np.clip(np.round((points[:, :2] - first) / self.cell_m).astype(int), 0, np.array(self.shape) - 1)
        raised = np.where(np.isnan(heights), -np.inf, heights)
        np.maximum.at(raised, (cell[:, 0], cell[:, 1]), points[:, 2])
        return np.where(np.isinf(raised), np.nan, raised)

    def close_drains(self, heights: np.ndarray) -> np.ndarray:
        """Return heights with small inner holes filled to the level of their border, e.g. the drain of a flower pot."""
        count, labels, stats, _ = cv2.connectedComponentsWithStats(np.isnan(heights).astype(np.uint8), connectivity=4)
        closed = heights.copy()
        for number in range(1, count):
            left, top, wide, high, area = stats[number]
            inner = left > 0 and top > 0 and left + wide < heights.shape[1] and top + high < heights.shape[0]
            if inner and area <= _LARGEST_DRAIN_SHARE * heights.size:
                hole = labels == number
                beside = cv2.dilate(hole.astype(np.uint8), _CROSS).astype(bool) & ~hole
                closed[hole] = np.nanmedian(heights[beside])
        return closed

    def volume_between(self, lower: np.ndarray, upper: np.ndarray) -> float:
        """Return the volume (m3) between two height fields over the cells where both are defined."""
        return float(np.nansum(np.maximum(upper - lower, 0))) * self.cell_m**2


def _make_ray_grid(hull: trimesh.Trimesh, up: np.ndarray, cells: int) -> _RayGrid:
    up = up / np.linalg.norm(up)
    rotation = rotation_between(up, np.array([0.0, 0, 1]))
    local = hull.vertices @ rotation.T
    low, high = local.min(0), local.max(0)
    cell = float((high - low)[:2].max()) / cells
    x, y = (np.arange(low[a] + cell / 2, high[a], cell) for a in range(2))
    grid_x, grid_y = np.meshgrid(x, y, indexing="ij")
    above = np.full(grid_x.size, high[2] + (high - low).max())
    return _RayGrid(np.stack([grid_x.ravel(), grid_y.ravel(), above], axis=1) @ rotation, grid_x.shape, up, cell)


def _candidate_axes(hull: trimesh.Trimesh) -> list[np.ndarray]:
    """Return the object's axes, +Z first, and the principal axes that differ from them by more than 10 degrees."""
    axes = [np.array(a, dtype=float) for a in ((0, 0, 1), (0, 0, -1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0))]
    for principal in hull.principal_inertia_vectors:
        for axis in (principal, -principal):
            if max(float(axis @ other) for other in axes) < np.cos(np.radians(10)):
                axes.append(axis)
    return axes


def _basin(grid: _RayGrid, heights: np.ndarray) -> Opening | None:
    """Return the deepest basin of a height field; None if all water runs off."""
    if not np.isfinite(heights).any():
        return None
    level = _flooded(heights)
    depth = np.where(np.isfinite(heights), level - heights, 0.0)
    wet = depth > 0.01 * grid.cell_m
    if not wet.any():
        return None
    deepest = np.unravel_index(int(depth.argmax()), depth.shape)
    pool = wet & (np.abs(level - level[deepest]) < 1e-9)
    rim = grid.origins.reshape(*grid.shape, 3)[pool].mean(0)
    center = rim - grid.up * (rim @ grid.up - level[deepest])
    area = pool.sum() * grid.cell_m**2
    return Opening(
        grid.up, center, float(np.sqrt(area / np.pi)), float(depth[pool].sum()) * grid.cell_m**2, float(depth[deepest])
    )


def _flooded(heights: np.ndarray) -> np.ndarray:
    """Return the water level of every cell with all basins full; border and NaN cells drain.

    Levels sink until every cell has the lowest level of its neighbourhood or its own ground, whichever is higher. This is the
    fixed point of priority flood, computed with image erosions.
    """
    beside = np.isnan(heights)
    drains = beside.copy()
    drains[[0, -1]], drains[:, [0, -1]] = True, True
    heights = np.where(beside, np.nanmin(heights) - 1.0, heights)
    level = np.where(drains, heights, np.inf)
    while True:
        sunk = np.where(drains, heights, np.maximum(heights, cv2.erode(level, _CROSS)))
        if np.array_equal(sunk, level):
            return level
        level = sunk
