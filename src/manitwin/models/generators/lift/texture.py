"""Texture of a lifted mesh: the crop of the photo, extended beyond its outline, and painted colours for unseen sides.

A mirrored front would show mirrored letters, so unseen sides are painted. The photo's pixels are quantized to a few colours,
and each place gets the colour that dominates its surroundings. This keeps large regions and their borders and drops strokes,
because letters cover less area than their background. For a body of revolution the surroundings are the whole ring. Towards
the outline the colours blend into those of the photo, so that no seam shows.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
from scipy import ndimage

from manitwin.models.generators.bleeding import bleed_colours
from manitwin.models.generators.lift.silhouette import Silhouette, rotate_upright, upright_transform

MAX_SIDE_PX = 1024
_MARGIN = 0.06
_COLOURS = 6
_SAMPLES, _ROUNDS = 4096, 10
_AROUND_SHARE = 0.06  # of the longer side: sigma of a Gaussian that covers a letter and its background
_RING_SHARE = 0.03  # of the length along the axis: covers a line of text with its background; a cap is higher
_SOFT_SHARE = 0.008  # of the longer side: blur of borders between two colours
_SOFT_RIM_SHARE = 0.015
"""Sigma of a Gaussian over the longer side; it removes strokes of letters but keeps the shading of the sides."""
_GRAZED_SHARE = 0.025  # of the longer side: width of the rim where a large round body is seen at a grazing angle
_RIM_SHARE = 0.04  # of the longer side: decay length of the outline's colours inward


@dataclass(frozen=True)
class Crop:
    """The object cropped from a photo: ``colours (H, W, 3) uint8``, extended beyond the outline, and ``mask (h, w) bool``.

    Both show the same rectangle of the photo; the mask has a lower resolution. The texture coordinates of the mask's pixel
    (x, y) are ``((x + 0.5) / w, 1 - (y + 0.5) / h)``. ``box`` is the rectangle in pixels of the photo: left, top, width,
    height.
    """

    colours: np.ndarray
    mask: np.ndarray
    box: tuple[int, int, int, int]


def crop_object(rgba: np.ndarray, mask_side_px: int) -> Crop:
    """Crop the object from ``rgba`` (H, W, 4) uint8.

    Colours come only from pixels well inside the mask, so neither from the background nor from transparent pixels.
    """
    solid = rgba[..., 3] > 127
    rows, columns = np.nonzero(solid.any(axis=1))[0], np.nonzero(solid.any(axis=0))[0]
    margin = int(np.ceil(_MARGIN * max(np.ptp(rows), np.ptp(columns)))) + 3
    pad = ((margin, margin), (margin, margin), (0, 0))
    box = np.pad(rgba[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1], pad)
    colours, alpha = _scaled(box, MAX_SIDE_PX)
    _, small = _scaled(box, mask_side_px)
    place = int(columns[0]) - margin, int(rows[0]) - margin, box.shape[1], box.shape[0]
    return Crop(bleed_colours(colours, alpha > 127), _cleaned(small > 127), place)


def place_beside(
    first: np.ndarray, second: np.ndarray, uv: np.ndarray, on_second: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Place a smaller picture to the right of a tall one, or below a wide one; both ``(H, W, 3) uint8``.

    Returns the joined picture and the converted coordinates of ``uv (V, 2)``, which refer to the first picture or, where
    ``on_second (V,)``, to the second.
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
    """Scale down with premultiplied alpha, so that colours of transparent pixels do not bleed into visible ones."""
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
    """Keep the largest 4-connected part and fill holes smaller than 0.2 % of it."""
    labels, count = ndimage.label(mask)
    if count > 1:
        mask = labels == 1 + int(np.argmax(ndimage.sum_labels(mask, labels, np.arange(1, count + 1))))
    holes, count = ndimage.label(~mask)
    sizes = np.bincount(holes.ravel(), minlength=count + 1)
    small = sizes < max(4, 2e-3 * mask.sum())
    small[0] = False
    return mask | small[holes]


def paint_unseen(crop: Crop, axis: Silhouette | None) -> np.ndarray:
    """Return painted colours ``(h, w, 3) uint8`` for the crop's mask ``(h, w)``; ``axis`` is given for solids of revolution."""
    height, width = crop.mask.shape
    photo = cv2.resize(crop.colours, (width, height), interpolation=cv2.INTER_AREA).astype(np.float32)
    if axis is None:
        base = _dominant_colours(photo, crop.mask, _neighbourhood_blur(crop.mask))
    else:
        base = _ring_colours(photo, crop.mask, axis)
    base = np.asarray(cv2.GaussianBlur(base, (0, 0), _SOFT_SHARE * max(height, width)))
    return np.clip(base + _rim_difference(photo, base, crop.mask) + 0.5, 0, 255).astype(np.uint8)


def _dominant_colours(photo: np.ndarray, mask: np.ndarray, spread: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
    """Return for each place the mean of the colour class that dominates its surroundings.

    ``spread`` sums an image ``(H, W, C)`` over the surroundings of each place and may change its shape.
    """
    kinds = _cluster_colours(photo, mask)
    sums = [spread(np.dstack([photo, np.ones_like(mask)]) * (kinds == kind)[..., None]) for kind in range(_COLOURS)]
    winner = np.argmax([each[..., 3] for each in sums], axis=0)
    chosen = np.take_along_axis(np.array(sums), winner[None, ..., None], axis=0)[0]
    known = chosen[..., 3] > 1e-6
    nearest = ndimage.distance_transform_edt(~known, return_distances=False, return_indices=True)
    chosen = chosen[tuple(nearest)]
    return np.asarray(chosen[..., :3] / chosen[..., 3:], np.float32)


def _cluster_colours(photo: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the nearest of a few colours for each pixel of the mask, -1 outside: k-means in L*a*b*.

    The initial centres are the median and then the colour farthest from the previous ones (Gonzalez 1985), which is
    deterministic.
    """
    colours = cv2.cvtColor(photo / 255, cv2.COLOR_RGB2Lab)[mask]
    some = colours[:: max(1, len(colours) // _SAMPLES)]
    centres = np.median(some, axis=0)[None]
    for _ in range(_COLOURS - 1):
        centres = np.vstack([centres, some[np.argmax(_squares(some, centres).min(axis=1))]])
    for _ in range(_ROUNDS):
        nearest = np.argmin(_squares(some, centres), axis=1)
        centres = np.array(
            [some[nearest == k].mean(axis=0) if (nearest == k).any() else centres[k] for k in range(_COLOURS)]
        )
    kinds = np.full(mask.shape, -1)
    kinds[mask] = np.argmin(_squares(colours, centres), axis=1)
    return kinds


def _squares(points: np.ndarray, centres: np.ndarray) -> np.ndarray:
    return np.asarray(((points[:, None] - centres) ** 2).sum(axis=2))


def _neighbourhood_blur(mask: np.ndarray) -> Callable[[np.ndarray], np.ndarray]:
    sigma = _AROUND_SHARE * max(mask.shape)
    return lambda image: np.asarray(cv2.GaussianBlur(image.astype(np.float32), (0, 0), sigma))


def _ring_colours(photo: np.ndarray, mask: np.ndarray, axis: Silhouette) -> np.ndarray:
    """Return the colours voted by the rows around each row across the axis."""
    height, width = mask.shape
    upright = np.asarray(rotate_upright(photo, axis.axis_tilt_deg))
    inside = rotate_upright(mask, axis.axis_tilt_deg)
    sigma = _RING_SHARE * int(inside.any(axis=1).sum())

    def along_axis(image: np.ndarray) -> np.ndarray:
        rows = image.sum(axis=1, keepdims=True, dtype=float)
        return np.asarray(ndimage.gaussian_filter1d(rows, sigma, axis=0, mode="constant"))

    column = _dominant_colours(upright, inside, along_axis)
    striped = np.repeat(column, upright.shape[1], axis=1)
    back = upright_transform(height, width, axis.axis_tilt_deg)
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(cv2.warpAffine(striped, back, (width, height), flags=flags, borderMode=cv2.BORDER_REPLICATE))


def _rim_difference(photo: np.ndarray, base: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Return the photo minus ``base`` near the outline, smoothed and fading inward, and constant beyond the outline."""
    side = max(mask.shape)
    sigma = _SOFT_RIM_SHARE * side
    inside = mask.astype(np.float32)
    near = np.asarray(cv2.GaussianBlur(inside, (0, 0), sigma))
    soft = cv2.GaussianBlur((photo - base) * inside[..., None], (0, 0), sigma) / np.maximum(near, 1e-3)[..., None]
    nearest = ndimage.distance_transform_edt(~mask, return_distances=False, return_indices=True)
    depth = cv2.distanceTransform(mask.astype(np.uint8), cv2.DIST_L2, 5)
    fading = np.exp(-np.maximum(depth - _GRAZED_SHARE * side, 0) / (_RIM_SHARE * side))
    return np.asarray(soft[nearest[0], nearest[1]] * fading[..., None])
