"""The texture of a lifted mesh: the photo's crop, with the object's colours continued past its outline."""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

MAX_SIDE_PX = 1024
_MARGIN = 0.06


@dataclass(frozen=True)
class Crop:
    """The object cut out of a photo: ``colours (H, W, 3) uint8`` with the outline bled outward, ``mask (h, w) bool``.

    Both show the same rectangle of the photo; the mask is smaller. Texture coordinates of the mask's pixel (x, y) are
    ``((x + 0.5) / w, 1 - (y + 0.5) / h)``.
    """

    colours: np.ndarray
    mask: np.ndarray


def crop_object(rgba: np.ndarray, mask_side_px: int) -> Crop:
    """Cut the object out of ``rgba`` (H, W, 4) uint8.

    Colours come only from pixels well inside the mask: none from the background, and none that hide under full transparency.
    """
    solid = rgba[..., 3] > 127
    rows, columns = np.nonzero(solid.any(axis=1))[0], np.nonzero(solid.any(axis=0))[0]
    margin = int(np.ceil(_MARGIN * max(np.ptp(rows), np.ptp(columns)))) + 3
    pad = ((margin, margin), (margin, margin), (0, 0))
    box = np.pad(rgba[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1], pad)
    colours, alpha = _scaled(box, MAX_SIDE_PX)
    _, small = _scaled(box, mask_side_px)
    return Crop(bled(colours, alpha > 127), _cleaned(small > 127))


def bled(colours: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Replace what is not well inside ``mask`` by the nearest colour that is."""
    depth = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    # edge pixels mix object and background; thin parts keep their middle line
    local = ndimage.maximum_filter(depth, size=1 + 2 * max(4, round(0.010 * max(mask.shape))))
    inset = max(3.5, 0.010 * max(mask.shape))
    inner = mask & (depth >= np.minimum(inset, 0.6 * local)) & (depth > 0)
    nearest = ndimage.distance_transform_edt(~inner, return_distances=False, return_indices=True)
    filled = colours[nearest[0], nearest[1]]
    soft = cv2.GaussianBlur(filled, (0, 0), 2.0)
    return np.where(inner[..., None], colours, soft)


def beside(
    first: np.ndarray, second: np.ndarray, uv: np.ndarray, on_second: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Put a smaller picture to the right of a tall one, or below a wide one; both ``(H, W, 3) uint8``.

    Returns the picture of both and the coordinates in it, of ``uv (V, 2)`` in the first or, by ``on_second (V,)``, the second.
    """
    (height, width), (h, w) = first.shape[:2], second.shape[:2]
    wide = width > height
    corner = np.array([0, height] if wide else [width, 0])
    whole = np.array([width, height + h] if wide else [width + w, height])
    edge = ((0, 0), (0, width - w), (0, 0)) if wide else ((0, height - h), (0, 0), (0, 0))
    texture = np.concatenate([first, np.pad(second, edge, mode="edge")], axis=0 if wide else 1)
    down = np.column_stack([uv[:, 0], 1 - uv[:, 1]])
    pixels = np.where(on_second[:, None], corner + down * (w, h), down * (width, height)) / whole
    return texture, np.column_stack([pixels[:, 0], 1 - pixels[:, 1]])


def _scaled(rgba: np.ndarray, side_px: int) -> tuple[np.ndarray, np.ndarray]:
    """Scale down with premultiplied alpha: hidden colours do not bleed into visible ones."""
    alpha = rgba[..., 3].astype(np.float32) / 255
    premultiplied = rgba[..., :3].astype(np.float32) * alpha[..., None]
    scale = side_px / max(rgba.shape[:2])
    if scale < 1:
        size = (max(1, round(rgba.shape[1] * scale)), max(1, round(rgba.shape[0] * scale)))
        premultiplied = np.asarray(cv2.resize(premultiplied, size, interpolation=cv2.INTER_AREA), np.float32)
        alpha = np.asarray(cv2.resize(alpha, size, interpolation=cv2.INTER_AREA), np.float32)
    colours = premultiplied / np.maximum(alpha, 1 / 255)[..., None]
    return np.clip(colours + 0.5, 0, 255).astype(np.uint8), np.clip(alpha * 255 + 0.5, 0, 255).astype(np.uint8)


def _cleaned(mask: np.ndarray) -> np.ndarray:
    """Keep the largest 4-connected part and fill holes of less than 0.2 % of it."""
    labels, count = ndimage.label(mask)
    if count > 1:
        mask = labels == 1 + int(np.argmax(ndimage.sum_labels(mask, labels, np.arange(1, count + 1))))
    holes, count = ndimage.label(~mask)
    sizes = np.bincount(holes.ravel(), minlength=count + 1)
    small = sizes < max(4, 2e-3 * mask.sum())
    small[0] = False
    return mask | small[holes]
