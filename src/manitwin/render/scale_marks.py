"""Size annotations on images: a dimension line along the longest extent, and a scale bar."""

from __future__ import annotations

from collections.abc import Sequence

import cv2
import numpy as np
from PIL import Image, ImageDraw

from manitwin.render.cameras import Camera, project
from manitwin.render.markers import INK, PAPER, font_of, font_px

BAR_SHARE = 0.3
"""Fraction of the image width: largest length of a scale bar."""
ROUND_LENGTHS_M = tuple(digit * 10.0**power for power in (-3, -2, -1, 0) for digit in (1, 2, 5))
_TICK_PX, _MARGIN_SHARE = 7.0, 0.03


def best_camera(segments_m: np.ndarray, cameras: Sequence[Camera]) -> tuple[int, int]:
    """Return the camera, and the index of the parallel segment ``(S, 2, 3)``, that show the length best.

    The camera is the one in which a segment is longest relative to the image; the segment is the one farthest from the
    segments' centre, where the object hides least of it.
    """
    lengths = []
    for camera in cameras:
        ends = project(segments_m.reshape(-1, 3), camera)[0].reshape(-1, 2, 2)
        lengths.append(
            float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).max()) / max(camera.width_px, camera.height_px)
        )
    best = int(np.argmax(lengths))
    middles = project(segments_m.mean(1), cameras[best])[0]
    return best, int(np.argmax(np.linalg.norm(middles - middles.mean(0), axis=1)))


def draw_dimension(
    picture: np.ndarray, ends_m: np.ndarray, camera: Camera, label: str, color: tuple[int, int, int]
) -> np.ndarray:
    """Return an image ``(H, W, 3) uint8`` with a line between two points ``(2, 3)``, ticks at both ends, and a label in the
    middle.

    If the line leaves the image, the image is extended with its plain background, the colour of its corner.
    """
    ends = project(np.asarray(ends_m, dtype=float), camera)[0]
    height, width = picture.shape[:2]
    room = 2 * _TICK_PX
    before = np.clip(np.ceil(room - ends.min(0)), 0, width + height).astype(int)
    after = np.clip(np.ceil(ends.max(0) + room - [width, height]), 0, width + height).astype(int)
    picture = cv2.copyMakeBorder(
        picture, before[1], after[1], before[0], after[0], cv2.BORDER_CONSTANT, value=picture[0, 0].tolist()
    )
    start, stop = ends + before
    along = (stop - start) / max(float(np.linalg.norm(stop - start)), 1e-9)
    across = np.array([-along[1], along[0]]) * _TICK_PX
    canvas = np.ascontiguousarray(picture.copy())
    for shade, width in ((PAPER, 5), (color, 3)):
        for first, second in ((start, stop), (start - across, start + across), (stop - across, stop + across)):
            cv2.line(canvas, _pixel(first), _pixel(second), shade, width, cv2.LINE_AA)
    return _labelled(canvas, (start + stop) / 2, label, color)


def draw_scale_bar(picture: np.ndarray, camera: Camera, middle_m: np.ndarray) -> np.ndarray:
    """Return an image ``(H, W, 3) uint8`` with a scale bar of a round length at the lower left, to scale at ``middle_m (3,)``.

    The image is in perspective: nearer objects appear larger.
    """
    depth_m = float(project(np.asarray(middle_m, dtype=float)[None], camera)[1][0])
    px_per_m = camera.focal_px / depth_m
    fitting = [each for each in ROUND_LENGTHS_M if each * px_per_m <= BAR_SHARE * camera.width_px]
    length_m = max(fitting, default=ROUND_LENGTHS_M[0])
    text = font_px(camera.width_px, camera.height_px)
    margin = _MARGIN_SHARE * camera.width_px
    start = np.array([margin, camera.height_px - margin - _TICK_PX])
    stop = start + np.array([length_m * px_per_m, 0])
    canvas = np.ascontiguousarray(picture.copy())
    up = np.array([0.0, _TICK_PX])
    for shade, width in ((PAPER, 5), (INK, 3)):
        for first, second in ((start, stop), (start - up, start + up), (stop - up, stop + up)):
            cv2.line(canvas, _pixel(first), _pixel(second), shade, width, cv2.LINE_AA)
    return _labelled(canvas, (start + stop) / 2 - [0, 1.2 * text], length_words(length_m), INK)


def length_words(length_m: float) -> str:
    """Return a round length as '5 mm', '20 cm' or '1 m'."""
    if length_m < 0.01:
        return f"{1000 * length_m:.0f} mm"
    return f"{100 * length_m:.0f} cm" if length_m < 1 else f"{length_m:.0f} m"


def _labelled(canvas: np.ndarray, at: np.ndarray, label: str, color: tuple[int, int, int]) -> np.ndarray:
    height, width = canvas.shape[:2]
    font = font_of(font_px(width, height))
    left, top, right, bottom = font.getbbox(label)
    half = np.array([right - left, bottom - top]) / 2 + 4
    low = np.clip(np.rint(at - half), 0, np.maximum(np.array([width, height]) - 2 * half - 1, 0))
    image = Image.fromarray(canvas)
    draw = ImageDraw.Draw(image)
    draw.rounded_rectangle((*low, *(low + 2 * half)), radius=3, fill=color, outline=PAPER)
    luminance = float(np.dot(color, (0.299, 0.587, 0.114)))
    draw.text(tuple(low + half), label, fill=INK if luminance > 150 else PAPER, font=font, anchor="mm")
    return np.asarray(image)


def _pixel(place: np.ndarray) -> tuple[int, int]:
    column, row = np.clip(np.rint(place - 0.5), -10_000, 10_000)
    return int(column), int(row)
