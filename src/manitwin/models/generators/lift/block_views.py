"""Blocks (boxes) and views of them that match the silhouette of a photo: initial values for fits of boxes.

The silhouette of a block is convex, and a convex silhouette is fully described by its support function (Schneider 1993,
"Convex Bodies", 1.7). The support function of a block is the maximum over its eight corners, so hundreds of least-squares
fits from all directions cost less than one fit that renders. Several blocks have nearly the same silhouette; the inner edges
of the photo tell them apart.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import cv2
import numpy as np

from manitwin.models.generators.templates.fitting.view import LEAST_PERSPECTIVE, MOST_PERSPECTIVE, View

DIRECTION_COUNT = 72
"""Number of directions in which the support functions are compared."""
ELEVATIONS_DEG, YAWS_DEG = (5.0, 14.0, 27.0, 42.0, 58.0, 76.0), (-36.0, -12.0, 12.0, 36.0)
PROPORTIONS = (0.4, 1.0, 2.4, 8.0)
"""Initial values of width and depth over height."""
LEAST_PROPORTION, MOST_PROPORTION = 0.05, 50.0
MOST_VIEWS = 6
MOST_OFF, WORSE = 0.005, 2.5
"""Maximum root mean square distance of the silhouettes, over the longer side, and maximum ratio to that of the best block."""
_ROUNDS, _COARSE_ROUNDS, _KEPT = 24, 6, 48
_ROLL_RAD = np.radians(4.0)
_PRIOR = 0.0015  # residual of one standard deviation of perspective or roll, as a support distance
_STEPS = np.array([0.01, 0.01, 0.005, 0.02, 0.01, 0.01, 0.003, 0.002, 0.002])
_SIGNS = np.array(list(product((-0.5, 0.5), repeat=3)))
_SIMILAR_LOG_PROPORTION = 0.06  # difference of log proportions
_SIMILAR_VIEW_RAD = np.radians(4.0)


@dataclass(frozen=True)
class BlockView:
    """A block with ``width`` and ``depth`` over its height, the ``view`` of it, and its distance ``off`` from the silhouette.

    ``off`` is the root mean square distance of the support functions over the longer side.
    """

    width: float
    depth: float
    view: View
    silhouette_error: float


def block_views(mask: np.ndarray, perspective: float, focal_spread: float) -> list[BlockView]:
    """Return the blocks whose silhouette is close to that of ``mask (H, W) bool``, the best first; may be empty.

    The camera is above the block and not rolled. ``perspective`` and ``focal_spread`` are those of ``Evidence``.
    """
    reach = _support_distances(outline_points(mask))
    usual = float(np.log(np.clip(perspective / 1.6, LEAST_PERSPECTIVE, MOST_PERSPECTIVE)))
    at = _starts(usual)
    damping = np.full(len(at), 0.01)
    value = _residuals(at, reach, usual, focal_spread)
    for number in range(_ROUNDS):
        if number == _COARSE_ROUNDS:
            best = np.argsort((value**2).sum(1), kind="stable")[:_KEPT]
            at, damping, value = at[best], damping[best], value[best]
        at, value, damping = _levenberg_marquardt_step(at, value, damping, reach, usual, focal_spread)
    off = np.sqrt((value[:, :DIRECTION_COUNT] ** 2).mean(1))
    found: list[BlockView] = []
    for number in np.argsort((value**2).sum(1), kind="stable"):
        each = _block_view(at[number], float(off[number]))
        near = each.silhouette_error <= min(MOST_OFF, WORSE * (found[0].silhouette_error if found else MOST_OFF) + 1e-3)
        if near and not any(_is_similar(each, other) for other in found):
            found.append(each)
    return found[:MOST_VIEWS]


def outline_points(mask: np.ndarray) -> np.ndarray:
    """Return the corners ``(N, 2)`` of the convex hull of a non-empty mask, in the photo frame of ``View``."""
    contours, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    hull = cv2.convexHull(max(contours, key=len))[:, 0].astype(float)
    low, high = hull.min(0) - 0.5, hull.max(0) + 0.5
    middle = (low + high) / 2
    away = hull - middle
    # a contour passes through pixel centres, the outline around the pixels
    return np.asarray((away + 0.5 * np.sign(away)) / (high - low).max())


def _support_directions() -> np.ndarray:
    angles = 2 * np.pi * np.arange(DIRECTION_COUNT) / DIRECTION_COUNT
    return np.column_stack([np.cos(angles), np.sin(angles)])


def _support_distances(points: np.ndarray) -> np.ndarray:
    return np.asarray((points @ _support_directions().T).max(axis=-2))


def _starts(usual: float) -> np.ndarray:
    """Return initial parameters ``(S, 9)``: yaw, elevation, roll, logarithms of perspective, width, depth, scale; x, y."""
    grid = product(np.radians(YAWS_DEG), np.radians(ELEVATIONS_DEG), np.log(PROPORTIONS), np.log(PROPORTIONS))
    at = np.array([[yaw, elevation, 0.0, usual, width, depth, 0.0, 0.0, 0.0] for yaw, elevation, width, depth in grid])
    flat = _projected(at)
    low, high = flat.min(1), flat.max(1)
    scale = 1 / (high - low).max(1)
    at[:, 6] = np.log(scale)
    at[:, 7:] = -scale[:, None] * (low + high) / 2
    return at


def _projected(at: np.ndarray) -> np.ndarray:
    """Return the projected corners ``(S, 8, 2)`` of blocks in the photo frame; a vectorized ``View.project``."""
    sides = np.column_stack([np.exp(at[:, 4]), np.exp(at[:, 5]), np.ones(len(at))])
    corners = _SIGNS * (sides / (np.linalg.norm(sides, axis=1, keepdims=True) / 2))[:, None]
    (cos_y, cos_e, cos_r), (sin_y, sin_e, sin_r) = np.cos(at[:, :3]).T, np.sin(at[:, :3]).T
    ahead_x = cos_y[:, None] * corners[..., 0] - sin_y[:, None] * corners[..., 1]
    ahead_y = sin_y[:, None] * corners[..., 0] + cos_y[:, None] * corners[..., 1]
    up = sin_e[:, None] * ahead_y + cos_e[:, None] * corners[..., 2]
    near = -cos_e[:, None] * ahead_y + sin_e[:, None] * corners[..., 2]
    right = cos_r[:, None] * ahead_x + sin_r[:, None] * up
    up = -sin_r[:, None] * ahead_x + cos_r[:, None] * up
    enlarged = np.exp(at[:, 6])[:, None] / (1 - np.exp(at[:, 3])[:, None] * near)
    return np.stack([right * enlarged + at[:, 7:8], -up * enlarged + at[:, 8:9]], axis=2)


def _residuals(at: np.ndarray, reach: np.ndarray, usual: float, focal_spread: float) -> np.ndarray:
    prior = _PRIOR * np.column_stack([(at[:, 3] - usual) / focal_spread, at[:, 2] / _ROLL_RAD])
    return np.hstack([_support_distances(_projected(at)) - reach, prior])


def _levenberg_marquardt_step(
    at: np.ndarray, value: np.ndarray, damping: np.ndarray, reach: np.ndarray, usual: float, focal_spread: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return all fits after one Levenberg-Marquardt step; steps that do not improve are rejected and damped more."""
    count, width = at.shape
    moved = np.repeat(at[:, None], width, axis=1) + np.diag(_STEPS)
    ahead = _residuals(moved.reshape(-1, width), reach, usual, focal_spread).reshape(count, width, -1)
    slopes = (ahead - value[:, None]) / _STEPS[:, None]
    gram, slope = slopes @ slopes.transpose(0, 2, 1), (slopes @ value[..., None])[..., 0]
    diagonal = np.eye(width) * (damping[:, None] * np.diagonal(gram, axis1=1, axis2=2) + 1e-12)[:, None]
    step = -np.linalg.solve(gram + diagonal, slope[..., None])[..., 0]
    trial = _clip_parameters(at + np.clip(step, -0.5, 0.5))
    tried = _residuals(trial, reach, usual, focal_spread)
    nearer = (tried**2).sum(1) < (value**2).sum(1)
    return (
        np.where(nearer[:, None], trial, at),
        np.where(nearer[:, None], tried, value),
        np.clip(np.where(nearer, damping / 3, damping * 8), 1e-6, 1e6),
    )


def _clip_parameters(at: np.ndarray) -> np.ndarray:
    low = np.full(at.shape[1], -np.inf)
    high = -low
    low[1], high[1] = np.radians([1.0, 89.0])
    low[3], high[3] = np.log([LEAST_PERSPECTIVE, MOST_PERSPECTIVE])
    low[4:6], high[4:6] = np.log([LEAST_PROPORTION, MOST_PROPORTION])
    return np.clip(at, low, high)


def _block_view(at: np.ndarray, off: float) -> BlockView:
    """Return a fit with its front within 45 degrees of the camera: a rotation by 90 degrees exchanges width and depth."""
    quarters = round(float(at[0]) / (np.pi / 2))
    width, depth = np.exp(at[4:6] if quarters % 2 == 0 else at[5:3:-1])
    view = View(
        yaw_rad=float(at[0]) - quarters * np.pi / 2,
        elevation_rad=float(at[1]),
        roll_rad=float(at[2]),
        perspective=float(np.exp(at[3])),
        scale=float(np.exp(at[6])),
        x=float(at[7]),
        y=float(at[8]),
    )
    return BlockView(float(width), float(depth), view, off)


def _is_similar(one: BlockView, other: BlockView) -> bool:
    sides = np.abs(np.log([one.width / other.width, one.depth / other.depth]))
    angles = np.abs([one.view.elevation_rad - other.view.elevation_rad, one.view.yaw_rad - other.view.yaw_rad])
    return bool(sides.max() < _SIMILAR_LOG_PROPORTION and angles.max() < _SIMILAR_VIEW_RAD)
