"""Overlay picture of a decision: the view with each pose's outline and shading, and the object frame."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np

from manitwin.geometry.poses import transform_points
from manitwin.scenes.locate.depth_view import DepthView, known_depth
from manitwin.scenes.locate.estimate import PoseEstimate
from manitwin.scenes.locate.pose_model import PoseModel
from manitwin.scenes.locate.pose_scoring import PixelSamples, rendered_depth_m

PANEL_PX = 480
COLORS = ((40, 200, 80), (255, 150, 30), (200, 80, 220), (60, 170, 255))
"""Colours of poses, best first."""
MASK_COLOR = (255, 220, 40)
AXES = ((220, 50, 50), (60, 190, 60), (60, 110, 255))
_AROUND, _TINT, _HIDDEN_TINT = 0.35, 0.5, 0.18


def overlay(
    view: DepthView, mask: np.ndarray, model: PoseModel, poses: Sequence[PoseEstimate], tolerance_m: float
) -> np.ndarray:
    """Return two panels ``(480, 960, 3) uint8`` cropped to the object: the view with the mask's outline, and with the poses.

    Hidden parts are shaded less. The axes x, y, z of the best pose are red, green and blue.
    """
    base = view.rgb if view.rgb is not None else shaded_depth(view)
    shapes = [_drawn(view, model, pose.object_to_camera, tolerance_m) for pose in poses]
    left, top, side = _crop(mask | np.any([hit for hit, _ in shapes], axis=0) if shapes else mask)
    scale = PANEL_PX / side
    plain = _cut(base, left, top, side)
    panels = [plain.copy(), plain.copy()]
    _outline(panels[0], _cut(mask.astype(np.uint8), left, top, side), MASK_COLOR)
    for place in reversed(range(len(shapes))):
        hit, seen = (_cut(each.astype(np.uint8), left, top, side).astype(bool) for each in shapes[place])
        color = np.array(COLORS[place % len(COLORS)], float)
        if place == 0:
            tint = np.where(seen, _TINT, np.where(hit, _HIDDEN_TINT, 0.0))[..., None]
            panels[1] = (panels[1] * (1 - tint) + color * tint).astype(np.uint8)
        _outline(panels[1], hit.astype(np.uint8), COLORS[place % len(COLORS)])
    if poses:
        _axes(panels[1], view, model, poses[0].object_to_camera, np.array([left, top]), scale)
    return np.concatenate(panels, axis=1)


def shaded_depth(view: DepthView) -> np.ndarray:
    """Return depths as grey, near is light, unknown is dark red, ``(H, W, 3) uint8``."""
    known = known_depth(view)
    near, far = np.quantile(view.depth_m[known], [0.01, 0.99]) if known.any() else (0.0, 1.0)
    grey = 235 - 190 * np.clip((np.where(known, view.depth_m, far) - near) / max(far - near, 1e-6), 0, 1)
    picture = np.repeat(grey[..., None], 3, axis=2)
    picture[view.depth_m == 0] = (70, 25, 25)
    return picture.astype(np.uint8)


def _drawn(view: DepthView, model: PoseModel, pose: np.ndarray, tolerance_m: float) -> tuple[np.ndarray, np.ndarray]:
    """Return where an object is rendered, and where nothing nearer hides it, each ``(H, W) bool``."""
    height, width = view.depth_m.shape
    corners = view.project(transform_points(pose, model.points))
    low = np.clip(np.floor(corners.min(0)).astype(int) - 2, 0, [width, height])
    high = np.clip(np.ceil(corners.max(0)).astype(int) + 2, 0, [width, height])
    rows, columns = np.mgrid[low[1] : high[1], low[0] : high[0]]
    pixels = (rows * width + columns).ravel()
    rays = view.rays(pixels)
    stretch = np.linalg.norm(rays, axis=1)
    seen_m = view.depth_m.ravel()[pixels]
    evidence = PixelSamples(rays / stretch[:, None], stretch, seen_m, np.ones(len(pixels)), 0, pixels)
    depth = rendered_depth_m(model, pose[None], evidence)[0][0]
    hit, seen = np.zeros(height * width, bool), np.zeros(height * width, bool)
    hit[pixels] = np.isfinite(depth)
    seen[pixels] = np.isfinite(depth) & ((depth < seen_m + tolerance_m) | (seen_m == 0))
    return hit.reshape(height, width), seen.reshape(height, width)


def _crop(shown: np.ndarray) -> tuple[int, int, int]:
    """Return left, top and side of the square around the shown pixels; it may exceed the picture."""
    rows, columns = np.flatnonzero(shown.any(1)), np.flatnonzero(shown.any(0))
    side = int((1 + 2 * _AROUND) * max(int(np.ptp(rows)), int(np.ptp(columns)), 24))
    return int((columns[0] + columns[-1] - side) // 2), int((rows[0] + rows[-1] - side) // 2), side


def _cut(picture: np.ndarray, left: int, top: int, side: int) -> np.ndarray:
    padded = cv2.copyMakeBorder(picture, side, side, side, side, cv2.BORDER_CONSTANT, value=(0, 0, 0))
    cut = padded[top + side : top + 2 * side, left + side : left + 2 * side]
    how = cv2.INTER_NEAREST if picture.ndim == 2 else cv2.INTER_CUBIC
    return np.asarray(cv2.resize(cut, (PANEL_PX, PANEL_PX), interpolation=how))


def _outline(picture: np.ndarray, mask: np.ndarray, color: tuple[int, int, int]) -> None:
    contours, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    cv2.drawContours(picture, contours, -1, color, 2, cv2.LINE_AA)


def _axes(
    picture: np.ndarray, view: DepthView, model: PoseModel, pose: np.ndarray, corner_px: np.ndarray, scale: float
) -> None:
    length_m = 0.4 * model.diameter_m
    ends = np.array([np.zeros(3), *(length_m * np.eye(3))]) + np.array([model.center[0], model.center[1], 0.0])
    at = (view.project(transform_points(pose, ends)) - corner_px) * scale
    for end, color in zip(at[1:], AXES, strict=True):
        start, stop = (tuple(np.rint(each).astype(int).tolist()) for each in (at[0], end))
        cv2.arrowedLine(picture, start, stop, (255, 255, 255), 4, cv2.LINE_AA, tipLength=0.15)
        cv2.arrowedLine(picture, start, stop, color, 2, cv2.LINE_AA, tipLength=0.15)
