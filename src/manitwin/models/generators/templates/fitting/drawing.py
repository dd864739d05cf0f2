"""Small software renderer for triangle meshes: silhouettes, and the visible face at each pixel.

Back faces are culled, the others are painted from far to near (painter's algorithm by face centres). For the small, closed
triangles of templates this is correct except for slivers at edges.
"""

from __future__ import annotations

import cv2
import numpy as np

_SHIFT = 4  # OpenCV fixed point: sixteenths of a pixel


def to_pixels(flat: np.ndarray, side_px: int, box_share: float) -> np.ndarray:
    """Return pixel coordinates ``(N, 2)`` of photo-frame positions in a square image in which the object's box fills
    ``box_share``.
    """
    return np.asarray(flat * (box_share * side_px) + (side_px - 1) / 2)


def facing(pixels: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Return which outward-oriented faces ``(F, 3)`` of projected vertices ``(V, 2)`` face the camera."""
    x, y = pixels.T.copy()
    a, b, c = faces.T
    x_a, y_a = x[a], y[a]
    # y points down: counter-clockwise in the world is clockwise here.
    return np.asarray((x[b] - x_a) * (y[c] - y_a) - (y[b] - y_a) * (x[c] - x_a) < 0)


def edges_between(faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the edges ``(E, 2)`` of a closed mesh and their two faces ``(E, 2)``; an edge is directed as in the first face."""
    ends = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    key = ends.min(axis=1) * (int(faces.max()) + 1) + ends.max(axis=1)
    order = np.argsort(key, kind="stable")
    first, second = order[0::2], order[1::2]  # every edge of a closed mesh occurs twice
    return ends[first], np.column_stack([first // 3, second // 3])


def silhouette(pixels: np.ndarray, faces: np.ndarray, edges: tuple[np.ndarray, np.ndarray], side_px: int) -> np.ndarray:
    """Return the silhouette mask ``(side, side) uint8`` of a closed mesh with vertices at ``pixels (V, 2)``.

    The occluding contour consists of edges between front and back faces. Its winding number about a pixel, accumulated along
    rows, is the number of front-facing layers; the mask has the pixels where it is not zero.
    """
    ends, beside = edges
    front = facing(pixels, faces)
    one = front[beside[:, 0]]
    contour = np.flatnonzero(one != front[beside[:, 1]])
    one, ends = one[contour], ends[contour]
    (start_x, start_y), (end_x, end_y) = (
        pixels[np.where(forward, ends[:, 0], ends[:, 1])].T for forward in (one, ~one)
    )
    first = np.clip(np.ceil(np.minimum(start_y, end_y)), 0, side_px).astype(np.int64)
    count = np.clip(np.ceil(np.maximum(start_y, end_y)), 0, side_px).astype(np.int64) - first
    which = np.repeat(np.arange(len(count)), count)
    row = np.arange(len(which)) - np.repeat(np.cumsum(count) - count - first, count)
    mask = np.zeros((side_px, side_px), np.uint8)
    if not len(which):
        return mask
    step_x, step_y = end_x - start_x, end_y - start_y
    x = start_x[which] + (row - start_y[which]) * step_x[which] / step_y[which]
    column = np.clip(np.ceil(x), 0, side_px).astype(np.int64)
    sign = np.where(step_y > 0, 1.0, -1.0)[which]
    top, bottom, left, right = row.min(), row.max() + 1, column.min(), column.max()
    height, width = bottom - top, right - left + 1
    turns = np.bincount((row - top) * width + column - left, weights=sign, minlength=height * width)
    winding = np.cumsum(turns.astype(np.int16).reshape(height, width)[:, :-1], axis=1, dtype=np.int16)
    mask[top:bottom, left:right] = winding != 0
    return mask


def visible_faces(pixels: np.ndarray, distance: np.ndarray, faces: np.ndarray, side_px: int) -> np.ndarray:
    """Return the visible face at each pixel, ``(side, side) int32``, -1 for background."""
    picture = np.full((side_px, side_px), -1, np.int32)
    front = np.nonzero(facing(pixels, faces))[0]
    order = front[np.argsort(-distance[faces[front]].mean(axis=1), kind="stable")]
    for triangle, face in zip(_fixed(pixels, faces[order]), order.tolist(), strict=True):
        cv2.fillConvexPoly(picture, triangle, face, cv2.LINE_8, _SHIFT)
    return picture


def _fixed(pixels: np.ndarray, faces: np.ndarray) -> np.ndarray:
    return np.round(pixels[faces] * (1 << _SHIFT)).astype(np.int32)
