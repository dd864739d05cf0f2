"""Visual hull of silhouettes seen by pinhole cameras, cut off at the ground on which the object stands."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from manitwin.errors import Rejected
from manitwin.models.generators.lift.pinhole import (
    FAR_PX,
    PinholeSilhouette,
    bounding_sphere,
    least_distance_px,
    points_on_rays,
)

COARSE_CELLS, CELLS = 24, 96
"""Grid cells along the longest side: of a coarse grid that locates the solid, and of its own grid."""
NEAR_PX = 1.5
"""Maximum distance by which a ray may miss the solid and still count as a hit, at the resolution of ``turntable.SIDE_PX``."""
_COVERED_RAYS = 300
_LEAST_DOWNWARD = 0.05  # minimum downward slope of a ray; flatter rays do not determine the height of what they hit
_LOWEST_SHARE = 0.25


def covered_shares(sights: Sequence[PinholeSilhouette]) -> tuple[list[float], np.ndarray]:
    """Return the share of each silhouette that the hull fills, and ``(N, N)`` the share of silhouette i for the hull without k.

    Each silhouette is tested against the others, which gives the same result as with itself.
    """
    count = len(sights)
    surroundings = bounding_sphere(sights)
    shares, without = [], np.zeros((count, count))
    for number, sight in enumerate(sights):
        rows, columns = np.nonzero(sight.distance > 0)
        some = np.linspace(0, len(rows) - 1, min(_COVERED_RAYS, len(rows))).astype(int)
        pixels = np.column_stack([columns[some], rows[some]]) + sight.corner + 0.5
        points = points_on_rays(sight, pixels, surroundings)
        each = np.full((count, *points.shape[:2]), FAR_PX, np.float32)
        for other in range(count):
            if other != number:
                each[other] = sights[other].signed_distance_px(points)
        order = np.sort(each, axis=0)[:2]
        shares.append(float(np.mean(order[0].max(axis=1) > -NEAR_PX)))
        for left_out in range(count):
            least = np.where(each[left_out] > order[0], order[0], order[1])
            without[number, left_out] = np.mean(least.max(axis=1) > -NEAR_PX)
    return shares, without


def hull_field(
    sights: Sequence[PinholeSilhouette], power: float | None, ground: float | None = None, cells: int = CELLS
) -> tuple[np.ndarray, float, np.ndarray]:
    """Return the signed distance inside all silhouettes on a grid (X, Y, Z), its cell and its first node, as lengths.

    Points below the ground, which cameras from above do not see, are outside; ``ground`` is its height, by default estimated
    from the silhouettes. ``cells`` is the resolution along the longest side. With ``power``, corners left open by silhouettes
    along x and y are rounded to superellipses (Barr 1981). Raises Rejected if the hull is empty.
    """
    centre, radius = bounding_sphere(sights)
    rough = 2 * radius / COARSE_CELLS
    axes = [np.arange(middle - radius, middle + radius + rough, rough) for middle in centre]
    inside = _depth(sights, np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)) > -rough
    if not inside.any():
        raise Rejected("generator_failed", "the outlines do not intersect; check the turns", "generate")
    low, high = (np.array([pick(np.nonzero(inside)[k]) for k in range(3)]) for pick in (np.min, np.max))
    first = np.array([axis[at] for axis, at in zip(axes, low, strict=True)]) - rough
    last = np.array([axis[at] for axis, at in zip(axes, high, strict=True)]) + rough
    cell = float((last - first).max()) / cells
    axes = [np.arange(start, end + 2 * cell, cell) for start, end in zip(first, last, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    level = ground_level(sights) if ground is None else ground
    depth = np.minimum(_depth(sights, points), points[..., 2] - level)
    if power is not None:
        depth = _round_to_superellipse(depth, cell, power)
    smooth = ndimage.gaussian_filter(np.clip(depth, -3 * cell, 3 * cell), 0.5)
    for side in (smooth[0], smooth[-1], smooth[:, 0], smooth[:, -1], smooth[:, :, 0], smooth[:, :, -1]):
        side[...] = -cell
    return smooth, cell, first


def ground_level(sights: Sequence[PinholeSilhouette], of: Sequence[int] | None = None) -> float:
    """Return the height of the ground on which the object stands, from all cameras or those with indices ``of``.

    In each photo, the rays along the silhouette that hit the hull lowest hit it at the ground or just in front of it. The
    result is minus infinity if no camera looks down at the ground.
    """
    surroundings = bounding_sphere(sights)
    lowest = []
    for number in range(len(sights)) if of is None else of:
        sight = sights[number]
        points = points_on_rays(sight, sight.rim, surroundings)
        rays = sight.rays(sight.rim)
        downward = -rays[:, 2] / np.linalg.norm(rays, axis=1) > _LEAST_DOWNWARD
        met = least_distance_px(sights, number, points) > -0.5
        told = downward & met.any(axis=1)
        if told.any():
            heights = np.where(met, points[..., 2], -np.inf).max(axis=1)[told]
            lowest.append(float(heights.min()))
    return float(np.quantile(lowest, _LOWEST_SHARE)) if lowest else -np.inf


def _round_to_superellipse(depth: np.ndarray, cell: float, power: float) -> np.ndarray:
    """Round each part of each level of a field (X, Y, Z) to a superellipse over its widths along x and y."""
    cut = depth.copy()
    for level in range(depth.shape[2]):
        parts, _ = ndimage.label(depth[:, :, level] > 0)
        for number, (along_x, along_y) in enumerate(ndimage.find_objects(parts), 1):
            own = (
                slice(max(along_x.start - 1, 0), along_x.stop + 1),
                slice(max(along_y.start - 1, 0), along_y.stop + 1),
            )
            x, y = (np.arange(part.start, part.stop) - (part.start + part.stop - 1) / 2 for part in own)
            half_x, half_y = (along_x.stop - along_x.start) / 2, (along_y.stop - along_y.start) / 2
            share = ((np.abs(x[:, None]) / half_x) ** power + (np.abs(y[None]) / half_y) ** power) ** (1 / power)
            inside = min(half_x, half_y) * cell * (1 - share)
            other = (parts[own] != 0) & (parts[own] != number)
            cut[(*own, level)] = np.where(other, cut[(*own, level)], np.minimum(cut[(*own, level)], inside))
    return cut


def _depth(sights: Sequence[PinholeSilhouette], points: np.ndarray) -> np.ndarray:
    """Return the signed distance of points inside all silhouettes, as lengths."""
    least = np.full(points.shape[:-1], np.inf)
    for sight in sights:
        inside, pixel = sight.distance_and_pixel_size(points)
        least = np.minimum(least, np.where(inside <= -FAR_PX, -np.inf, inside) * pixel)
    return np.maximum(least, -1e3)
