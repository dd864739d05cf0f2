"""Handles of a body of revolution: the medial axis of each silhouette part outside the body becomes a swept tube.

The handle lies in the plane through the body's axis parallel to the image, because one photo does not show its rotation.
"""

from __future__ import annotations

import cv2
import numpy as np
from manifold3d import Manifold
from scipy import ndimage
from scipy.ndimage import gaussian_filter1d
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from manitwin.geometry.solids.shapes import SolidError
from manitwin.geometry.solids.sweep import tube
from manitwin.models.generators.lift.revolution import RevolutionProfile, projected_half_widths

LEAST_AREA_SHARE = 0.012  # of the silhouette: smaller parts are irregularities of the outline
LEAST_REACH_SHARE = 0.12  # minimum reach out of the body, over the body's largest radius
TOUCH_PX = 3.0
MOST_HANDLES = 3
SAMPLES = 28
_LEAST_RADIUS_PX = 1.5


def body_mask(turned: RevolutionProfile, shape: tuple[int, int]) -> np.ndarray:
    """Return the mask (H, W) bool of a body of revolution in the picture."""
    widths = projected_half_widths(turned, np.arange(shape[0], dtype=float))
    return np.asarray(np.abs(np.arange(shape[1])[None] - turned.column_px) <= widths[:, None])


def handle_tubes(mask: np.ndarray, turned: RevolutionProfile) -> list[Manifold]:
    """Return tubes in the solid's frame (see ``Turned``) for the parts of ``mask`` (H, W) outside the body."""
    body = body_mask(turned, (mask.shape[0], mask.shape[1]))
    outside = ndimage.binary_opening(mask & ~ndimage.binary_dilation(body, iterations=2))
    labels, count = ndimage.label(outside, np.ones((3, 3)))
    sizes = ndimage.sum_labels(outside, labels, np.arange(1, count + 1)) if count else np.zeros(0)
    from_body = ndimage.distance_transform_edt(~body)
    tubes = []
    for index in np.argsort(sizes)[::-1][:MOST_HANDLES]:
        part = labels == index + 1
        reach = float(from_body[part].max())
        if sizes[index] < LEAST_AREA_SHARE * mask.sum() or reach < LEAST_REACH_SHARE * turned.radii.max():
            continue
        found = medial_line(mask & ~body & ndimage.binary_dilation(part, iterations=3), from_body)
        if found is not None and (made := _swept(*found, turned)) is not None:
            tubes.append(made)
    return tubes


def medial_line(part: np.ndarray, from_body: np.ndarray) -> tuple[np.ndarray, np.ndarray, bool] | None:
    """Return the medial axis ``(K, 2)`` (x, y) of a part, from the body outward, its radii ``(K,)``, and whether it is a loop.

    ``part (H, W) bool`` touches the body; ``from_body (H, W)`` is the distance to the body. None if the part does not touch
    it.
    """
    radius = cv2.distanceTransform(np.pad(part, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    # the parts of the medial axis at the body
    touching, count = ndimage.label(part & (from_body <= TOUCH_PX), np.ones((3, 3)))
    if count == 0:
        return None
    sizes = ndimage.sum_labels(part, touching, np.arange(1, count + 1))
    ends = np.argsort(sizes)[::-1][:2] + 1
    rows, columns = np.nonzero(part)
    index = np.full(part.shape, -1)
    index[rows, columns] = np.arange(len(rows))
    graph = _graph(index, rows, columns, radius)
    start = _middle(touching == ends[0], index)
    distance, before = dijkstra(graph, indices=start, return_predecessors=True)
    loop = len(ends) == 2 and sizes[ends[1] - 1] > 0.15 * sizes[ends[0] - 1]
    reachable = np.where(np.isfinite(distance), from_body[rows, columns], -1.0)
    goal = _middle(touching == ends[1], index) if loop else int(np.argmax(reachable))
    if not np.isfinite(distance[goal]):
        return None
    line = [goal]
    while line[-1] != start and before[line[-1]] >= 0:
        line.append(int(before[line[-1]]))
    order = np.array(line[::-1])
    if len(order) < 4:
        return None
    path = np.column_stack([columns[order], rows[order]]).astype(float)
    radii = radius[rows[order], columns[order]]
    # the part widens at the body and is rounded at its end, so the radius of the middle part is used as limit
    usual = float(np.median(radii[len(radii) // 5 : max(len(radii) // 5 + 1, 4 * len(radii) // 5)]))
    return path, np.minimum(radii, 1.25 * usual), bool(loop)


def _graph(index: np.ndarray, rows: np.ndarray, columns: np.ndarray, radius: np.ndarray) -> coo_matrix:
    """Return the graph of neighbouring pixels with low cost along the medial axis."""
    weight = 1.0 / np.maximum(radius[rows, columns], 0.5) ** 2
    entries = []
    padded = np.pad(index, 1, constant_values=-1)
    for dy, dx in ((0, 1), (1, 0), (1, 1), (1, -1)):
        other = padded[rows + 1 + dy, columns + 1 + dx]
        here = np.nonzero(other >= 0)[0]
        there = other[here]
        entries.append((here, there, np.hypot(dy, dx) * (weight[here] + weight[there]) / 2))
    row, column, value = (np.concatenate(each) for each in zip(*entries, strict=True))
    size = len(rows)
    return coo_matrix(
        (np.append(value, value), (np.append(row, column), np.append(column, row))), shape=(size, size)
    ).tocsr()


def _middle(where: np.ndarray, index: np.ndarray) -> int:
    rows, columns = np.nonzero(where)
    nearest = np.argmin((rows - rows.mean()) ** 2 + (columns - columns.mean()) ** 2)
    return int(index[rows[nearest], columns[nearest]])


def _swept(path: np.ndarray, radii: np.ndarray, loop: bool, turned: RevolutionProfile) -> Manifold | None:
    """Return the tube in the solid's frame, with its ends inside the body; None if it is no valid solid."""
    smooth = gaussian_filter1d(path, max(1.0, len(path) / 40), axis=0, mode="nearest")
    radii = gaussian_filter1d(radii, max(1.0, len(path) / 20), mode="nearest")
    x, y = smooth[:, 0], -smooth[:, 1] / np.cos(turned.angle_rad)
    points = np.column_stack([x, y, np.zeros(len(x))])
    inward = np.sign(turned.column_px - x[0])
    # extend into the wall, because touching solids are not joined
    deep = float(np.median(radii)) + TOUCH_PX
    points = np.vstack(
        [points[0] + [inward * deep, 0, 0], points, *([points[-1] + [inward * deep, 0, 0]] if loop else [])]
    )
    radii = np.concatenate([radii[:1], radii, *([radii[-1:]] if loop else [])])
    along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    wanted = np.linspace(0, along[-1], SAMPLES)
    points = np.stack([np.interp(wanted, along, points[:, axis]) for axis in range(3)], axis=1)
    radii = np.maximum(np.interp(wanted, along, radii), _LEAST_RADIUS_PX)
    try:
        return tube(points, radii, across=(0.0, 0.0, 1.0))
    except SolidError:
        return None
