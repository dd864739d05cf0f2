"""Small pictures of triangle meshes without a graphics device: silhouettes, and which face is seen where.

Faces that look away are left out, the others are painted from the farthest to the nearest (the painter's algorithm by the
faces' centres: right for the small, closed triangles of templates but for slivers at edges).
"""

from __future__ import annotations

import cv2
import numpy as np

_SHIFT = 4  # OpenCV's fixed point: sixteenths of a pixel


def to_pixels(flat: np.ndarray, side_px: int, box_share: float) -> np.ndarray:
    """Return pixel coordinates ``(N, 2)`` of places in the photo frame, in a square picture of which the box fills a share."""
    return np.asarray(flat * (box_share * side_px) + (side_px - 1) / 2)


def facing(pixels: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return which faces ``(F, 3)`` of projected vertices ``(V, 2)``, wound outward, look at the camera."""
    a, b, c = (pixels[faces[:, corner]] for corner in range(3))
    first, second = b - a, c - a
    # y runs downward: what is counter-clockwise in the world is clockwise here
    return np.asarray(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0] < 0)


def edges_between(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges ``(E, 2)`` of a closed mesh and the faces ``(E, 2)`` at them; an edge runs as in the first of them."""
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    key = ends.min(axis=1) * (int(faces.max()) + 1) + ends.max(axis=1)
    order = np.argsort(key, kind="stable")
    first, second = order[0::2], order[1::2]  # every edge of a closed mesh is there twice
    return ends[first], np.column_stack([first // 3, second // 3])


def silhouette(pixels: np.ndarray, faces: np.ndarray, edges: tuple[np.ndarray, np.ndarray], side_px: int) -> np.ndarray:
    """Return the mask ``(side, side) uint8`` of a closed mesh whose vertices lie at ``pixels (V, 2)``.

    A pixel is in it about which the contour, the edges between faces that look here and faces that look away, winds at least
    once: the winding number is the count of layers that face the camera. It is summed along the rows.
    """
    ends, beside = edges
    front = facing(pixels, faces)
    one, other = front[beside[:, 0]], front[beside[:, 1]]
    contour = one != other
    path = np.where(one[contour, None], ends[contour], ends[contour][:, ::-1])
    start, end = pixels[path[:, 0]], pixels[path[:, 1]]
    low, high = np.minimum(start[:, 1], end[:, 1]), np.maximum(start[:, 1], end[:, 1])
    first = np.clip(np.ceil(low), 0, side_px).astype(np.int64)
    count = np.maximum(np.clip(np.ceil(high), 0, side_px).astype(np.int64) - first, 0)
    which = np.repeat(np.arange(len(count)), count)
    row = np.arange(len(which)) - np.repeat(np.cumsum(count) - count, count) + first[which]
    step = end - start
    mask = np.zeros((side_px, side_px), np.uint8)
    if not len(which):
        return mask
    x = start[which, 0] + (row - start[which, 1]) * step[which, 0] / step[which, 1]
    column = np.clip(np.ceil(x), 0, side_px).astype(np.int64)
    sign = np.where(step[which, 1] > 0, 1.0, -1.0)
    top, bottom, left, right = row.min(), row.max() + 1, column.min(), column.max()
    height, width = bottom - top, right - left + 1
    turns = np.bincount((row - top) * width + column - left, weights=sign, minlength=height * width)
    winding = np.cumsum(turns.astype(np.int16).reshape(height, width)[:, :-1], axis=1, dtype=np.int16)
    mask[top:bottom, left:right] = winding != 0
    return mask


def seen_faces(pixels: np.ndarray, distance: np.ndarray, faces: np.ndarray, side_px: int) -> np.ndarray:
    """Return the face that is seen at each pixel, ``(side, side) int32``, -1 where none is."""
    picture = np.full((side_px, side_px), -1, np.int32)
    front = np.nonzero(facing(pixels, faces))[0]
    order = front[np.argsort(-distance[faces[front]].mean(axis=1), kind="stable")]
    for triangle, face in zip(_fixed(pixels, faces[order]), order.tolist(), strict=True):
        cv2.fillConvexPoly(picture, triangle, face, cv2.LINE_8, _SHIFT)
    return picture


def _fixed(pixels: np.ndarray, faces: np.ndarray) -> np.ndarray:
    return np.round(pixels[faces] * (1 << _SHIFT)).astype(np.int32)
