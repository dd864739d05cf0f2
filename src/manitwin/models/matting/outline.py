"""Morphology, image edges, and flooding of the background up to the edges."""

from __future__ import annotations

import cv2
import numpy as np

from manitwin.models.matting.background import Background, connected_to, total

BY_ROWS_FROM_PX = 6  # disks of at least this radius are applied row by row, sixteen times as fast at radius 60
OBJECT_DISTANCE = 6.0  # Mahalanobis distance up to which the background model explains a border pixel


def disk(radius: int) -> np.ndarray:
    """Return a round structuring element."""
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * radius + 1, 2 * radius + 1))


def dilated(mask: np.ndarray, radius: int) -> np.ndarray:
    """Dilate a mask by a disk."""
    if radius < BY_ROWS_FROM_PX:
        return cv2.dilate(mask.astype(np.uint8), disk(radius)) > 0
    return _dilated_by_rows(mask.astype(np.uint8), radius) > 0


def eroded(mask: np.ndarray, radius: int) -> np.ndarray:
    """Erode a mask by a disk; pixels beyond the image frame do not erode it."""
    return ~dilated(~mask, radius)


def opened(mask: np.ndarray, radius: int) -> np.ndarray:
    """Open a mask by a disk, which removes parts thinner than the disk."""
    return dilated(eroded(mask, radius), radius)


def _dilated_by_rows(mask: np.ndarray, radius: int) -> np.ndarray:
    """Dilate a mask (H, W) uint8 by a disk, row by row of the disk.

    The rows of a disk grow towards its centre, so each horizontal dilation extends the previous one and is shifted to its
    row.
    """
    found, wider, reach, height = np.zeros_like(mask), mask, 0, len(mask)
    reaches = (disk(radius)[: radius + 1].sum(axis=1).astype(int) - 1) // 2
    for off, row_reach in zip(range(radius, -1, -1), reaches, strict=True):
        if row_reach > reach:
            wider = cv2.dilate(wider, np.ones((1, 2 * (row_reach - reach) + 1), np.uint8))
            reach = row_reach
        if off < height:
            found[off:] |= wider[: height - off]
            found[: height - off] |= wider[off:]
    return found


def fill_small_holes(mask: np.ndarray) -> np.ndarray:
    """Fill holes smaller than 0.2 % of a mask."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats((~mask).astype(np.uint8), connectivity=4)
    small = stats[:, cv2.CC_STAT_AREA] < 2e-3 * mask.sum()
    small[0] = False
    return np.asarray(mask | small[labels])


def holds(region: np.ndarray) -> int:
    """Return the number of pixels that a region (H, W) encloses without containing them."""
    height, width = region.shape
    padded = np.zeros((height + 2, width + 2), np.uint8)
    padded[1:-1, 1:-1] = region
    cv2.floodFill(padded, None, (0, 0), 2)
    return int((padded[1:-1, 1:-1] == 0).sum())


def gradient_magnitude(lab: np.ndarray, blur_px: float = 1.0) -> np.ndarray:
    """Return the magnitude of the colour gradient (H, W) in L*a*b* units per pixel."""
    smooth = cv2.GaussianBlur(lab, (0, 0), blur_px)
    squares = np.zeros(lab.shape[:2], np.float32)
    for axis in ((1, 0), (0, 1)):
        squares += total(cv2.Sobel(smooth, cv2.CV_32F, *axis, scale=0.125) ** 2)
    return np.sqrt(squares)


def edge_threshold(background: Background, gradient: np.ndarray) -> float:
    """Return the gradient that the background's own texture rarely reaches (97th percentile of the border).

    Border pixels that no surface explains, with their rim, are an object near the frame and do not count as texture.
    """
    texture = background.border & ~dilated(background.border & (background.coarse_distance > OBJECT_DISTANCE), 3)
    if texture.sum() < 0.5 * background.border.sum():
        texture = background.border
    return max(0.35, float(np.percentile(gradient[texture], 97)))


def edges(background: Background, gradient: np.ndarray, threshold: float) -> np.ndarray:
    """Return edges with hysteresis (Canny 1986): weak edge pixels count if they are connected to a strong one."""
    weak = gradient > threshold
    count, labels = cv2.connectedComponents(weak.astype(np.uint8), connectivity=8)
    strong = np.zeros(count, bool)
    strong[np.unique(labels[weak & (gradient > 1.6 * threshold)])] = True
    strong[0] = False
    return strong[labels]


def flood_region(free: np.ndarray, seed: np.ndarray, ball_px: int, regrow_px: int) -> np.ndarray:
    """Flood ``free`` from ``seed`` with a ball that cannot pass gaps narrower than itself, then fill up to the walls.

    The picture is extended beyond its frame with its border values, so that the ball can enter between an object and the
    frame.
    """
    free, seed = (np.pad(mask, ball_px + 1, mode="edge") for mask in (free, seed))
    roomy = ~dilated(~free, ball_px)
    reached = connected_to(roomy, seed & roomy)
    for _ in range(regrow_px):
        reached = (dilated(reached, 1) & free) | reached
    inner = slice(ball_px + 1, -ball_px - 1)
    return reached[inner, inner]
